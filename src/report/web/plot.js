// SPDX-License-Identifier: MIT
// What all uPlot charts share: size, colours, zoom, reading by mouse and finger, and print.
import { colour } from "./theme.js";

const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif';
export const AXIS_WIDTH = 56;
/** A4 less its margins, at 96 pixels per inch, less the padding of a section. */
const PRINT_WIDTH = 668;

/** Lower charts on paper: the response then fits the first page. */
const PRINT_HEIGHT = 0.68;
const SHEET_HEIGHT = 0.37;

/** What lays a picture out anew, by its host. */
const redraws = new Map();
/** Plots by group: zoomed together by the keyboard as they are by the mouse. */
const groups = new Map();
let printing = false;

/** On paper the charts of two columns, and on the one page all of a document's, have half the width. */
const HALF_WIDTH = 316;
const printWidthOf = (host) => (host.closest(".pair") || (onSheet() && host.closest(".sheet > figure + figure, .sheet > figure:has(+ figure)")) ? HALF_WIDTH : PRINT_WIDTH);

/** Whether the one page of what matters is printed, not everything. */
export const onSheet = () => printing && !document.documentElement.classList.contains("print-all");

/** Registers a picture: `draw(width)` lays it out anew. Called on resize, change of theme and print. */
export function onLayout(host, draw, printWidth = () => printWidthOf(host)) {
  const run = () => {
    const width = printing ? printWidth() : host.clientWidth;
    if (width > 0) draw(width);
  };
  redraws.set(host, run);
  run();
}

function layoutAll() {
  redraws.forEach((run) => run());
}

/** Lets go of every picture in `root`, which leaves the page. */
export function release(root) {
  for (const host of [...redraws.keys()]) if (root.contains(host)) redraws.delete(host);
  for (const [name, plots] of groups) {
    const gone = plots.filter((p) => root.contains(p.root));
    gone.forEach((p) => p.destroy());
    const kept = plots.filter((p) => !gone.includes(p));
    if (kept.length) groups.set(name, kept);
    else groups.delete(name);
  }
}

/** Other data in a plot, over the part of the x axis that is shown, or over `range`; all where all was shown. */
export function renew(plot, data, range = null) {
  const { min, max } = plot.scales.x;
  const old = plot.data[0];
  const whole = old.length === 0 || (min <= old[0] && max >= old[old.length - 1]);
  plot.setData(data, range === null && whole);
  if (range !== null) plot.setScale("x", { min: range[0], max: range[1] });
  else if (!whole) plot.setScale("x", { min, max });
}

export function watchLayout(root) {
  let width = root.clientWidth;
  new ResizeObserver(() => {
    if (printing || root.clientWidth === width) return;
    width = root.clientWidth;
    layoutAll();
  }).observe(root);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", layoutAll);
  const print = (on) => {
    if (printing === on) return;
    printing = on;
    document.documentElement.classList.toggle("printing", on);
    for (const box of document.querySelectorAll("details")) {
      if (on) {
        box.dataset.was = box.open ? "open" : "";
        box.open = true;
      } else {
        box.open = box.dataset.was === "open";
      }
    }
    layoutAll();
  };
  addEventListener("beforeprint", () => print(true));
  addEventListener("afterprint", () => print(false));
}

export function axis(overrides) {
  return {
    font: FONT, stroke: () => colour("soft"), gap: 4, size: AXIS_WIDTH,
    grid: { stroke: () => colour("grid"), width: 1 },
    ticks: { stroke: () => colour("line"), width: 1, size: 5 },
    border: { show: false },
    ...overrides,
  };
}

/** A chart in `host`. `group` shares cursor and zoom among charts with the same x axis; the series `rings` get a ring there.
 *  `onZoom` is told the part of the x axis that is shown. */
export function makePlot(host, { height, label, group, scales, axes, series, bands, hooks, padding, data, rings, onCursor, onZoom }) {
  host.setAttribute("role", "figure");
  host.setAttribute("aria-label", `${label}. Arrow keys read values, plus and minus zoom, Escape shows all.`);
  host.tabIndex = 0;
  const options = {
    width: Math.max(200, host.clientWidth), height, padding: padding ?? [6, 10, 0, 0],
    legend: { show: false }, scales, axes, series, bands,
    cursor: {
      sync: { key: group, setSeries: false, scales: ["x", null] },
      drag: { x: true, y: false, setScale: true, dist: 6 },
      hover: { skip: [null, undefined] },
      points: { size: (u, i) => (rings.includes(i) ? 9 : 0), width: (u, i) => (rings.includes(i) ? 2 : 0) },
    },
    hooks: {
      ...hooks,
      setScale: [(u, key) => { if (key === "x" && onZoom) onZoom(u.scales.x.min, u.scales.x.max); }],
      setCursor: [(u) => {
        const inside = u.cursor.left >= 0 && u.cursor.left <= u.over.clientWidth;
        onCursor(inside ? u.posToVal(u.cursor.left, "x") : null, u);
      }],
    },
  };
  const plot = new uPlot(options, data, host);
  readByFinger(plot);
  groups.set(group, [...(groups.get(group) ?? []), plot]);
  readByKeys(host, plot, () => groups.get(group));
  onLayout(host, (width) => {
    plot.setSize({ width, height: Math.round(onSheet() ? height * SHEET_HEIGHT : printing ? height * PRINT_HEIGHT : height) });
    plot.redraw(false, true);
  });
  return plot;
}

/** uPlot listens to the mouse only; a finger that moves sideways moves the cursor, up and down scrolls the page. */
function readByFinger(plot) {
  const move = (event) => {
    const touch = event.touches[0];
    const box = plot.over.getBoundingClientRect();
    plot.setCursor({ left: touch.clientX - box.left, top: touch.clientY - box.top });
  };
  plot.over.addEventListener("touchstart", move, { passive: true });
  plot.over.addEventListener("touchmove", move, { passive: true });
}

/** Part of the shown axis that an arrow key goes, alone and with Shift. */
const STEP = 0.01;
const LEAP = 0.1;

/** What the mouse does by the keyboard: read, zoom around the cursor, show all. */
function readByKeys(host, plot, group) {
  const width = () => plot.over.clientWidth;
  const at = () => (plot.cursor.left >= 0 ? plot.cursor.left : width() / 2);
  const move = (by) => {
    const left = Math.min(Math.max(at() + by * width(), 0), width());
    for (const p of group()) p.setCursor({ left: (left / width()) * p.over.clientWidth, top: p.over.clientHeight / 2 });
  };
  const zoom = (factor) => {
    const ends = [at() * (1 - factor), at() + (width() - at()) * factor].map((left) => plot.posToVal(left, "x"));
    for (const p of group()) p.setScale("x", { min: ends[0], max: ends[1] });
  };
  const all = () => { for (const p of group()) p.setScale("x", { min: p.data[0][0], max: p.data[0][p.data[0].length - 1] }); };
  host.addEventListener("keydown", (event) => {
    const step = event.shiftKey ? LEAP : STEP;
    const actions = {
      ArrowLeft: () => move(-step), ArrowRight: () => move(step), "+": () => zoom(0.5), "=": () => zoom(0.5), "-": () => zoom(2),
      Escape: all, Home: () => move(-1), End: () => move(1),
    };
    if (!actions[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    actions[event.key]();
  });
}
