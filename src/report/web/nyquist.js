// SPDX-License-Identifier: MIT
// The open loop in the complex plane, with its three margins drawn where they are measured.
import { points, tube } from "./curves.js";
import { escapeHtml, interval, isNumber, list, normalFactor, percent, plain, regionFactor, significant } from "./format.js";
import { arcEnds, freeSpot, homeView, viewAround } from "./geometry.js";
import { legend, section, table } from "./markup.js";
import { onLayout, onSheet } from "./plot.js";
import { linearTicks } from "./ticks.js";

/** More regions than this would be a cloud. */
const REGIONS = 300;
/** Up to this |L| the first view holds a planned loop. */
const PLANNED_SIZE = 1.5;
const PRINT_SIZE = 380;
const SHEET_SIZE = 230;
/** Below this width the labels are figures alone; the legend tells their colours. */
const WORDS = 400;

/** Draws the open loop at the end of `root`. Returns how to show another one there, which has the same kinds of curves.
 *  `page.names` may say what the loop's curve and values ("ran") are, and what those of the other loop ("planned"). */
export function drawNyquist(root, data) {
  const parts = partsOf(data);
  if (parts.curve.length === 0 && parts.measured.length === 0 && parts.planned.length === 0) return null;
  const box = section(root, "Loop and its margins",
    "The open loop L = C G in the complex plane, delay included. The further it stays from the point −1, the more robust the " +
    "loop is; the circle around −1 touches it at its closest.", "whole sheet nyquist-box");
  const grid = document.createElement("div");
  grid.className = "nyquist";
  const host = document.createElement("div");
  const side = document.createElement("div");
  grid.append(host, side);
  box.append(grid);
  const { values, readout } = fillSide(side, parts);
  const plane = { ...parts, host, readout, view: parts.home };
  onLayout(host, (width) => { plane.size = Math.min(width, 600); render(plane); }, () => (onSheet() ? SHEET_SIZE : PRINT_SIZE));
  listen(plane);
  return (next) => {
    const home = plane.view === plane.home;
    Object.assign(plane, partsOf(next));
    if (home) plane.view = plane.home;
    values.innerHTML = valuesMarkup(plane);
    render(plane);
  };
}

/** What of the data is drawn. */
function partsOf(data) {
  const page = data.page ?? {};
  const loop = data.loop ?? {};
  const confidence = page.confidence ?? 0.95;
  const curve = points(page.loop_curve);
  const measured = points(page.loop_measured);
  const planned = points(page.planned_curve);
  const names = {
    curve: `L from ${page.loop_curve?.source === "response" ? "the measured response" : "the model"}`,
    planned: "L with the planned controller", ran: "Ran", ...page.names,
  };
  const marks = marksOf(loop, list(page.loop_marks), curve);
  const factor = regionFactor(confidence);
  const radius = measured.map((p) => (p.std === null ? null : p.std * factor));
  const around = tube(curve, curve.map((p) => (p.std > 0 ? p.std * factor : null)));
  // A planned loop that is far too stiff must not make the others small.
  const near = planned.filter((p) => p.abs <= PLANNED_SIZE);
  return {
    loop, confidence, curve, measured, planned, names, marks, radius, around, other: plannedOf(data, planned),
    home: homeView(curve, [...measured, ...near], marks),
  };
}

/** The loop with the controller that is to run, where there is one. */
export function plannedOf(data, curve) {
  const loop = data.planned_loop;
  if (!loop || typeof loop !== "object") return null;
  const told = (id) => list(data.findings).some((f) => f?.id === id);
  const title = told("planned-unstable") ? "Planned: unstable" : told("planned-may-be-unstable") ? "Planned: may be unstable"
    : told("planned-not-judged") ? "Planned: not known" : String(data.page?.names?.other ?? "Planned");
  const crossings = list(data.page?.planned_crossings).filter((c) => isNumber(c?.frequency_hz) && isNumber(c.phase_margin_deg));
  return { loop: told("planned-not-judged") ? {} : loop, curve, crossings, title };
}

