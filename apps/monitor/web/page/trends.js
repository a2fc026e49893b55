// SPDX-License-Identifier: MIT
// Figures of one axis over minutes to years: means with their deviation, least and largest, alarms. The server thins to the width shown.
import { drawChart } from "./report/chart.js";
import { isNumber, list, percent, prettyUnit, significant } from "./report/format.js";
import { release } from "./report/plot.js";
import { fileLink, get, part } from "./api.js";
import { grid, h, mark, renew, say } from "./dom.js";
import { tableOnDemand } from "./response.js";
import { bare, duration, figureOf, fromInput, moment, orderedFigures, stamp, toInput, zone } from "./words.js";

const SPANS = [[600, "10 min"], [3600, "1 h"], [6 * 3600, "6 h"], [86400, "1 day"], [7 * 86400, "1 week"], [30 * 86400, "1 month"], [365 * 86400, "1 year"], [5 * 365 * 86400, "5 years"]];
const DEFAULT_SPAN = 3600;
const PREFERRED = ["resonance", "stiffness", "modulus_margin"];
const SHORTEST_S = 1;
/** What may be stored of an axis that tells no figures of now, as while it learns. */
const STORED = ["resonance_hz", "antiresonance_hz", "stiffness", "driven_inertia", "load_inertia", "damping", "coulomb_friction", "load_torque", "modulus_margin", "phase_margin_deg", "gap"];
/** After an answer that failed. */
const AGAIN_MS = 5000;
/** The last time that the interface takes. */
const LAST_S = 9e9;
/** One answer has no more alarms. */
const MOST_ALARMS = 1000;

/** Raw samples are had by the hour. */
const LONGEST_RAW_S = 3600;

/** What is chosen by the URL: figures, with or without their units, and a span that ends now or two times. */
function chosen(query, names) {
  const wanted = (query.f ?? "").split(",").map(bare);
  const asked = names.filter((name) => wanted.includes(bare(name)));
  const preferred = names.filter((n) => PREFERRED.some((p) => n.startsWith(p)));
  const [from, to] = [Number(query.from), Number(query.to)];
  const fixed = query.from !== undefined && query.to !== undefined && isNumber(from) && isNumber(to) && to > from;
  const span = Number(query.span) > 0 ? Number(query.span) : DEFAULT_SPAN;
  return { figures: asked.length ? asked : preferred.length ? preferred : names.slice(0, 3), range: fixed ? [from, to] : null, span };
}

/** One figure's history as a chart of the report. */
function chartOf(name, machine, history, [from, to], alarms, baseline) {
  const figure = figureOf(name, machine);
  const unit = prettyUnit(figure.unit);
  const f = history.figures?.[name] ?? {};
  const x = list(history.time_s);
  const value = list(f.value);
  const at = (column, i) => (isNumber(list(column)[i]) ? list(column)[i] : null);
  const trusted = (i) => !(list(f.trusted)[i] === 0);
  const y = x.map((_, i) => (trusted(i) ? at(value, i) : null));
  const half = x.map((_, i) => (trusted(i) ? at(f.std, i) : null));
  const bound = (sign) => y.map((v, i) => (v === null || half[i] === null ? null : v + sign * half[i]));
  const curves = [
    { name: figure.title + ", ± one standard deviation", mark: "line", x, y, lower: bound(-1), upper: bound(1) },
    { name: "not trusted", mark: "faint", x, y: x.map((_, i) => (trusted(i) ? null : at(value, i))) },
  ];
  if (history.resolution !== "row" && f.min && f.max) curves.push({ name: "least … largest", mark: "band", x, y: [], lower: f.min, upper: f.max });
  if (isNumber(baseline)) curves.push({ name: "baseline", mark: "dashed", x: [from, to], y: [baseline, baseline] });
  const shapes = alarms.filter((a) => bare(a.alarm) === bare(name))
    .filter((a) => isNumber(a.raised_time_s) && a.raised_time_s < to && (a.cleared_time_s ?? Infinity) > from)
    .map((a) => ({ kind: "rectangle", name: "not normal: alarm", x: Math.max(from, a.raised_time_s), x_end: Math.min(to, a.cleared_time_s ?? to) }));
  return {
    title: figure.title, section: "trends", x_label: "time", y_label: figure.title + (unit ? ` in ${unit}` : ""), time_x: true, log_x: false,
    x_range: [from, to], curves, shapes,
  };
}

