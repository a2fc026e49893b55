// SPDX-License-Identifier: MIT
// Magnitude, phase and coherence over one logarithmic frequency axis.
import { align, limits, measuredBode, modelBode, nearest, shownBand } from "./curves.js";
import { escapeHtml, isNumber, list, normalFactor, percent, plain, prettyUnit, significant } from "./format.js";
import { legend, section } from "./markup.js";
import { axis, AXIS_WIDTH, makePlot, onSheet, renew } from "./plot.js";
import { colour } from "./theme.js";
import { decibelTicks, linearTicks, logLabels, logTicks, phaseTicks } from "./ticks.js";

/** So many lines get a whisker each; more are drawn as a band. */
const WHISKERS = 40;

/** Draws the response at the end of `root`. Returns how to show another one there, which has the same kinds of curves.
 *  `page.names` may say what "measured" and "model" are, `page.explain` what is seen; `page.joined` joins the measured points, whose
 *  coherence was measured beside them. */
export function drawBode(root, data) {
  const context = contextOf(data);
  const { measured, model, confidence, load, loadModel, names, unit } = context;
  if (measured.length === 0 && model.length === 0) return null;
  const box = section(root, "Frequency response",
    data.page?.explain ?? explanation(measured, model, context.marks, confidence, data.page?.reduced, load), "whole sheet");
  box.append(legendOf(measured, model, confidence, load, loadModel, names));
  const readout = document.createElement("div");
  readout.className = "readout";
  readout.setAttribute("aria-live", "polite");
  box.append(readout);
  const hint = "Move over a chart, or touch it, to read values. Drag to zoom, double-click to reset.";
  readout.textContent = hint;
  Object.assign(context, {
    box, charts: [],
    onCursor: (f) => {
      if (f === null) readout.textContent = hint;
      else readout.innerHTML = reading(f, context.measured, context.model, unit, names);
    },
  });
  const coherence = measured.some((p) => p.coherence !== null);
  magnitude(context, false);
  phase(context, !coherence);
  if (coherence) coherenceChart(context, list(data.findings));
  return (next) => {
    Object.assign(context, contextOf(next));
    for (const { plot, columns } of context.charts) renew(plot, columns());
  };
}

/** What of the data is drawn. */
function contextOf(data) {
  const page = data.page ?? {};
  const confidence = page.confidence ?? 0.95;
  const model = modelBode(page.model_curve, confidence);
  const loadModel = modelBode(page.load_curve, confidence);
  return {
    confidence, model, loadModel, measured: measuredBode(data.frequency_response, confidence, model, page.joined !== true),
    load: measuredBode(data.second_output?.frequency_response, confidence, loadModel), marks: marksOf(data.resonances, confidence),
    unit: prettyUnit(page.units?.response ?? ""), names: { measured: "measured", model: "model", ...page.names }, joined: page.joined === true,
  };
}

function explanation(measured, model, marks, confidence, reduced, load) {
  const text = ["How strongly and how late the output follows the input at each frequency."];
  if (measured.some((p) => p.radius !== null)) {
    text.push(`${measured.length > WHISKERS ? "Shaded" : "Bars"}: ${percent(confidence)} confidence regions.`);
  }
  if (model.length && measured.length) text.push("Where the model's line departs from the points, the model lacks dynamics.");
  if (hasLevels(measured)) {
    text.push("Below it: standard deviations of the response by noise, and of one realisation's response by non-linear distortion.");
  }
  if (load.length) text.push("Load: the response of the load's velocity, from the second output.");
  if (marks.length) text.push("Dashed: anti-resonance (the load holds the motor still) and resonance.");
  if (reduced?.lines_total) text.push(`Drawn: ${reduced.lines_shown} of ${reduced.lines_total} lines.`);
  return text.join(" ");
}

const hasLevels = (measured) => measured.some((p) => p.noiseDb !== null || p.distortionDb !== null);