/** The phase margin of a planned loop is the least over all frequencies with |L| = 1, told with its own. */
function leastPhaseMargin(planned, factor) {
  const crossings = planned.crossings ?? [];
  if (crossings.length < 2) return null;
  const least = crossings.reduce((a, b) => (Math.abs(b.phase_margin_deg) < Math.abs(a.phase_margin_deg) ? b : a));
  return `${phaseMargin(least, factor)} at ${significant(least.frequency_hz, 3)} Hz`;
}

const phaseMargin = (c, factor) => (c.phase_margin_std_deg > 0
  ? interval(c.phase_margin_deg, c.phase_margin_std_deg * factor, "°") : `${significant(c.phase_margin_deg, 3)} °`);

/** Every frequency with |L| = 1 of a planned loop, where there are several. */
export function crossingRows({ crossings, factor }) {
  if (crossings.length < 2) return [];
  return crossings.map((c) => [`${significant(c.frequency_hz, 3)} Hz`, c.falling ? "falls" : "rises", phaseMargin(c, factor)]);
}

/** Name, value of the loop that ran, that of a planned one, and what it means. */
export function marginRows({ loop, marks, planned, factor }) {
  const value = (of, name, unit, shown) => {
    const x = of?.[name + unit];
    const std = of?.[`${name}_std${unit}`];
    if (!isNumber(x)) return "";
    return std > 0 ? interval(x, std * factor, shown) : `${significant(x, 3)}${shown ? " " + shown : ""}`;
  };
  const at = (mark) => (isNumber(mark?.frequency_hz) ? `at ${significant(mark.frequency_hz, 3)} Hz` : "");
  return [
    ["Crossover", "crossover", "_hz", "Hz", "|L| = 1: how fast the loop is"],
    ["Phase margin", "phase_margin", "_deg", "°", `lag that the loop still bears ${at(marks.crossover)}`],
    ["Modulus margin", "modulus_margin", "", "", marks.modulus ? `minimum distance to −1, ${at(marks.modulus)}` : "minimum distance to −1"],
    ["Gain margin", "gain_margin", "_db", "dB", `gain that the loop still bears ${at(marks.gain)}`],
  ].map(([title, name, unit, shown, meaning]) => {
    const ran = value(loop, name, unit, shown);
    const least = planned && name === "phase_margin" ? leastPhaseMargin(planned, factor) : null;
    const then = least ?? (planned ? value(planned.loop, name, unit, shown) : "");
    return ran || then ? [title, ran || "–", ...(planned ? [then || "–"] : []), meaning] : null;
  }).filter(Boolean);
}

/** Where each margin is read off: from the marks given, or from the figures where these are missing. */
function marksOf(loop, given, curve) {
  const find = (kind) => given.find((m) => m?.kind === kind && isNumber(m.real) && isNumber(m.imag));
  const marks = {};
  const crossover = find("crossover");
  if (crossover) marks.crossover = crossover;
  else if (isNumber(loop.phase_margin_deg)) {
    const angle = ((loop.phase_margin_deg - 180) * Math.PI) / 180;
    marks.crossover = { real: Math.cos(angle), imag: Math.sin(angle), frequency_hz: loop.crossover_hz };
  }
  const modulus = find("modulus");
  if (modulus) marks.modulus = modulus;
  else if (isNumber(loop.modulus_margin) && curve.length) {
    const closest = curve.reduce((a, b) => (Math.hypot(b.re + 1, b.im) < Math.hypot(a.re + 1, a.im) ? b : a));
    marks.modulus = { real: closest.re, imag: closest.im, frequency_hz: closest.f };
  }
  const gain = find("gain");
  if (gain) marks.gain = gain;
  else if (isNumber(loop.gain_margin_db)) marks.gain = { real: -(10 ** (-loop.gain_margin_db / 20)), imag: 0 };
  if (marks.modulus) {
    marks.modulus.radius = isNumber(loop.modulus_margin) ? loop.modulus_margin
      : Math.hypot(marks.modulus.real + 1, marks.modulus.imag);
  }
  return marks;
}

