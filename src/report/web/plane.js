// SPDX-License-Identifier: MIT
// A document's chart with equal axes: curves in a plane, in any order of x.
import { legendOf } from "./chart.js";
import { escapeHtml, plain, significant } from "./format.js";
import { onLayout, onSheet } from "./plot.js";
import { curvesOf, extentOf, rangeOf, shapesOf } from "./series.js";
import { linearTicks } from "./ticks.js";

const PRINT_WIDTH = 420;
const SHEET_WIDTH = 250;
/** A tall plane gets more room at its sides instead of running down the page. */
const TALLEST = 520;
const LEFT = 44;
const BOTTOM = 22;
const fixed = (v) => Math.min(Math.max(v, -1e5), 1e5).toFixed(1);

let planes = 0;

export function drawPlane(place, chart) {
  const curves = curvesOf(chart);
  const shapes = shapesOf(chart);
  const legend = legendOf(curves, shapes);
  const upright = document.createElement("div");
  upright.className = "axis-name";
  upright.textContent = `${chart.y_label} (upwards), ${chart.x_label} (to the right)`;
  const host = document.createElement("div");
  host.className = "plane-box";
  host.setAttribute("role", "figure");
  host.setAttribute("aria-label", `${chart.title}: ${chart.y_label} over ${chart.x_label}. Arrow keys go along the curves.`);
  host.tabIndex = 0;
  place.append(legend.box, upright, host);
  const [x, y] = [rangeOf(chart.x_range), rangeOf(chart.y_range)];
  const view = viewOf(x && y ? { x, y } : extentOf(curves));
  const plane = { host, curves, shapes, legend, view, map: null, clip: `plane-${++planes}` };
  onLayout(host, (width) => render(plane, Math.min(width, 720)), () => (onSheet() ? SHEET_WIDTH : PRINT_WIDTH));
  const read = (event) => {
    const box = host.firstElementChild.getBoundingClientRect();
    const scale = plane.map.width / box.width;
    probe(plane, (event.clientX - box.left) * scale, (event.clientY - box.top) * scale);
  };
  host.addEventListener("pointerdown", read);
  host.addEventListener("pointermove", read);
  listenToKeys(plane);
  host.addEventListener("pointerleave", () => probe(plane, -1e6, -1e6));
}