function legendOf(measured, model, confidence, load, loadModel, names) {
  const items = [];
  if (measured.some((p) => p.settled)) items.push(["point", names.measured]);
  if (measured.some((p) => p.weak)) items.push(["faint", "hardly excited"]);
  if (measured.some((p) => !p.settled)) items.push(["hollow", "not settled within the recording"]);
  if (measured.some((p) => p.radius !== null)) items.push([measured.length > WHISKERS ? "band" : "whisker", `${percent(confidence)} confidence`]);
  if (measured.some((p) => p.noiseDb !== null)) items.push(["noise", "noise"]);
  if (measured.some((p) => p.distortionDb !== null)) items.push(["distortion", "non-linear distortion"]);
  if (model.length) items.push(["line", names.model]);
  if (model.some((p) => isNumber(p.dbLow))) items.push(["modelBand", `${names.model}, ${percent(confidence)} confidence`]);
  if (load.length) items.push(["load", "load, measured"]);
  if (loadModel.length) items.push(["loadLine", "load, model"]);
  return legend(items);
}

function marksOf(resonances, confidence) {
  const factor = normalFactor(confidence);
  return list(resonances).filter((r) => isNumber(r?.frequency_hz) && r.frequency_hz > 0).map((r) => ({
    f: r.frequency_hz,
    half: isNumber(r.std_hz) ? r.std_hz * factor : 0,
    colour: r.kind === "antiresonance" ? "antiresonance" : "resonance",
    text: `${r.kind === "antiresonance" ? "anti-resonance" : "resonance"} ${significant(r.frequency_hz, 4)} Hz`,
  }));
}

function reading(f, measured, model, unit, names) {
  const point = measured.length ? nearest(measured, f) : null;
  const curve = model.length ? nearest(model, point ? point.f : f) : null;
  const parts = [`<span><b>${significant(point ? point.f : curve.f, 4)} Hz</b></span>`];
  if (point && point.db !== null) {
    const region = point.radius === null ? "" : ` ± ${plain(point.radius, 2)}`;
    const angle = point.degreesHigh === null ? "" : ` ± ${plain(point.degreesHigh - point.degrees, 2)}`;
    parts.push(`<span class="m"><b>${escapeHtml(names.measured)}</b> ${point.db.toFixed(2).replace("-", "−")} dB = ` +
      `${significant(point.abs, 3)}${region} ${escapeHtml(unit)}</span>`);
    parts.push(`<span>${plain(Math.round(point.degrees * 10) / 10, 5)}${angle}°</span>`);
    if (point.noiseDb !== null) parts.push(`<span>noise ${point.noiseDb.toFixed(1).replace("-", "−")} dB</span>`);
    if (point.distortionDb !== null) parts.push(`<span>distortion ${point.distortionDb.toFixed(1).replace("-", "−")} dB</span>`);
    if (point.coherence !== null) {
      const band = point.coherenceHalf === null ? "" : ` ± ${plain(point.coherenceHalf, 2)}`;
      parts.push(`<span>coherence ${significant(point.coherence, 3)}${band}</span>`);
    }
    if (!point.settled) parts.push("<span>not settled</span>");
  }
  if (curve && curve.db !== null) {
    parts.push(`<span class="f"><b>${escapeHtml(names.model)}</b> ${curve.db.toFixed(2).replace("-", "−")} dB = ` +
      `${significant(curve.abs, 3)} ${escapeHtml(unit)}, ${plain(Math.round(curve.degrees * 10) / 10, 5)}°</span>`);
  }
  return parts.join("");
}

/** Those lines that say something; all where none does. */
const strong = (line) => (line.some((p) => !p.weak) ? line.filter((p) => !p.weak) : line);

function frequencyScale(context) {
  return {
    time: false, distr: 3,
    range: (u, min, max) => {
      const [low, high] = shownBand(context.measured, context.model);
      const room = high > low ? 1.04 : 1.5;
      if (!isNumber(min) || !isNumber(max) || max / min < 1.002) return [low / room, high * room];
      const whole = min <= low && max >= high;
      return whole ? [low / room, high * room] : [min, max];
    },
  };
}

function frequencyAxis(last) {
  return axis({
    size: last ? 24 : 8,
    splits: (u) => logTicks(u.scales.x.min, u.scales.x.max),
    filter: (u, splits) => splits,
    values: (u, splits) => {
      if (!last) return splits.map(() => "");
      const { min, max } = u.scales.x;
      const shown = logLabels(splits, min, max, u.bbox.width / uPlot.pxRatio);
      return splits.map((x) => (shown.has(x) ? plain(x) : ""));
    },
    ...(last ? { label: "frequency in Hz", labelSize: 18, labelGap: 0, labelFont: "12px system-ui, sans-serif" } : {}),
  });
}