/** Tables of the margins. */
function valuesMarkup({ loop, marks, other, names, confidence }) {
  const factor = normalFactor(confidence);
  const rows = marginRows({ loop, marks, planned: other, factor });
  const head = other ? ["Margin", names.ran, other.title, "Meaning"] : ["Margin", "Value", "Meaning"];
  const crossings = other ? crossingRows({ crossings: other.crossings, factor }) : [];
  return (rows.length ? table(head, rows) : "") +
    (crossings.length ? table(["Planned: |L| = 1 at", "|L|", "Phase margin"], crossings) : "");
}

function fillSide(side, parts) {
  const { curve, measured, planned, marks, radius, names, confidence } = parts;
  const items = [];
  if (curve.length) items.push(["line", names.curve]);
  if (curve.some((p) => p.std > 0)) items.push(["modelBand", `its ${percent(confidence)} region`]);
  if (measured.length) items.push(["point", "L measured" + (radius.some((r) => r !== null) && measured.length <= REGIONS ? ", with its region" : "")]);
  if (planned.length && parts.other) items.push(["planned", names.planned]);
  items.push(["unit", "unit circle |L| = 1"], ["critical", "the point −1"]);
  if (marks.modulus) items.push(["modulus", "modulus margin"]);
  if (marks.crossover) items.push(["crossover", "crossover, phase margin"]);
  if (marks.gain) items.push(["gain", "gain margin"]);
  const values = document.createElement("div");
  values.innerHTML = valuesMarkup(parts);
  const readout = document.createElement("div");
  readout.className = "readout";
  readout.setAttribute("aria-live", "polite");
  readout.textContent = HINT;
  side.append(values, legend(items), readout);
  return { values, readout };
}

const HINT = "Move over the picture, or touch it, to read values. Drag to zoom, double-click to reset.";

function render(plane) {
  const { size, view, around, curve, measured, planned, radius, marks } = plane;
  const map = transform(view, size);
  const parts = [gridOf(view, map)];
  const circle = (re, im, r, name) =>
    `<circle class="${name}" cx="${fixed(map.x(re))}" cy="${fixed(map.y(im))}" r="${fixed(r * map.scale)}"/>`;
  parts.push(circle(0, 0, 1, "unit"));
  if (marks.modulus) parts.push(circle(-1, 0, marks.modulus.radius, "modulus"));
  if (measured.length <= REGIONS) measured.forEach((p, i) => { if (radius[i]) parts.push(circle(p.re, p.im, radius[i], "region")); });
  if (around.length > 3) parts.push(`<path class="tube" d="${pathOf(around, map)}Z"/>`);
  if (planned.length > 1) parts.push(`<path class="planned" d="${pathOf(planned, map)}"/>`);
  if (curve.length > 1) parts.push(`<path class="loop" d="${pathOf(curve, map)}"/>`);
  const dot = measured.length > 120 ? 1.6 : 2.6;
  parts.push(measured.map((p) => dotAt(map, p.re, p.im, dot, "point")).join(""));
  const labels = [];
  parts.push(marksMarkup(plane, map, labels));
  const critical = [map.x(-1), map.y(0)];
  parts.push(`<path class="critical" d="M${fixed(critical[0] - 6)} ${fixed(critical[1])}h12M${fixed(critical[0])} ${fixed(critical[1] - 6)}v12"/>`);
  labels.push({ x: critical[0], y: critical[1], text: "−1", name: "critical-label", clear: 9 });
  plane.map = map;
  plane.host.innerHTML =
    `<svg class="plane" role="img" aria-label="Nyquist curve of the open loop with phase, gain and modulus margin" ` +
    `width="${size}" height="${size - 16}" viewBox="0 0 ${size} ${size - 16}">` +
    `<clipPath id="plane-clip"><rect x="${map.left}" y="${map.top}" width="${map.side}" height="${map.side}"/></clipPath>` +
    `<g clip-path="url(#plane-clip)">${parts.join("")}</g>` +
    labelMarkup(labels, map, curve, measured) + axisLabels(view, map) +
    `<rect class="frame" x="${map.left}" y="${map.top}" width="${map.side}" height="${map.side}"/>` +
    `<circle class="probe" r="6" visibility="hidden"/><rect class="select" visibility="hidden"/></svg>`;
  plane.host.firstElementChild.style.maxWidth = `${size}px`;
}

