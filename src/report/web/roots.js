// SPDX-License-Identifier: MIT
// Poles and zeros of the model in the s-plane, each with the region that holds the true one.
import { escapeHtml, interval, isNumber, list, normalFactor, percent, plain, significant } from "./format.js";
import { legend, section, table } from "./markup.js";
import { onLayout } from "./plot.js";
import { linearTicks } from "./ticks.js";

const PRINT_SIZE = 380;
const STEPS = 72;
/** Damping ratios whose lines are drawn. */
const RATIOS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5];

/** Roots of the upper half plane with what they mean to a drive engineer; the lower half mirrors it. */
export function rootsOf(data, confidence) {
  const radius = Math.sqrt(-2 * Math.log(1 - Math.min(confidence, 1 - 1e-12)));
  const read = (kind) => (r) => {
    if (!isNumber(r?.real) || !isNumber(r?.imag) || r.imag < -1e-9 * Math.hypot(r.real, r.imag)) return [];
    const size = Math.hypot(r.real, r.imag);
    return [{ kind, re: r.real, im: Math.max(0, r.imag), size, ratio: size > 0 ? -r.real / size : 1,
      ...errorsOf(r, size), ellipse: ellipseOf(r, radius) }];
  };
  return [...list(data.poles).flatMap(read("pole")), ...list(data.zeros).flatMap(read("zero"))];
}

/** Standard deviations of |s| and of the damping ratio, to first order. */
function errorsOf(root, size) {
  const c = root.covariance;
  if (!Array.isArray(c) || size === 0) return { sizeStd: null, ratioStd: null };
  const [x, y] = [root.real / size, root.imag / size];
  const along = (a, b) => Math.sqrt(Math.max(0, a * a * c[0][0] + 2 * a * b * c[0][1] + b * b * c[1][1]));
  return { sizeStd: along(x, y), ratioStd: along((-y * y) / size, (x * y) / size) };
}

/** Points around a root: the ellipse of `radius` standard deviations. */
export function ellipseOf(root, radius) {
  const c = root.covariance;
  if (!Array.isArray(c) || !(c[0][0] >= 0) || !(c[1][1] >= 0) || c[0][0] + c[1][1] === 0) return [];
  const a = Math.sqrt(c[0][0]);
  const b = a > 0 ? c[1][0] / a : 0;
  const d = Math.sqrt(Math.max(0, c[1][1] - b * b));
  return Array.from({ length: STEPS }, (_, i) => {
    const t = (2 * Math.PI * i) / STEPS;
    return [root.real + radius * a * Math.cos(t), root.imag + radius * (b * Math.cos(t) + d * Math.sin(t))];
  });
}

export function drawRoots(root, data) {
  const confidence = data.page?.confidence ?? 0.95;
  const roots = rootsOf(data, confidence);
  if (roots.length === 0) return;
  const box = section(root, "Poles and zeros",
    "Poles and zeros of the model from torque to velocity, in the s-plane; the lower half mirrors the upper. Poles are the drive's free motions; at " +
    "a zero the velocity does not respond. Grey lines: equal damping ratio.", "whole");
  const grid = document.createElement("div");
  grid.className = "nyquist";
  const host = document.createElement("div");
  const side = document.createElement("div");
  grid.append(host, side);
  box.append(grid);
  fillSide(side, roots, confidence);
  const shown = near(roots, data);
  onLayout(host, (width) => render(host, shown, Math.min(width, 600)), () => PRINT_SIZE);
}

/** Without those far above the measured band, which belong to the sampling rather than to the drive. */
function near(roots, data) {
  const band = list(data.frequency_response?.frequency_hz).filter(isNumber);
  const limit = band.length ? 2 * Math.PI * 2 * Math.max(...band) : Infinity;
  const inside = roots.filter((r) => r.size <= limit);
  return inside.length ? inside : roots;
}

function fillSide(side, roots, confidence) {
  const z = normalFactor(confidence);
  const rows = roots.map((r) => [
    r.kind === "pole" ? "Pole" : "Zero",
    `${significant(r.re, 4)}${r.im > 0 ? ` ± j ${significant(r.im, 4)}` : ""}`,
    r.im > 0 ? interval(r.size / (2 * Math.PI), (r.sizeStd * z) / (2 * Math.PI), "Hz") : "–",
    r.im > 0 ? interval(r.ratio, r.ratioStd * z) : "–",
  ]);
  side.innerHTML = table(["Kind", "Value in 1/s", "Frequency", "Damping ratio"], rows);
  const items = [["pole", "pole"], ["zero", "zero"]];
  if (roots.some((r) => r.ellipse.length)) items.push(["ellipse", `${percent(confidence)} confidence`]);
  side.append(legend(items));
}