function chartHost(box, title, unit) {
  const wrap = document.createElement("div");
  wrap.className = "chart";
  const caption = document.createElement("div");
  caption.className = "caption";
  caption.textContent = title + " ";
  const more = document.createElement("span");
  more.textContent = unit;
  caption.append(more);
  const host = document.createElement("div");
  host.className = "plot";
  wrap.append(caption, host);
  box.append(wrap);
  return host;
}

/** One of the three charts: series are band (low, high), measured, unsettled, model and its band. */
function bodeChart(context, { host, label, height, last, key, ticks, scale, showMarks, withModel = true, connect = false, levels = [] }) {
  const { measured, load, joined } = context;
  const columns = () => columnsOf(context, { key, withModel, levels });
  const size = measured.length > 400 ? 3 : measured.length > 120 ? 4 : 6;
  const dots = (hollow) => ({
    show: true, size: hollow ? size + 2 : size, width: hollow ? 1.5 : 0,
    stroke: () => colour("measured"), fill: () => colour(hollow ? "card" : "measured"),
  });
  const bare = { paths: () => null, points: { show: false } };
  const plot = makePlot(host, {
    height, label, group: "bode", data: columns(), rings: [3, 5],
    padding: [showMarks ? (u) => 8 + 17 * rowsFor(context.marks, u.width) : 8, 14, 0, 0],
    scales: { x: frequencyScale(context), y: { range: scale } },
    axes: [frequencyAxis(last), axis({
      size: AXIS_WIDTH, splits: (u, i, low, high) => ticks(low, high, Math.max(2, Math.floor(u.height / 32))),
      values: (u, splits) => splits.map((x) => plain(x)),
    })],
    series: [{}, bare, bare,
      { paths: connect || joined ? uPlot.paths.linear() : () => null, spanGaps: true, width: 1, stroke: () => colour("measured"), points: dots(false) },
      { paths: () => null, stroke: () => colour("measured"), points: dots(true) },
      { spanGaps: true, width: 2, stroke: () => colour("model"), points: { show: false } }, bare, bare, ...levels.map((name) => levelSeries(name, size)), ...(load.length ? loadSeries(size) : []), weakSeries(size)],
    hooks: {
      drawClear: [(u) => { drawMarks(u, context.marks); drawBand(u, u.data); drawModelBand(u, u.data); }],
      draw: [(u) => { if (showMarks) drawMarkLabels(u, context.marks); }],
    },
    onCursor: context.onCursor,
  });
  context.charts.push({ plot, columns });
}

/** What of the curves a chart shows: bounds, measured, unsettled, model with its bounds, levels, load, weak. */
function columnsOf({ measured, model, load, loadModel, joined }, { key, withModel, levels }) {
  const has = withModel && model.length > 0;
  // A response that says nothing has a coherence all the same.
  const weak = (p) => p.weak && !(joined && key === "coherence");
  // All three charts get the same frequencies, so that zoom and cursor mean the same in each.
  const curves = [measured, model, load, loadModel];
  const grids = curves.map((line) => line.map((p) => p.f));
  const column = (read, grid = 0) => ({ grid, values: curves[grid].map(read) });
  return align(grids, [
    column((p) => (weak(p) ? null : p[key + "Low"] ?? null)), column((p) => (weak(p) ? null : p[key + "High"] ?? null)),
    column((p) => (p.settled && !weak(p) ? p[key] : null)), column((p) => (p.settled || weak(p) ? null : p[key])),
    column((p) => (has ? p[key] : null), 1),
    column((p) => (has ? p[key + "Low"] ?? null : null), 1), column((p) => (has ? p[key + "High"] ?? null : null), 1),
    ...levels.map((name) => column((p) => p[name + "Db"])),
    ...(load.length ? [column((p) => p[key], 2), column((p) => (withModel ? p[key] : null), 3)] : []),
    column((p) => (weak(p) ? p[key] : null)),
  ]);
}

/** Lines that nothing excites: pale. */
function weakSeries(size) {
  const tint = () => colour("measured") + "59";
  return { paths: () => null, stroke: tint, points: { show: true, size: Math.max(3, size - 2), width: 0, stroke: tint, fill: tint } };
}