const fixed = (x) => Math.min(Math.max(x, -1e5), 1e5).toFixed(1);

function transform(view, size) {
  const left = 38;
  const top = 8;
  const side = size - left - 10;
  const scale = side / (2 * view.half);
  return {
    left, top, side, scale,
    x: (re) => left + side / 2 + (re - view.re) * scale,
    y: (im) => top + side / 2 - (im - view.im) * scale,
    re: (x) => view.re + (x - left - side / 2) / scale,
    im: (y) => view.im - (y - top - side / 2) / scale,
  };
}

function ticksOf(view) {
  return {
    re: linearTicks(view.re - view.half, view.re + view.half, 7),
    im: linearTicks(view.im - view.half, view.im + view.half, 7),
  };
}

function gridOf(view, map) {
  const ticks = ticksOf(view);
  const across = (y, name) => `<path class="${name}" d="M${map.left} ${fixed(y)}h${map.side}"/>`;
  const down = (x, name) => `<path class="${name}" d="M${fixed(x)} ${map.top}v${map.side}"/>`;
  return ticks.im.map((v) => across(map.y(v), v === 0 ? "axis" : "grid")).join("") +
    ticks.re.map((v) => down(map.x(v), v === 0 ? "axis" : "grid")).join("");
}

function axisLabels(view, map) {
  const ticks = ticksOf(view);
  const bottom = map.top + map.side;
  return ticks.re.map((v) => `<text x="${fixed(map.x(v))}" y="${bottom + 15}" text-anchor="middle">${plain(v)}</text>`).join("") +
    ticks.im.map((v) => `<text x="${map.left - 6}" y="${fixed(map.y(v) + 4)}" text-anchor="end">${plain(v)}</text>`).join("") +
    `<text x="${map.left + map.side - 6}" y="${bottom - 7}" text-anchor="end">real part</text>` +
    `<text x="${map.left + 6}" y="${map.top + 15}">imaginary part</text>`;
}

function pathOf(curve, map) {
  return curve.map((p, i) => `${i ? "L" : "M"}${fixed(map.x(p.re))} ${fixed(map.y(p.im))}`).join("");
}

const dotAt = (map, re, im, r, name) => `<circle class="${name}" cx="${fixed(map.x(re))}" cy="${fixed(map.y(im))}" r="${r}"/>`;