/** What is shown: all roots with their regions, the origin, and room for the names. */
export function viewOfRoots(roots) {
  const points = roots.flatMap((r) => [[r.re, r.im], ...r.ellipse]);
  const left = Math.min(0, ...points.map((p) => p[0]));
  const right = Math.max(0, ...points.map((p) => p[0]));
  const top = Math.max(1e-9, ...points.map((p) => p[1]));
  const wide = Math.max(right - left, 0.02 * top, 1e-9);
  return { left: left - 0.25 * wide, right: right + 0.12 * wide, bottom: -0.06 * top, top: 1.12 * top };
}

const fixed = (x) => Math.min(Math.max(x, -1e5), 1e5).toFixed(1);

function render(host, roots, size) {
  const view = viewOfRoots(roots);
  const frame = { left: 52, top: 8, width: size - 62, height: 0.72 * size - 40 };
  const x = (v) => frame.left + ((v - view.left) / (view.right - view.left)) * frame.width;
  const y = (v) => frame.top + ((view.top - v) / (view.top - view.bottom)) * frame.height;
  const xs = linearTicks(view.left, view.right, 6);
  const ys = linearTicks(Math.max(0, view.bottom), view.top, 6);
  const bottom = frame.top + frame.height;
  const grid = xs.map((v) => `<path class="${v === 0 ? "axis" : "grid"}" d="M${fixed(x(v))} ${frame.top}v${fixed(frame.height)}"/>`).join("") +
    ys.map((v) => `<path class="${v === 0 ? "axis" : "grid"}" d="M${frame.left} ${fixed(y(v))}h${fixed(frame.width)}"/>`).join("");
  const numbers = xs.map((v) => `<text x="${fixed(x(v))}" y="${fixed(bottom + 15)}" text-anchor="middle">${escapeHtml(plain(v))}</text>`).join("") +
    ys.map((v) => `<text x="${frame.left - 6}" y="${fixed(y(v) + 4)}" text-anchor="end">${escapeHtml(plain(v))}</text>`).join("");
  const names = `<text x="${frame.left + frame.width}" y="${fixed(bottom + 30)}" text-anchor="end">real part in 1/s</text>` +
    `<text x="${frame.left + 6}" y="${frame.top + 14}">imaginary part in 1/s</text>`;
  host.innerHTML =
    `<svg class="plane roots" role="img" aria-label="Poles and zeros of the model with their confidence regions" width="${size}" ` +
    `height="${fixed(bottom + 36)}" viewBox="0 0 ${size} ${fixed(bottom + 36)}" style="max-width:${size}px">` +
    `<clipPath id="roots-clip"><rect x="${frame.left}" y="${frame.top}" width="${fixed(frame.width)}" height="${fixed(frame.height)}"/></clipPath>` +
    `<g clip-path="url(#roots-clip)">${grid}${dampingLines(view, x, y)}${roots.map((r) => region(r, x, y)).join("")}` +
    `${roots.map((r) => mark(r, x, y)).join("")}</g>${numbers}${names}` +
    `<rect class="frame" x="${frame.left}" y="${frame.top}" width="${fixed(frame.width)}" height="${fixed(frame.height)}"/></svg>`;
}

/** Rays of equal damping ratio from the origin, named where they leave the picture. */
function dampingLines(view, x, y) {
  return RATIOS.map((ratio) => {
    const slope = -ratio / Math.sqrt(1 - ratio * ratio); // real over imaginary part
    const leaves = slope * view.top < view.left;
    const end = leaves ? [view.left, view.left / slope] : [slope * view.top, view.top];
    if (!leaves && x(0) - x(end[0]) < 14) return ""; // too close to the axis to be told from it
    const label = leaves ? [x(end[0]) + 4, y(end[1]) - 4] : [x(end[0]) + 3, y(end[1]) + 26];
    return `<path class="ray" d="M${fixed(x(0))} ${fixed(y(0))}L${fixed(x(end[0]))} ${fixed(y(end[1]))}"/>` +
      `<text class="ray-label" x="${fixed(label[0])}" y="${fixed(label[1])}">${plain(ratio)}</text>`;
  }).join("");
}

function region({ kind, ellipse }, x, y) {
  if (ellipse.length === 0) return "";
  return `<path class="ellipse ${kind}" d="${ellipse.map((p, i) => `${i ? "L" : "M"}${fixed(x(p[0]))} ${fixed(y(p[1]))}`).join("")}Z"/>`;
}

function mark({ kind, re, im }, x, y) {
  const [px, py] = [x(re), y(im)];
  if (kind === "zero") return `<circle class="root zero" cx="${fixed(px)}" cy="${fixed(py)}" r="5"/>`;
  return `<path class="root pole" d="M${fixed(px - 5)} ${fixed(py - 5)}l10 10M${fixed(px - 5)} ${fixed(py + 5)}l10 -10"/>`;
}