/** The load's response: hollow points, and its model as a thin line. */
function loadSeries(size) {
  const stroke = () => colour("load");
  return [
    { paths: () => null, stroke, points: { show: true, size: Math.max(3, size - 1), width: 1.3, stroke, fill: () => colour("card") } },
    { paths: uPlot.paths.linear(), spanGaps: true, width: 1.5, stroke, points: { show: false } },
  ];
}

/** A level beside |G|: noise as small dots on a thin line, distortion as hollow ones that scatter as estimates do. */
function levelSeries(name, size) {
  const noise = name === "noise";
  return {
    paths: noise ? uPlot.paths.linear() : () => null, spanGaps: true, width: 1, stroke: () => colour(name),
    points: {
      show: true, size: noise ? Math.max(2, size - 3) : Math.max(4, size - 1), width: noise ? 0 : 1.3,
      stroke: () => colour(name), fill: () => colour(noise ? name : "card"),
    },
  };
}

function magnitude(context, last) {
  const { measured, unit } = context;
  const levels = ["noise", "distortion"].filter((name) => measured.some((p) => p[name + "Db"] !== null));
  const host = chartHost(context.box, "Magnitude", unit ? `in dB, 0 dB = 1 ${unit}` : "in dB");
  bodeChart(context, {
    host, last, height: levels.length ? 380 : 290, key: "db", ticks: decibelTicks, showMarks: true, levels,
    label: "Magnitude of the frequency response in decibels over frequency",
    scale: (u) => scaleOver(u, context, "db", { allow: 12, least: 3 }, levelRange(context.measured)),
  });
}

function phase(context, last) {
  const host = chartHost(context.box, "Phase", "in degrees");
  bodeChart(context, {
    host, last, height: last ? 240 : 200, key: "degrees", ticks: phaseTicks,
    label: "Phase of the frequency response in degrees over frequency",
    scale: (u) => scaleOver(u, context, "degrees", { allow: 45, least: 20 }),
  });
}

function coherenceChart(context, findings) {
  const banded = context.measured.filter((p) => p.coherenceStd !== null).length;
  const band = banded ? `; ${banded > WHISKERS ? "shaded" : "bars"}: ${percent(context.confidence)} confidence` : "";
  const host = chartHost(context.box, "Coherence", `between excitation or input and output: 1 = it explains all of the output${band}`);
  host.parentElement.classList.add("coherence");
  const limit = findings.find((f) => /coherence/.test(f?.id ?? "") && isNumber(f.threshold) && f.threshold > 0 && f.threshold < 1);
  bodeChart(context, {
    host, last: true, height: 158, key: "coherence", ticks: () => (onSheet() ? [0, 1] : [0, 0.5, 1]), withModel: false, connect: true,
    label: "Coherence from 0 to 1 over frequency", scale: () => [0, 1.06],
  });
  if (limit) host.previousSibling.lastChild.textContent += `; below ${plain(limit.threshold)} the response is doubtful`;
}

/** What of the levels must be seen: all of the noise, and distortion down to a little below the least of it. */
function levelRange(measured) {
  const noise = measured.map((p) => p.noiseDb).filter(isNumber);
  const floor = noise.length ? Math.min(...noise) - 6 : -Infinity;
  return (p) => [p.noiseDb, isNumber(p.distortionDb) ? Math.max(p.distortionDb, floor) : null];
}

function scaleOver(u, { measured, model, load }, key, options, more = () => []) {
  const visible = (line) => {
    const data = u.data[0];
    const [i, j] = u.series[0].idxs ?? [0, data.length - 1];
    const [low, high] = [data[i], data[j]];
    return line.filter((p) => p.f >= low && p.f <= high);
  };
  const shown = strong(visible(measured));
  return limits([...shown.map((p) => p[key]), ...shown.flatMap(more), ...visible(model).map((p) => p[key]), ...visible(load).map((p) => p[key])],
    shown.flatMap((p) => [p[key + "Low"], p[key + "High"]]), options);
}

function clipped(u, paint) {
  const { ctx, bbox } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  paint(ctx, bbox, uPlot.pxRatio);
  ctx.restore();
}

