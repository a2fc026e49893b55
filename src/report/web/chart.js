// SPDX-License-Identifier: MIT
// A document's chart over one x axis, with a legend that tells the values under the cursor.
import { limits } from "./curves.js";
import { isNumber, plain, powers, significant } from "./format.js";
import { entry } from "./markup.js";
import { axis, AXIS_WIDTH, makePlot, renew } from "./plot.js";
import { bandsOf, columnsOf, counting, curvesOf, extentOf, groupOf, pointAt, rangeOf, shapesOf } from "./series.js";
import { colour } from "./theme.js";
import { linearTicks, logLabels, logTicks, phaseTicks } from "./ticks.js";

const HEIGHT = 280;
/** How dense bands and regions are: what lies behind stays readable. */
const BAND = 0.2;
const REGION = 0.16;
const FAINT = 0.35;
/** A line through more points is thinner: it would become a bar. */
const MANY = 1000;
const SWATCH = {
  line: (c) => `<path d="M1 7h22" stroke="var(--${c})" stroke-width="2.4"/>`,
  dashed: (c) => `<path d="M1 7h22" stroke="var(--${c})" stroke-width="2.2" stroke-dasharray="5 3"/>`,
  points: (c) => `<circle cx="12" cy="7" r="3.8" fill="var(--${c})"/>`,
  faint: (c) => `<circle cx="12" cy="7" r="3.2" fill="var(--${c})" opacity="${FAINT}"/>`,
  band: (c) => `<path d="M1 2h22v10h-22z" fill="var(--${c})" opacity="${BAND}"/>`,
  rectangle: (c) => `<path d="M1 2h22v10h-22z" fill="var(--${c})" opacity="${REGION}"/>`,
  circle: (c) => `<circle cx="12" cy="7" r="5.5" fill="none" stroke="var(--${c})" stroke-width="1.6"/>`,
  cross: (c) => `<path d="M7 7h10M12 2v10" stroke="var(--${c})" stroke-width="1.8"/>`,
};

/** The names of the curves, each with room for a reading, and of the regions; `where` tells what is read. */
export function legendOf(curves, shapes = []) {
  const box = document.createElement("div");
  box.className = "legend curves";
  box.setAttribute("aria-live", "polite");
  box.innerHTML = curves.map((c) => entry((SWATCH[c.mark] ?? SWATCH.line)(c.colour), c.name, "<b></b>")).join("") +
    regionLegend(shapes) + '<span class="where screen-only"></span>';
  const values = [...box.querySelectorAll("b")];
  const where = box.querySelector(".where");
  return {
    box,
    show: (text, readings) => {
      where.textContent = text;
      values.forEach((b, i) => { b.textContent = readings[i] ?? ""; });
    },
  };
}

function regionLegend(shapes) {
  const named = shapes.filter((s, i) => s.name && shapes.findIndex((o) => o.name === s.name) === i);
  return named.map((s) => entry((SWATCH[s.kind] ?? SWATCH.rectangle)(s.colour), s.name)).join("");
}

/** Draws a chart at the end of `place`. Returns how to show another one of the same axes there: its curves may be others.
 *  `onZoom` is told the part of the x axis that is shown. */
