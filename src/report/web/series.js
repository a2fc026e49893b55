// SPDX-License-Identifier: MIT
// Curves of a document's chart as the pictures need them. Pure functions.
import { isNumber, list } from "./format.js";

/** So many colours there are (--c0 ...); more curves begin again. */
export const COLOURS = 8;

/** Curves with the points that can be drawn; a gap is a point whose y is null (in a plane x, too, may be). */
export function curvesOf(chart) {
  return list(chart.curves).map((curve, i) => {
    const x = list(curve.x);
    const y = list(curve.y);
    const at = list(curve.at);
    const points = [];
    x.forEach((value, k) => {
      if (!isNumber(value) || (chart.log_x && value <= 0)) {
        // In a plane a point may lack either coordinate; elsewhere a gap has its place.
        if (chart.equal_axes) points.push({ x: null, y: null, at: null });
        return;
      }
      points.push({ x: value, y: isNumber(y[k]) ? y[k] : null, at: isNumber(at[k]) ? at[k] : null });
    });
    return { name: String(curve.name ?? ""), mark: curve.mark, unit: String(curve.at_unit ?? ""), colour: "c" + (i % COLOURS), points };
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

/** Lowest and highest of both coordinates; 0 ... 1 where there is no point. */
export function extentOf(curves) {
  const e = { x: [Infinity, -Infinity], y: [Infinity, -Infinity] };
  for (const { points } of curves) {
    for (const p of points) {
      if (p.y === null) continue;
      for (const key of ["x", "y"]) e[key] = [Math.min(e[key][0], p[key]), Math.max(e[key][1], p[key])];
    }
  }
  for (const key of ["x", "y"]) if (e[key][0] > e[key][1]) e[key] = [0, 1];
  return e;
}

/** Charts whose x axes agree share cursor and zoom. */
export function groupOf(chart, extent) {
  return [chart.section, chart.x_label, chart.log_x, ...extent.x].join("|");
}