function marksMarkup({ marks, loop, size }, map, labels) {
  const word = (text) => (size >= WORDS ? text + " " : "");
  const out = [];
  const line = (a, b, name) => `<path class="${name}" d="M${fixed(map.x(a[0]))} ${fixed(map.y(a[1]))}L${fixed(map.x(b[0]))} ${fixed(map.y(b[1]))}"/>`;
  const { crossover, modulus, gain } = marks;
  if (modulus) {
    out.push(line([-1, 0], [modulus.real, modulus.imag], "modulus-line"), dotAt(map, modulus.real, modulus.imag, 5, "mark modulus-point"));
    const text = `${word("modulus margin")}${significant(modulus.radius, 3)}`;
    labels.push({ x: map.x((modulus.real - 1) / 2), y: map.y(modulus.imag / 2), text, name: "modulus-label", clear: 8 });
  }
  if (crossover) {
    const arc = arcEnds(crossover, 0.5);
    const r = fixed(0.5 * map.scale);
    out.push(line([0, 0], [crossover.real, crossover.imag], "phase"),
      `<path class="phase" d="M${fixed(map.x(arc.from[0]))} ${fixed(map.y(arc.from[1]))}A${r} ${r} 0 ${arc.large} ${arc.sweep} ${fixed(map.x(arc.to[0]))} ${fixed(map.y(arc.to[1]))}"/>`,
      dotAt(map, crossover.real, crossover.imag, 5, "mark crossover"));
    if (isNumber(loop.phase_margin_deg)) {
      labels.push({ x: map.x(arc.middle[0]), y: map.y(arc.middle[1]), text: `${word("phase margin")}${significant(loop.phase_margin_deg, 3)}°`, name: "phase-label", clear: 9 });
    }
    if (isNumber(crossover.frequency_hz)) {
      labels.push({ x: map.x(crossover.real), y: map.y(crossover.imag), text: `${word("crossover")}${significant(crossover.frequency_hz, 3)} Hz`, name: "phase-label", clear: 10 });
    }
  }
  if (gain) {
    out.push(line([-1, 0], [gain.real, 0], "gain"), dotAt(map, gain.real, gain.imag, 5, "mark gain-point"));
    if (isNumber(loop.gain_margin_db)) {
      labels.push({ x: map.x(gain.real), y: map.y(gain.imag), text: `${word("gain margin")}${significant(loop.gain_margin_db, 3)} dB`, name: "gain-label", clear: 10 });
    }
  }
  return out.join("");
}

function labelMarkup(labels, map, curve, measured) {
  const frame = { left: map.left, top: map.top, right: map.left + map.side, bottom: map.top + map.side };
  const inside = (l) => l.x >= frame.left && l.x <= frame.right && l.y >= frame.top && l.y <= frame.bottom;
  const lines = [...curve, ...measured].map((p) => [map.x(p.re), map.y(p.im)]);
  // Labels keep clear of one another, of the marks, and where they can of the curve.
  const taken = labels.filter(inside).map((l) => ({ left: l.x - 6, right: l.x + 6, top: l.y - 6, bottom: l.y + 6 }));
  return labels.filter(inside).map((label) => {
    const spot = freeSpot(label, frame, taken, lines);
    taken.push(spot);
    return `<text class="label ${label.name}" x="${fixed(spot.left)}" y="${fixed(spot.bottom - 4)}">${escapeHtml(label.text)}</text>`;
  }).join("");
}

function reading(p, name) {
  return `<span><b>${escapeHtml(name)}</b></span><span><b>${significant(p.f, 4)} Hz</b></span>` +
    `<span>|L| = ${significant(p.abs, 3)}</span><span>angle ${plain(Math.round(p.phase * 10) / 10, 4)}°</span>` +
    `<span>${significant(Math.hypot(p.re + 1, p.im), 3)} from −1</span>`;
}

