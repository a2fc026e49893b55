// SPDX-License-Identifier: MIT
// A document's chart over one x axis, with a legend that tells the values under the cursor.
import { limits } from "./curves.js";
import { escapeHtml, isNumber, plain, significant } from "./format.js";
import { axis, AXIS_WIDTH, makePlot } from "./plot.js";
import { columnsOf, curvesOf, extentOf, groupOf, pointAt } from "./series.js";
import { colour } from "./theme.js";
import { linearTicks, logLabels, logTicks } from "./ticks.js";

const HEIGHT = 280;
const SWATCH = {
  line: (c) => `<path d="M1 7h22" stroke="var(--${c})" stroke-width="2.4"/>`,
  dashed: (c) => `<path d="M1 7h22" stroke="var(--${c})" stroke-width="2.2" stroke-dasharray="5 3"/>`,
  points: (c) => `<circle cx="12" cy="7" r="3.8" fill="var(--${c})"/>`,
};

/** The names of the curves, each with room for a reading; `where` tells what is read. */
export function legendOf(curves) {
  const box = document.createElement("div");
  box.className = "legend curves";
  box.innerHTML = curves.map((c) =>
    `<span><svg viewBox="0 0 24 14" aria-hidden="true">${(SWATCH[c.mark] ?? SWATCH.line)(c.colour)}</svg>` +
    `${escapeHtml(c.name)}<b></b></span>`).join("") + '<span class="where screen-only"></span>';
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

export function drawChart(place, chart) {
  const curves = curvesOf(chart);
  const extent = extentOf(curves);
  const log = chart.log_x === true;
  const legend = legendOf(curves);
  const upright = document.createElement("div");
  upright.className = "axis-name";
  upright.textContent = chart.y_label;
  const host = document.createElement("div");
  host.className = "plot";
  place.append(legend.box, upright, host);
  makePlot(host, {
    height: HEIGHT, label: `${chart.title}: ${chart.y_label} over ${chart.x_label}`, group: groupOf(chart, extent),
    data: columnsOf(curves), padding: [8, 14, 0, 0],
    rings: curves.flatMap((c, i) => (c.mark === "points" ? [i + 1] : [])),
    scales: { x: xScale(extent, log), y: { range: (u) => yLimits(u, curves) } },
    axes: [xAxis(chart.x_label, log), axis({
      size: AXIS_WIDTH, splits: (u, i, low, high) => linearTicks(low, high, Math.max(2, Math.floor(u.height / 44))),
      values: (u, splits) => splits.map((v) => plain(v)),
    })],
    series: [{}, ...curves.map(seriesOf)],
    onCursor: (x) => {
      if (x === null) return legend.show("", []);
      const points = curves.map((c) => pointAt(c.points, x, log));
      legend.show(`at ${significant(x, 4)}`, points.map((p) => (p && p.y !== null ? significant(p.y, 4) : "")));
    },
  });
}

function seriesOf(curve) {
  const tint = () => colour(curve.colour);
  if (curve.mark === "points") {
    return { paths: () => null, stroke: tint, points: { show: true, size: 7, width: 0, stroke: tint, fill: tint } };
  }
  return {
    stroke: tint, width: curve.mark === "dashed" ? 1.6 : 1.8, dash: curve.mark === "dashed" ? [6, 4] : undefined,
    paths: uPlot.paths.linear(), points: { show: false },
  };
}

function xScale({ x: [low, high] }, log) {
  const room = log ? 1.04 : 0.01 * (high - low) || 1;
  const whole = log ? [low / room, high * room] : [low - room, high + room];
  return {
    time: false, distr: log ? 3 : 1,
    range: (u, min, max) => {
      const usable = isNumber(min) && isNumber(max) && max > min && (!log || max / min > 1.002);
      return !usable || (min <= low && max >= high) ? whole : [min, max];
    },
  };
}

/** What lies within the shown part of the x axis, with a margin. */
function yLimits(u, curves) {
  const [first, last] = u.series[0].idxs ?? [0, u.data[0].length - 1];
  const [low, high] = [u.data[0][first], u.data[0][last]];
  const shown = curves.flatMap((c) => c.points.filter((p) => p.x >= low && p.x <= high).map((p) => p.y));
  return limits(shown, [], { least: 0 });
}

function xAxis(label, log) {
  return axis({
    size: 24, label, labelSize: 18, labelGap: 0, labelFont: "12px system-ui, sans-serif",
    splits: (u, i, low, high) => {
      const { min, max } = u.scales.x;
      return log ? logTicks(min, max) : linearTicks(low, high, Math.max(2, Math.floor(u.width / 90)));
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
