// SPDX-License-Identifier: MIT
// Curves of a document's chart as the pictures need them. Pure functions.
import { isNumber, list } from "./format.js";

/** So many colours there are (--c0 ...); more curves begin again. */
export const COLOURS = 8;
/** So many colours of regions there are (--r0 ...). */
export const REGIONS = 4;

/** That of bounds, wherever they stand among the curves. */
const BOUND = 2;

/** Curves with the points that can be drawn; a gap is a point whose y is null (in a plane x, too, may be). */
export function curvesOf(chart) {
  let last = -1;
  const [names, indices] = [[], []];
  return list(chart.curves).map((curve) => {
    // What says little, and a model, have the colour of the curve that they belong to.
    const of = /^model of (.*)$/.exec(String(curve.name ?? ""));
    const owner = of ? names.indexOf(of[1]) : -1;
    names.push(String(curve.name ?? ""));
    const bound = /^bound\b/.test(String(curve.name ?? ""));
    if (owner < 0 && !bound && (curve.mark !== "faint" || last < 0)) ++last;
    indices.push(bound ? BOUND : owner < 0 ? last : indices[owner]);
    const x = list(curve.x);
    const y = list(curve.y);
    const at = list(curve.at);
    const lower = list(curve.lower);
    const upper = list(curve.upper);
    const points = [];
    x.forEach((value, k) => {
      if (!isNumber(value) || (chart.log_x && value <= 0)) {
        // In a plane a point may lack either coordinate; elsewhere a gap has its place.
        if (chart.equal_axes) points.push({ x: null, y: null, at: null });
        return;
      }
      const point = { x: value, y: isNumber(y[k]) ? y[k] : null, at: isNumber(at[k]) ? at[k] : null };
      points.push(isNumber(lower[k]) && isNumber(upper[k]) ? { ...point, lower: lower[k], upper: upper[k] } : point);
    });
    return { name: String(curve.name ?? ""), mark: curve.mark, unit: String(curve.at_unit ?? ""), colour: "c" + (indices[indices.length - 1] % COLOURS), points };
  });
}

/** One ascending axis for all curves. Where a curve has no point its column is undefined, which the plot passes over;
 *  null is a gap. */
export function columnsOf(curves) {
  const x = [...new Set(curves.flatMap((c) => c.points.map((p) => p.x)))].sort((a, b) => a - b);
  const index = new Map(x.map((value, i) => [value, i]));
  return [x, ...curves.map((curve) => {
    const column = new Array(x.length).fill(undefined);
    for (const p of curve.points) column[index.get(p.x)] = p.y;
    return column;
  })];
}

/** The point of a curve that lies nearest in x, null when the curve ends before it. */
export function pointAt(points, x, log = false) {
  if (points.length === 0) return null;
  const measure = log ? Math.log : (v) => v;
  let low = 0;
  let high = points.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (points[middle].x <= x) low = middle;
    else high = middle;
  }
  const best = Math.abs(measure(points[low].x) - measure(x)) <= Math.abs(measure(points[high].x) - measure(x)) ? low : high;
  const span = measure(points[points.length - 1].x) - measure(points[0].x);
  const away = Math.abs(measure(points[best].x) - measure(x));
  const step = points.length > 1 ? span / (points.length - 1) : Infinity;
  return points.length > 1 && away > Math.max(step, 0.02 * span) && (x < points[0].x || x > points[points.length - 1].x) ? null : points[best];
}

/** Those that the axes reach for: not what says little, unless there is nothing else. */
export function counting(curves) {
  const strong = curves.filter((c) => c.mark !== "faint");
  return strong.some((c) => c.points.length) ? strong : curves;
}

/** Lowest and highest of both coordinates; 0 ... 1 where there is no point. */
export function extentOf(all) {
  const curves = counting(all);
  const e = { x: [Infinity, -Infinity], y: [Infinity, -Infinity] };
  for (const { points } of curves) {
    for (const p of points) {
      for (const y of p.y !== null ? [p.y] : isNumber(p.lower) ? [p.lower, p.upper] : []) {
        e.x = [Math.min(e.x[0], p.x), Math.max(e.x[1], p.x)];
        e.y = [Math.min(e.y[0], y), Math.max(e.y[1], y)];
      }
    }
  }
  for (const key of ["x", "y"]) if (e[key][0] > e[key][1]) e[key] = [0, 1];
  return e;
}

/** The stretches over which a curve has a band, each as its points; none of fewer than two. */
export function bandsOf(points) {
  const stretches = [[]];
  for (const p of points) {
    if (isNumber(p.lower)) stretches[stretches.length - 1].push(p);
    else if (stretches[stretches.length - 1].length) stretches.push([]);
  }
  return stretches.filter((s) => s.length > 1);
}

/** The unit circle and a point to keep away from look the same in every plane; a circle named after a curve has its
 *  colour, and only what speaks against the data is red. */
function colourOf({ kind, x, y, radius, name }, curves, place) {
  if (kind === "cross") return "bad";
  if (kind === "circle" && radius === 1 && x === 0 && y === 0) return "soft";
  const owner = kind === "circle" ? curves.find((c) => c.name && String(name ?? "").startsWith(c.name + ":")) : undefined;
  if (owner) return owner.colour;
  const calm = kind === "rectangle" && !/^not /.test(String(name ?? ""));
  return "r" + ((place + (calm ? 2 : 0)) % REGIONS);
}

/** Regions behind the curves; those of one name share a colour. A side that is no number lies at the edge. */
export function shapesOf(chart) {
  const names = [];
  const curves = list(chart.shapes).some((s) => s.kind === "circle") ? curvesOf(chart) : [];
  return list(chart.shapes).map((s) => {
    const name = String(s.name ?? "");
    if (!names.includes(name)) names.push(name);
    const side = (v, edge) => (isNumber(v) ? v : edge);
    return {
      kind: s.kind, name, colour: colourOf(s, curves, names.indexOf(name)), radius: isNumber(s.radius) ? s.radius : 0,
      x: side(s.x, -Infinity), y: side(s.y, -Infinity), xEnd: side(s.x_end, Infinity), yEnd: side(s.y_end, Infinity),
    };
  });
}

/** [low, high] of an axis that the document sets, else null. */
export function rangeOf(range) {
  const [low, high] = list(range);
  return isNumber(low) && isNumber(high) && high > low ? [low, high] : null;
}

/** Charts whose x axes agree share cursor and zoom. */
export function groupOf(chart, extent) {
  return [chart.section, chart.x_label, chart.log_x, ...extent.x].join("|");
}