function drawMarks(u, marks) {
  clipped(u, (ctx, bbox, ratio) => {
    for (const mark of marks) {
      const x = u.valToPos(mark.f, "x", true);
      if (mark.half > 0) {
        const low = u.valToPos(Math.max(mark.f - mark.half, 1e-9), "x", true);
        ctx.globalAlpha = 0.16;
        ctx.fillStyle = colour(mark.colour);
        ctx.fillRect(low, bbox.top, u.valToPos(mark.f + mark.half, "x", true) - low, bbox.height);
        ctx.globalAlpha = 1;
      }
      ctx.strokeStyle = colour(mark.colour);
      ctx.lineWidth = 1.4 * ratio;
      ctx.setLineDash([5 * ratio, 4 * ratio]);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
  });
}

/** On a phone every label may need a row of its own. */
function rowsFor(marks, width) {
  if (marks.length < 2) return marks.length;
  return Math.min(width < 520 ? marks.length : marks.length > 2 ? 2 : 1, 4);
}

/** Labels above the plot: centred on their line, pushed aside or one row up where they would touch. */
function drawMarkLabels(u, marks) {
  const { ctx, bbox } = u;
  const ratio = uPlot.pxRatio;
  const rows = rowsFor(marks, u.width);
  ctx.save();
  ctx.font = `600 ${12 * ratio}px system-ui, sans-serif`;
  ctx.textBaseline = "alphabetic";
  ctx.textAlign = "left";
  const ends = new Array(rows).fill(-Infinity);
  const visible = marks.filter((m) => m.f >= u.scales.x.min && m.f <= u.scales.x.max).sort((a, b) => a.f - b.f);
  visible.forEach((mark, i) => {
    const wide = ctx.measureText(mark.text).width;
    const x = u.valToPos(mark.f, "x", true);
    const next = visible[i + 1];
    const crowded = next && u.valToPos(next.f, "x", true) - x < wide + 16 * ratio;
    let left = crowded && rows === 1 ? x - wide - 4 * ratio : x - wide / 2;
    left = Math.min(Math.max(left, bbox.left - AXIS_WIDTH * 0.8 * ratio), bbox.left + bbox.width - wide);
    let row = ends.findIndex((end) => left >= end);
    if (row < 0) {
      row = rows - 1;
      left = Math.min(ends[row], bbox.left + bbox.width - wide);
    }
    ends[row] = left + wide + 12 * ratio;
    ctx.fillStyle = colour(mark.colour);
    ctx.fillText(mark.text, left, bbox.top - (6 + 17 * row) * ratio);
  });
  ctx.restore();
}

/** Positions of a band's bounds. */
function bandAt(u, x, low, high) {
  const at = [];
  for (let i = 0; i < x.length; ++i) {
    if (low[i] === null || high[i] === null) continue;
    at.push({ x: u.valToPos(x[i], "x", true), low: u.valToPos(low[i], "y", true), high: u.valToPos(high[i], "y", true) });
  }
  return at;
}

function drawModelBand(u, data) {
  const at = bandAt(u, data[0], data[6], data[7]);
  if (at.length === 0) return;
  clipped(u, (ctx) => {
    ctx.globalAlpha = 0.2;
    area(ctx, at, "model");
    ctx.globalAlpha = 1;
  });
}

function drawBand(u, [x, low, high]) {
  const at = bandAt(u, x, low, high);
  if (at.length === 0) return;
  clipped(u, (ctx, bbox, ratio) => {
    if (at.length <= WHISKERS) whiskers(ctx, at, ratio);
    else area(ctx, at);
  });
}

function whiskers(ctx, at, ratio) {
  ctx.strokeStyle = colour("measured");
  ctx.globalAlpha = 0.65;
  ctx.lineWidth = 1.4 * ratio;
  const arm = 3.5 * ratio;
  ctx.beginPath();
  for (const p of at) {
    const x = Math.round(p.x);
    ctx.moveTo(x, p.low);
    ctx.lineTo(x, p.high);
    for (const y of [Math.round(p.low), Math.round(p.high)]) {
      ctx.moveTo(x - arm, y);
      ctx.lineTo(x + arm, y);
    }
  }
  ctx.stroke();
}

function area(ctx, at, name = "band") {
  ctx.fillStyle = colour(name);
  ctx.beginPath();
  at.forEach((p, i) => (i ? ctx.lineTo(p.x, p.high) : ctx.moveTo(p.x, p.high)));
  for (let i = at.length - 1; i >= 0; --i) ctx.lineTo(at[i].x, at[i].low);
  ctx.fill();
}