/** Along a curve by left and right, with Shift in larger steps, from curve to curve by up and down. */
function listenToKeys(plane) {
  const lines = plane.curves.map((c) => c.points.filter((p) => p.y !== null)).filter((points) => points.length);
  if (lines.length === 0) return;
  let [curve, at] = [0, 0];
  plane.host.addEventListener("keydown", (event) => {
    const step = event.shiftKey ? Math.max(1, Math.round(lines[curve].length / 20)) : 1;
    const moves = { ArrowRight: [0, step], ArrowLeft: [0, -step], ArrowDown: [1, 0], ArrowUp: [-1, 0] };
    const move = moves[event.key];
    if (!move || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    curve = (curve + move[0] + lines.length) % lines.length;
    at = Math.min(Math.max(at + move[1], 0), lines[curve].length - 1);
    probe(plane, plane.map.x(lines[curve][at].x), plane.map.y(lines[curve][at].y));
  });
}

/** All points with a margin; neither flatter nor steeper than 1 : 2. */
export function viewOf({ x, y }) {
  const wide = Math.max(x[1] - x[0], (y[1] - y[0]) / 2, 1e-9) * 1.08;
  const high = Math.max(y[1] - y[0], (x[1] - x[0]) / 2, 1e-9) * 1.08;
  return { x: (x[0] + x[1]) / 2, y: (y[0] + y[1]) / 2, wide, high };
}

function render(plane, width) {
  const { curves, shapes } = plane;
  const inner = width - LEFT - 10;
  const scale = Math.min(inner / plane.view.wide, TALLEST / plane.view.high);
  const tall = plane.view.high * scale;
  const view = { ...plane.view, wide: inner / scale };
  const map = {
    width, height: tall + 8 + BOTTOM,
    x: (v) => LEFT + (v - view.x + view.wide / 2) * scale,
    y: (v) => 8 + (view.y + view.high / 2 - v) * scale,
  };
  plane.map = map;
  const xs = linearTicks(view.x - view.wide / 2, view.x + view.wide / 2, Math.max(3, Math.floor(inner / 80)));
  const ys = linearTicks(view.y - view.high / 2, view.y + view.high / 2, Math.max(3, Math.floor(tall / 60)));
  const grid = xs.map((v) => `<path class="${v === 0 ? "axis" : "grid"}" d="M${fixed(map.x(v))} 8v${fixed(tall)}"/>`).join("") +
    ys.map((v) => `<path class="${v === 0 ? "axis" : "grid"}" d="M${LEFT} ${fixed(map.y(v))}h${fixed(inner)}"/>`).join("");
  const numbers = xs.map((v) => `<text x="${fixed(map.x(v))}" y="${fixed(tall + 24)}" text-anchor="middle">${escapeHtml(plain(v))}</text>`).join("") +
    ys.map((v) => `<text x="${LEFT - 6}" y="${fixed(map.y(v) + 4)}" text-anchor="end">${escapeHtml(plain(v))}</text>`).join("");
  plane.host.innerHTML =
    `<svg width="${width}" height="${fixed(map.height)}" viewBox="0 0 ${width} ${fixed(map.height)}" style="max-width:${width}px" aria-hidden="true">` +
    `<clipPath id="${plane.clip}"><rect x="${LEFT}" y="8" width="${fixed(inner)}" height="${fixed(tall)}"/></clipPath>` +
    `<g clip-path="url(#${plane.clip})">${shapes.map((s) => region(s, map)).join("")}${grid}` +
    `${curves.map((c) => markup(c, map)).join("")}</g>${numbers}` +
    `<rect class="frame" x="${LEFT}" y="8" width="${fixed(inner)}" height="${fixed(tall)}"/><circle class="probe" r="6" visibility="hidden"/></svg>`;
}

function region({ kind, colour, x, y, xEnd, yEnd, radius }, map) {
  const tint = `var(--${colour})`;
  if (kind === "circle") {
    return `<circle cx="${fixed(map.x(x))}" cy="${fixed(map.y(y))}" r="${fixed(map.x(radius) - map.x(0))}" class="ring" stroke="${tint}"/>`;
  }
  if (kind === "cross") {
    return `<path d="M${fixed(map.x(x) - 6)} ${fixed(map.y(y))}h12M${fixed(map.x(x))} ${fixed(map.y(y) - 6)}v12" class="cross" stroke="${tint}"/>`;
  }
  const [left, right] = [Math.max(map.x(x), -1e4), Math.min(map.x(xEnd), 1e4)];
  const [top, bottom] = [Math.max(map.y(yEnd), -1e4), Math.min(map.y(y), 1e4)];
  return `<rect x="${fixed(left)}" y="${fixed(top)}" width="${fixed(right - left)}" height="${fixed(bottom - top)}" fill="${tint}" opacity=".12"/>`;
}

function markup({ points, mark, colour }, map) {
  if (mark === "points") {
    return points.filter((p) => p.y !== null)
      .map((p) => `<circle cx="${fixed(map.x(p.x))}" cy="${fixed(map.y(p.y))}" r="3.6" fill="var(--${colour})"/>`).join("");
  }
  const dash = mark === "dashed" ? ' stroke-dasharray="6 4"' : "";
  return `<path class="curve" stroke="var(--${colour})"${dash} d="${pathOf(points, map)}"/>`;
}

/** A line through the points, lifted at every gap. */
export function pathOf(points, map) {
  let pen = "M";
  let path = "";
  for (const p of points) {
    if (p.y === null) {
      pen = "M";
      continue;
    }
    path += `${pen}${fixed(map.x(p.x))} ${fixed(map.y(p.y))}`;
    pen = "L";
  }
  return path;
}

function probe({ host, curves, legend, map }, x, y) {
  let best = null;
  curves.forEach((curve, i) => {
    for (const p of curve.points) {
      if (p.y === null) continue;
      if (map.x(p.x) < LEFT || map.x(p.x) > map.width || map.y(p.y) < 8 || map.y(p.y) > map.height) continue;
      // Points win over the curve that runs through them.
      const distance = Math.hypot(map.x(p.x) - x, map.y(p.y) - y) + (curve.mark === "points" ? 0 : 4);
      if (distance < 40 && (!best || distance < best.distance)) best = { p, i, distance, unit: curve.unit };
    }
  });
  const ring = host.querySelector(".probe");
  ring.setAttribute("visibility", best ? "visible" : "hidden");
  if (!best) return legend.show("", []);
  ring.setAttribute("cx", fixed(map.x(best.p.x)));
  ring.setAttribute("cy", fixed(map.y(best.p.y)));
  const readings = [];
  readings[best.i] = `(${significant(best.p.x, 3)}, ${significant(best.p.y, 3)})`;
  legend.show(best.p.at === null ? "" : `at ${significant(best.p.at, 4)} ${best.unit}`, readings);
}