function listen(plane) {
  const { host } = plane;
  const place = (event) => {
    const box = host.firstElementChild.getBoundingClientRect();
    const factor = plane.size / box.width;
    return [(event.clientX - box.left) * factor, (event.clientY - box.top) * factor];
  };
  let start = null;
  const probe = (x, y) => {
    const { map } = plane;
    let best = null;
    for (const [line, name] of [[plane.measured, "L measured"], [plane.curve, "L"], [plane.planned, plane.names.planned]]) {
      for (const p of line) {
        // Measured points win over the curves that run through them.
        const distance = Math.hypot(map.x(p.re) - x, map.y(p.im) - y) + (name === "L measured" ? 0 : 4);
        if (distance < 40 && (!best || distance < best.distance)) best = { p, name, distance };
      }
    }
    show(plane, best?.p, best?.name);
  };
  const band = (a, b) => {
    const rect = host.querySelector(".select");
    rect.setAttribute("visibility", "visible");
    const set = (name, value) => rect.setAttribute(name, value.toFixed(1));
    set("x", Math.min(a[0], b[0]));
    set("y", Math.min(a[1], b[1]));
    set("width", Math.abs(a[0] - b[0]));
    set("height", Math.abs(a[1] - b[1]));
  };
  host.addEventListener("pointerdown", (event) => {
    // A finger scrolls the page; it reads values, and zooms with the browser's own gesture.
    if (event.pointerType === "mouse" && event.button === 0) {
      start = place(event);
      host.setPointerCapture(event.pointerId);
    } else probe(...place(event));
  });
  host.addEventListener("pointermove", (event) => {
    const at = place(event);
    if (start) band(start, at);
    else probe(...at);
  });
  host.addEventListener("pointerup", (event) => {
    if (!start) return;
    const at = place(event);
    const from = start;
    start = null;
    if (Math.hypot(at[0] - from[0], at[1] - from[1]) > 8) {
      const { map } = plane;
      plane.view = viewAround(map.re(from[0]), map.im(from[1]), map.re(at[0]), map.im(at[1]));
    }
    render(plane);
  });
  host.addEventListener("pointerleave", () => { if (!start) probe(-1e6, -1e6); });
  host.addEventListener("dblclick", () => { plane.view = plane.home; render(plane); });
  listenToKeys(plane);
}

/** Rings a point and tells its figures; none: tells how to read. */
function show(plane, p, name) {
  const ring = plane.host.querySelector(".probe");
  ring.setAttribute("visibility", p ? "visible" : "hidden");
  if (!p) {
    plane.readout.textContent = HINT;
    return;
  }
  ring.setAttribute("cx", fixed(plane.map.x(p.re)));
  ring.setAttribute("cy", fixed(plane.map.y(p.im)));
  plane.readout.innerHTML = reading(p, name);
}

/** Along the curve by arrow keys, with Shift in larger steps; plus and minus zoom around the point, Escape shows all. */
function listenToKeys(plane) {
  const { host } = plane;
  const find = () => [[plane.curve, "L"], [plane.measured, "L measured"], [plane.planned, plane.names.planned]].find(([of]) => of.length);
  let [line, name] = find();
  host.tabIndex = 0;
  host.setAttribute("role", "figure");
  host.setAttribute("aria-label", "Nyquist curve. Arrow keys go along it, plus and minus zoom, Escape shows all.");
  let at = nearestTo(line, plane.marks.modulus ?? plane.marks.crossover);
  const zoom = (factor) => {
    plane.view = { re: line[at].re, im: line[at].im, half: plane.view.half * factor };
    render(plane);
  };
  host.addEventListener("keydown", (event) => {
    const step = event.shiftKey ? Math.max(1, Math.round(line.length / 20)) : 1;
    const actions = {
      ArrowRight: () => { at = Math.min(at + step, line.length - 1); }, ArrowLeft: () => { at = Math.max(at - step, 0); },
      "+": () => zoom(0.7), "=": () => zoom(0.7), "-": () => zoom(1 / 0.7), Escape: () => { plane.view = plane.home; render(plane); },
    };
    if (!actions[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    [line, name] = find() ?? [line, name];
    at = Math.min(at, line.length - 1);
    actions[event.key]();
    show(plane, line[at], name);
  });
}

/** The place in the line that lies nearest to a mark's frequency. */
function nearestTo(line, mark) {
  if (!(mark?.frequency_hz > 0)) return 0;
  let best = 0;
  line.forEach((p, i) => { if (Math.abs(Math.log(p.f / mark.frequency_hz)) < Math.abs(Math.log(line[best].f / mark.frequency_hz))) best = i; });
  return best;
}
