// SPDX-License-Identifier: MIT
// What all uPlot charts share: size, colours, zoom, reading by mouse and finger, and print.
import { colour } from "./theme.js";

const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif';
export const AXIS_WIDTH = 56;
/** A4 less its margins, at 96 pixels per inch, less the padding of a section. */
const PRINT_WIDTH = 668;

/** Lower charts on paper: the response then fits the first page. */
const PRINT_HEIGHT = 0.68;

const redraws = [];
let printing = false;

/** Registers a picture: `draw(width)` lays it out anew. Called on resize, change of theme and print. */
export function onLayout(host, draw, printWidth = PRINT_WIDTH) {
  const run = () => {
    const width = printing ? printWidth : host.clientWidth;
    if (width > 0) draw(width);
  };
  redraws.push(run);
  run();
}

function layoutAll() {
  redraws.forEach((run) => run());
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

/** A chart in `host`. `group` shares cursor and zoom among charts with the same x axis; the series `rings` get a ring there. */
export function makePlot(host, { height, label, group, scales, axes, series, bands, hooks, padding, data, rings, onCursor }) {
  host.setAttribute("role", "img");
  host.setAttribute("aria-label", label);
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
      setCursor: [(u) => {
        const inside = u.cursor.left >= 0 && u.cursor.left <= u.over.clientWidth;
        onCursor(inside ? u.posToVal(u.cursor.left, "x") : null);
      }],
    },
  };
  const plot = new uPlot(options, data, host);
  readByFinger(plot);
  onLayout(host, (width) => {
    plot.setSize({ width, height: Math.round(printing ? height * PRINT_HEIGHT : height) });
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