export function drawChart(place, chart, { height, onZoom } = {}) {
  const shown = {};
  const take = (next) => {
    const curves = curvesOf(next);
    const given = { x: rangeOf(next.x_range), y: rangeOf(next.y_range) };
    const extent = extentOf(curves);
    if (given.x) extent.x = given.x;
    Object.assign(shown, { curves, shapes: shapesOf(next), given, extent });
  };
  take(chart);
  const log = chart.log_x === true;
  const where = chart.time_x === true ? momentText : (x) => `at ${significant(x, 4)}`;
  let legend = legendOf(shown.curves, shown.shapes);
  const upright = document.createElement("div");
  upright.className = "axis-name";
  upright.textContent = powers(chart.y_label);
  const host = document.createElement("div");
  host.className = "plot";
  place.append(legend.box, upright, host);
  const plot = makePlot(host, {
    height: height ?? HEIGHT, label: `${chart.title}: ${chart.y_label} over ${chart.x_label}`, group: groupOf(chart, shown.extent),
    data: columnsOf(shown.curves), padding: [8, 14, 0, 0], onZoom,
    rings: shown.curves.flatMap((c, i) => (isPoints(c) ? [i + 1] : [])),
    scales: { x: xScale(shown, chart), y: { range: (u) => yLimits(u, shown.curves, shown.extent.x, shown.given.y) } },
    hooks: { drawAxes: [(u) => drawBehind(u, shown.curves, shown.shapes)] },
    axes: [chart.time_x === true ? timeAxis() : xAxis(chart.x_label, log), axis({
      size: (u, labels) => Math.max(AXIS_WIDTH, ...(labels ?? []).map((text) => 13 + 7 * text.length)),
      splits: (u, i, low, high) => (/\bdeg(rees)?$/.test(chart.y_label ?? "") ? phaseTicks : linearTicks)(low, high, Math.max(3, Math.floor(u.height / 44))),
      values: (u, splits) => splits.map((v) => plain(v)),
    })],
    series: [{}, ...shown.curves.map(seriesOf)],
    onCursor: (x) => {
      if (x === null) return legend.show("", []);
      const points = shown.curves.map((c) => pointAt(c.points, x, log));
      legend.show(where(x), points.map(readingOf));
    },
  });
  const kind = () => JSON.stringify([shown.curves.map((c) => [c.name, c.mark]), shown.shapes.map((s) => [s.name, s.kind])]);
  let drawn = kind();
  return (next) => {
    take(next);
    if (kind() === drawn) return renew(plot, columnsOf(shown.curves), shown.given.x);
    drawn = kind();
    const box = legend.box;
    legend = legendOf(shown.curves, shown.shapes);
    box.replaceWith(legend.box);
    while (plot.series.length > 1) plot.delSeries(plot.series.length - 1);
    shown.curves.forEach((c) => plot.addSeries(seriesOf(c)));
    renew(plot, columnsOf(shown.curves), shown.given.x);
  };
}

const two = (n) => String(n).padStart(2, "0");

/** UNIX seconds as a reader's own date and time, with what it is ahead of UTC. */
export function momentText(seconds) {
  const d = new Date(1000 * seconds), ahead = -d.getTimezoneOffset(), minutes = Math.abs(ahead);
  const zone = `${ahead < 0 ? "-" : "+"}${two(Math.floor(minutes / 60))}:${two(minutes % 60)}`;
  return `${d.getFullYear()}-${two(d.getMonth() + 1)}-${two(d.getDate())} ${two(d.getHours())}:${two(d.getMinutes())}:${two(d.getSeconds())} ${zone}`;
}

function readingOf(p) {
  if (!p || (p.y === null && !isNumber(p.lower))) return "";
  if (p.y === null) return `${significant(p.lower, 4)} … ${significant(p.upper, 4)}`;
  return significant(p.y, 4) + (isNumber(p.lower) ? ` ± ${significant((p.upper - p.lower) / 2, 2)}` : "");
}

/** Regions, then bands, under the curves. */
function drawBehind(u, curves, shapes) {
  const { ctx, bbox } = u;
  const at = (value, axis) => {
    const [low, high] = axis === "x" ? [bbox.left, bbox.left + bbox.width] : [bbox.top + bbox.height, bbox.top];
    if (!Number.isFinite(value)) return value < 0 ? low : high;
    return u.valToPos(value, axis, true);
  };
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.globalAlpha = REGION;
  for (const s of shapes) {
    if (s.kind !== "rectangle") continue;
    ctx.fillStyle = colour(s.colour);
    // What is short on a long axis still shows.
    const wide = Math.max(at(s.xEnd, "x") - at(s.x, "x"), 2 * uPlot.pxRatio);
    ctx.fillRect(at(s.x, "x"), at(s.y, "y"), wide, at(s.yEnd, "y") - at(s.y, "y"));
  }
  ctx.globalAlpha = BAND;
  for (const curve of curves) {
    ctx.fillStyle = colour(curve.colour);
    for (const stretch of bandsOf(curve.points)) {
      ctx.beginPath();
      stretch.forEach((p) => ctx.lineTo(at(p.x, "x"), at(p.upper, "y")));
      [...stretch].reverse().forEach((p) => ctx.lineTo(at(p.x, "x"), at(p.lower, "y")));
      ctx.fill();
    }
  }
  ctx.restore();
}