export function trendsPart(root, { name: axis, setQuery, serverNow }) {
  const resolution = h("p", { class: "explain" });
  /** Read aloud where a person chose another time: what goes on by itself is not. */
  const announced = h("p", { class: "unseen", role: "status" });
  const pick = h("div", { class: "chips", role: "group", "aria-label": "Figures" });
  const spans = h("div", { class: "chips", role: "group", "aria-label": "Time shown" });
  const [fromField, toField] = ["From", "To"].map((text) => h("input", { type: "datetime-local", step: 1, "aria-label": text, oninput: () => { edited = true; } }));
  const move = h("div", { class: "chips", role: "group", "aria-label": "Move the time" });
  const charts = h("div", { class: "trends" });
  const problem = h("p", { class: "error", role: "alert" });
  const evidence = h("p", { class: "small" });
  const box = h("section", { class: "trend-box" }, h("h2", {}, "Trends"), resolution, announced,
    h("div", { class: "tools" }, pick), h("div", { class: "tools" }, spans, move,
      h("form", { class: "range", onsubmit: (event) => { event.preventDefault(); const [a, b] = [fromInput(fromField.value), fromInput(toField.value)]; if (a !== null && b > a) { edited = false; choose([a, b]); } else say(problem, "The end must lie after the beginning."); } },
        h("label", {}, "from ", fromField), h("label", {}, "to ", toField), h("button", { type: "submit", class: "quiet" }, "Show"))),
    problem, charts, evidence);
  root.append(box);

  let query = {};
  let figures = {};
  let machine; // the axis, for names and units of its figures
  let names = [];
  let what = null;
  let shown = null; // { range, history }
  let alarms = [];
  let drawn = new Map();
  let fetchedAt = -Infinity;
  let fetchedUntil = 0; // the time of the axis when it was asked for
  let failed = false;
  let running = null;
  let zoomTimer = 0;
  let picked = "";
  let chose = false;
  let edited = false; // times that are not shown yet
  let asked = false; // for something else since the last update

  const rangeNow = () => what.range ?? [Math.max(0, serverNow() - what.span), serverNow()];
  const within = (t) => Math.round(Math.min(Math.max(t, 0), LAST_S) * 1000) / 1000;
  const choose = (range) => setQuery({ span: "", from: within(range[0]), to: within(range[1]) });
  const spanButtons = SPANS.map(([span, text]) => h("button", { type: "button", "aria-pressed": "false", onclick: () => setQuery({ span: span === DEFAULT_SPAN ? "" : span, from: "", to: "" }) }, text));
  spans.append(...spanButtons);
  const shift = (by) => { const [a, b] = rangeNow(); const d = by * (b - a); choose([a + d, b + d]); };
  const scale = (by) => { const [a, b] = rangeNow(); const half = Math.max(SHORTEST_S, (b - a) * by) / 2; const m = (a + b) / 2; choose(by > 1 ? [m - half, Math.min(m + half, serverNow())] : [m - half, m + half]); };
  for (const [label, text, act] of [["Earlier", "◀", () => shift(-0.5)], ["Later", "▶", () => shift(0.5)], ["Zoom in", "+", () => scale(0.5)], ["Zoom out", "−", () => scale(2)]]) {
    move.append(h("button", { type: "button", "aria-label": label, title: label, onclick: act }, text));
  }

  /** The mouse or the keyboard zoomed: what is shown then is asked for, and stands in the URL. */
  function zoomed(low, high) {
    if (!shown || !isNumber(low) || !isNumber(high)) return;
    const [a, b] = shown.range;
    const tiny = 0.002 * (b - a);
    clearTimeout(zoomTimer);
    zoomTimer = 0;
    if (Math.abs(low - a) < tiny && Math.abs(high - b) < tiny) return;
    zoomTimer = setTimeout(() => {
      zoomTimer = 0;
      if (high - low >= SHORTEST_S) choose([low, high]);
    }, 350);
  }

  function show() {
    const { range, history } = shown;
    for (const name of drawn.keys()) {
      if (what.figures.includes(name)) continue;
      release(drawn.get(name).part);
      drawn.get(name).part.remove();
      drawn.delete(name);
    }
    for (const name of what.figures) {
      const chart = chartOf(name, machine, history, range, alarms, figures[name]?.baseline);
      if (drawn.has(name)) {
        drawn.get(name).update(chart);
        continue;
      }
      const place = h("div", {});
      const title = h("h3", { id: `trend-${name}` }, chart.title);
      const figure = h("figure", { "aria-labelledby": `trend-${name}` }, title, place, tableOnDemand(`${chart.title} as a table`, () => historyTable(name, machine, shown.history)));
      charts.append(figure);
      drawn.set(name, { part: figure, update: drawChart(place, chart, { height: 210, onZoom: zoomed }) });
    }
    const [from, to] = range;
    const kind = { row: "rows of one second", "five-minutes": "means over five minutes", hour: "hourly means", day: "daily means" }[history.resolution] ?? history.resolution;
    say(resolution, list(history.time_s).length ? `${zone(from) === zone(to) ? moment(from) : stamp(from)} to ${stamp(to)} (${duration(to - from)}), from ${kind}. Drag over a chart to zoom; the back button undoes it.`
      : `Nothing stored between ${moment(from)} and ${moment(to)}.`);
    if (chose) say(announced, resolution.textContent);
    chose = false;
    if (!edited && (!box.contains(document.activeElement) || document.activeElement.type !== "datetime-local")) {
      fromField.value = toInput(from);
      toField.value = toInput(to);
    }
  }

  /** What of the time shown is still kept as raw samples, of which `oldest` is the first. */
  function offerRaw([begin, end], oldest) {
    const from = Math.max(begin, oldest ?? Infinity);
    const since = isNumber(oldest) ? `Raw samples are kept since ${moment(oldest)}.` : "No raw samples are kept.";
    const file = () => fileLink(`axes/${part(axis)}/raw?from=${from.toFixed(3)}&to=${end.toFixed(3)}`, `Raw samples ${from > begin ? "that are left of this time" : "of this time"} as CSV`, { download: `${axis}.csv`, "data-focus": "raw" });
    renew(evidence, [from, end, since], () => (!(from < end) ? [since] : end - from > LONGEST_RAW_S + 1 ? ["Raw samples can be had for an hour at most: zoom in."]
      : from > begin ? [file(), `. ${since}`] : [file()]));
  }

  async function fetchNow() {
    fetchedAt = performance.now();
    running?.abort();
    const mine = new AbortController();
    running = mine;
    const range = rangeNow();
    fetchedUntil = serverNow();
    failed = false;
    const [from, to] = range.map((t) => t.toFixed(3));
    const points = Math.min(2000, Math.max(200, charts.clientWidth || 600));
    try {
      const [history, told] = await Promise.all([
        get(`axes/${part(axis)}/history?figure=${what.figures.map(part).join(",")}&from=${from}&to=${to}&points=${points}`, mine.signal),
        get(`alarms?axis=${part(axis)}&from=${from}&to=${to}&limit=${MOST_ALARMS}`, mine.signal)]);
      if (running !== mine || zoomTimer) return; // where a person zooms right now, that is asked for next
      alarms = list(told.alarms);
      shown = { range, history };
      say(problem, "");
      show();
    } catch (error) {
      if (error.name !== "AbortError" && running === mine) {
        failed = true;
        say(problem, `Trends could not be loaded: ${error.message}`);
      }
    } finally {
      if (running === mine) running = null;
    }
  }

  return {
    query: (next) => {
      const moved = ["span", "from", "to"].some((key) => (next[key] ?? "") !== (query[key] ?? ""));
      chose ||= what !== null && moved;
      if (moved) edited = false;
      query = next;
      if (what) what = chosen(query, names); // at once: what a person presses next counts from it
      asked = true;
      fetchedAt = -Infinity;
    },
    update: (now, axis, more) => {
      figures = axis.figures;
      machine = axis;
      const told = orderedFigures(figures);
      if (told.length === 0 && !more) return;
      const all = told.length ? told : STORED;
      if (what === null || asked || all.length !== names.length) {
        asked = false;
        names = all;
        what = chosen(query, names);
        fetchedAt = -Infinity;
        for (const [i, [span]] of SPANS.entries()) mark(spanButtons[i], "aria-pressed", what.range === null && span === what.span);
        const key = names.join();
        if (picked !== key) {
          picked = key;
          pick.replaceChildren(...names.map((name) => h("button", {
            type: "button", "data-figure": name, onclick: () => {
              const next = names.filter((n) => (n === name) !== what.figures.includes(n));
              if (next.length) setQuery({ f: next.join(",") });
            },
          }, figureOf(name, machine).title)));
        }
        for (const button of pick.children) mark(button, "aria-pressed", what.figures.includes(button.dataset.figure));
      }
      if (shown && more) offerRaw(shown.range, more.raw_from_time_s);
      // A time that ends now, or later, goes on; one that is past stays.
      const usual = what.range && what.range[1] < fetchedUntil ? Infinity : Math.max(2000, (1000 * (what.range ? what.range[1] - what.range[0] : what.span)) / 400);
      const every = failed ? Math.min(AGAIN_MS, usual) : usual;
      if (!running && (fetchedAt === -Infinity || now - fetchedAt > every) && document.visibilityState === "visible") fetchNow();
    },
    reload: () => { fetchedAt = -Infinity; },
    leave: () => { running?.abort(); clearTimeout(zoomTimer); release(box); },
  };
}

function historyTable(name, machine, history) {
  const figure = figureOf(name, machine);
  const unit = figure.unit ? `, ${prettyUnit(figure.unit)}` : "";
  const f = history.figures?.[name] ?? {};
  const cell = (column, i) => (isNumber(list(column)[i]) ? significant(column[i], 5) : "–");
  return grid(["Time", figure.title + unit, "Standard deviation", "Least", "Largest", "Trusted"], list(history.time_s).map((t, i) =>
    [stamp(t), cell(f.value, i), cell(f.std, i), cell(f.min, i), cell(f.max, i), trustText(list(f.trusted)[i])]),
  { caption: `${figure.title} over time`, numeric: [1, 2, 3, 4], className: "numbers" });
}

/** The part of the rows that were trusted. */
const trustText = (part) => (!isNumber(part) ? "–" : part === 1 ? "yes" : part === 0 ? "no" : percent(part));
