// SPDX-License-Identifier: MIT
// The recorded signals, and what the model leaves of the output.
import { limits } from "./curves.js";
import { isNumber, list, plain, prettyUnit, significant } from "./format.js";
import { section } from "./markup.js";
import { axis, AXIS_WIDTH, makePlot } from "./plot.js";
import { colour } from "./theme.js";
import { linearTicks } from "./ticks.js";

const ROLE = { excitation: "Excitation", input: "Input", output: "Output" };

export function drawSignals(root, data) {
  const { signals, residual } = data.page ?? {};
  const charts = list(signals?.channels).map((c) => ({
    title: ROLE[c.role] ?? c.role ?? "Signal", name: c.name ?? "", unit: c.unit ?? "", time: list(signals.time_s),
    min: list(c.min), max: list(c.max), tint: c.role === "output" ? "measured" : "signal",
  }));
  if (residual) {
    charts.push({
      title: "Residual", name: "output less the simulated model", unit: residual.unit ?? "", time: list(residual.time_s),
      min: list(residual.min), max: list(residual.max), tint: "resonance",
    });
  }
  const filled = charts.filter((c) => c.time.length > 1 && c.min.some(isNumber));
  if (filled.length === 0) return;
  const box = section(root, "Signals",
    "The recording as it was used. A good residual looks like noise; where it is correlated with the excitation, the model lacks dynamics.", "whole");
  const readout = document.createElement("div");
  readout.className = "readout";
  readout.setAttribute("aria-live", "polite");
  box.append(readout);
  const hint = "Move over a chart, or touch it, to read values. Drag to zoom, double-click to reset.";
  readout.textContent = hint;
  const onCursor = (t) => {
    if (t === null) readout.textContent = hint;
    else readout.replaceChildren(...reading(t, filled));
  };
  const ends = filled.flatMap((c) => [c.time[0], c.time[c.time.length - 1]]);
  const span = [Math.min(...ends), Math.max(...ends)];
  filled.forEach((chart, i) => drawChannel(box, chart, span, i === filled.length - 1, onCursor));
}

function reading(t, charts) {
  const cell = (text) => {
    const span = document.createElement("span");
    span.textContent = text;
    return span;
  };
  return [cell(`${plain(t, 5)} s`), ...charts.map((c) => {
    const i = closest(c.time, t);
    const [low, high] = [c.min[i], c.max[i] ?? c.min[i]];
    const value = low === high || !isNumber(high) ? significant(low, 3) : `${significant(low, 3)} … ${significant(high, 3)}`;
    return cell(`${c.title} ${value} ${prettyUnit(c.unit)}`);
  })];
}

/** A constant signal gets an axis too, and rounding noise on a large offset is not blown up. */
function leastSpan(min, max) {
  const size = Math.max(Math.abs(min), Math.abs(max));
  return max > min ? 1e-3 * size : 0.2 * size || 2;
}

function closest(times, t) {
  let best = 0;
  times.forEach((x, i) => { if (Math.abs(x - t) < Math.abs(times[best] - t)) best = i; });
  return best;
}

function drawChannel(box, chart, span, last, onCursor) {
  const wrap = document.createElement("div");
  wrap.className = "chart";
  const caption = document.createElement("div");
  caption.className = "caption";
  caption.textContent = chart.title;
  const more = document.createElement("span");
  more.textContent = ` ${chart.name}${chart.unit ? ` in ${prettyUnit(chart.unit)}` : ""}`;
  caption.append(more);
  const host = document.createElement("div");
  host.className = "plot";
  wrap.append(caption, host);
  box.append(wrap);
  const clean = (values) => chart.time.map((_, i) => (isNumber(values[i]) ? values[i] : null));
  const low = clean(chart.min);
  const high = chart.max.length ? clean(chart.max) : low;
  const height = last ? 158 : 124;
  const stroke = () => colour(chart.tint);
  const series = { width: 1.2, stroke, points: { show: false } };
  makePlot(host, {
    height, label: `${chart.title} ${chart.name} over time`, group: "signals", data: [chart.time, low, high], rings: [],
    padding: [8, 14, 0, 0],
    scales: {
      x: { time: false, range: (u, min, max) => (isNumber(min) && max > min && (min > chart.time[0] || max < chart.time[chart.time.length - 1]) ? [min, max] : span) },
      y: { range: (u, min, max) => (isNumber(min) ? limits([min, max], [], { least: leastSpan(min, max) }) : [0, 1]) },
    },
    axes: [
      axis({ size: last ? 24 : 8, splits: (u, i, a, b) => linearTicks(a, b, Math.max(3, Math.floor(u.width / 90))),
        values: (u, splits) => splits.map((x) => (last ? plain(x, 5) : "")),
        ...(last ? { label: "time in s", labelSize: 18, labelGap: 0, labelFont: "12px system-ui, sans-serif" } : {}) }),
      axis({ size: AXIS_WIDTH, splits: (u, i, a, b) => linearTicks(a, b, 5), values: (u, splits) => splits.map((x) => plain(x, 4)) }),
    ],
    series: [{}, series, series],
    bands: [{ series: [2, 1], fill: () => colour(chart.tint) + "66" }],
    onCursor,
  });
}