const isPoints = (curve) => curve.mark === "points" || curve.mark === "faint";

function seriesOf(curve) {
  const pale = curve.mark === "faint" ? Math.round(255 * FAINT).toString(16) : "";
  const tint = () => colour(curve.colour) + pale;
  if (isPoints(curve)) {
    return { paths: () => null, stroke: tint, points: { show: true, size: curve.points.length > 200 ? 4 : curve.mark === "faint" ? 5 : 7, width: 0, stroke: tint, fill: tint } };
  }
  return {
    stroke: tint, width: curve.points.length > MANY ? 1.1 : curve.mark === "dashed" ? 1.6 : 1.8, dash: curve.mark === "dashed" ? [6, 4] : undefined,
    paths: uPlot.paths.linear(), points: { show: false },
  };
}

function xScale(shown, { log_x: log, time_x: time }) {
  const whole = () => {
    const [low, high] = shown.extent.x;
    const room = log ? 1.04 : time ? 0 : 0.01 * (high - low) || 1;
    return log ? [low / room, high * room] : [low - room, high + room];
  };
  return {
    time: time === true, distr: log ? 3 : 1,
    range: (u, min, max) => {
      const [low, high] = shown.extent.x;
      const usable = isNumber(min) && isNumber(max) && max > min && (!log || max / min > 1.002);
      return !usable || (min <= low && max >= high) ? whole() : [min, max];
    },
  };
}

/** What lies within the shown part of the x axis, with a margin; of bands around curves no more than the curves' own
 *  span beyond them. The range that the document sets holds as long as the whole axis is shown. */
function yLimits(u, curves, whole, given) {
  const [first, last] = u.series[0].idxs ?? [0, u.data[0].length - 1];
  const [low, high] = [u.data[0][first], u.data[0][last]];
  const { min, max } = u.scales.x;
  if (given && !(max - min < 0.98 * (whole[1] - whole[0]))) return given;
  const shown = counting(curves).flatMap((c) => c.points.filter((p) => p.x >= low && p.x <= high));
  const values = shown.flatMap((p) => (p.y !== null ? [p.y] : isNumber(p.lower) ? [p.lower, p.upper] : []));
  const bounds = shown.flatMap((p) => (p.y !== null && isNumber(p.lower) ? [p.lower, p.upper] : []));
  const numbers = values.filter(isNumber);
  const allow = numbers.reduce((a, b) => Math.max(a, b), -Infinity) - numbers.reduce((a, b) => Math.min(a, b), Infinity);
  return limits(values, bounds, { least: 0, allow: allow > 0 ? allow : Infinity });
}

/** Dates and times of the day as long as they differ: uPlot's own places, written as ISO 8601 does. */
function timeAxis() {
  const [day, hours, clock] = ["{YYYY}-{MM}-{DD}", "{HH}:{mm}", "{HH}:{mm}:{ss}"];
  return axis({
    size: 38, space: 74,
    values: [
      [3600 * 24 * 365, "{YYYY}", null, null, null, null, null, null, 1],
      [3600 * 24 * 28, "{YYYY}-{MM}", null, null, null, null, null, null, 1],
      [3600 * 24, day, null, null, null, null, null, null, 1],
      [60, hours, "\n" + day, null, "\n" + day, null, null, null, 1],
      [1, clock, "\n" + day, null, "\n" + day, null, null, null, 1],
      [0.001, clock + ".{fff}", "\n" + day, null, "\n" + day, null, null, null, 1],
    ],
  });
}

export function xAxis(label, log) {
  return axis({
    size: 24, label, labelSize: 18, labelGap: 0, labelFont: "12px system-ui, sans-serif",
    splits: (u, i, low, high) => {
      const { min, max } = u.scales.x;
      return log ? logTicks(min, max) : linearTicks(low, high, Math.max(4, Math.floor(u.width / 90)));
    },
    filter: (u, splits) => splits,
    values: (u, splits) => {
      if (!log) return splits.map((v) => plain(v));
      const { min, max } = u.scales.x;
      const shown = logLabels(splits, min, max, u.bbox.width / uPlot.pxRatio);
      return splits.map((v) => (shown.has(v) ? plain(v) : ""));
    },
  });
}
