// SPDX-License-Identifier: MIT
// Values over two axes as colours: a response's magnitude over time and frequency.
import { escapeHtml, isNumber, list, plain, significant } from "./format.js";
import { axis, AXIS_WIDTH, makePlot } from "./plot.js";
import { xAxis } from "./chart.js";
import { logLabels, logTicks } from "./ticks.js";

const HEIGHT = 300;
/** Dark to bright in steps that look even, told apart by the colour-blind too. */
const STOPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/** The colour of a share 0 ... 1 of the scale. */
export function shade(share) {
  const place = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1);
  const i = Math.min(Math.floor(place), STOPS.length - 2);
  const mixed = STOPS[i].map((from, k) => Math.round(from + (STOPS[i + 1][k] - from) * (place - i)));
  return `rgb(${mixed.join(",")})`;
}

/** The scale's ends: 1 % of the values lie beyond either. */
export function scaleOf(rows) {
  const values = rows.flat().filter(isNumber).sort((a, b) => a - b);
  if (values.length === 0) return [0, 1];
  const at = (share) => values[Math.round(share * (values.length - 1))];
  const [low, high] = [at(0.01), at(0.99)];
  return high > low ? [low, high] : [low - 1, high + 1];
}

/** Where one cell ends and the next begins: half-way, on a logarithmic axis in ratio. */
export function edgesOf(centres, log = false) {
  const measure = log ? Math.log : (v) => v;
  const back = log ? Math.exp : (v) => v;
  const c = centres.map(measure);
  if (c.length < 2) return c.length ? [back(c[0] - 0.5), back(c[0] + 0.5)] : [];
  const inner = c.slice(1).map((v, i) => (v + c[i]) / 2);
  return [2 * c[0] - inner[0], ...inner, 2 * c[c.length - 1] - inner[inner.length - 1]].map(back);
}

export function drawHeat(place, chart) {
  const { x, y, value, unit } = chart.map;
  const rows = list(value);
  const [low, high] = scaleOf(rows);
  const key = document.createElement("div");
  key.className = "legend heat";
  const ramp = STOPS.map((_, i) => shade(i / (STOPS.length - 1))).join(",");
  key.innerHTML = `<span>${escapeHtml(plain(low, 3))}<i style="background:linear-gradient(90deg,${ramp})"></i>` +
    `${escapeHtml(plain(high, 3))} ${escapeHtml(unit ?? "")}</span><span class="where screen-only" aria-live="polite"></span>`;
  const upright = document.createElement("div");
  upright.className = "axis-name";
  upright.textContent = chart.y_label;
  const host = document.createElement("div");
  host.className = "plot";
  place.append(key, upright, host);
  const [xs, ys] = [edgesOf(x), edgesOf(y, true)];
  const where = key.querySelector(".where");
  makePlot(host, {
    height: HEIGHT, label: `${chart.title}: ${chart.y_label} over ${chart.x_label}`, group: [chart.section, chart.x_label, x[0], x[x.length - 1]].join("|"),
    data: [x, x.map(() => null)], padding: [8, 14, 0, 0], rings: [],
    scales: {
      x: { time: false, range: (u, min, max) => (isNumber(min) && max > min && (min > x[0] || max < x[x.length - 1]) ? [min, max] : [xs[0], xs[xs.length - 1]]) },
      y: { distr: 3, range: () => [ys[0], ys[ys.length - 1]] },
    },
    hooks: { drawClear: [(u) => paint(u, xs, ys, rows, (v) => shade((v - low) / (high - low)))] },
    axes: [{ ...xAxis(chart.x_label, false), grid: { show: false } }, axis({
      grid: { show: false },
      size: AXIS_WIDTH, splits: (u) => logTicks(u.scales.y.min, u.scales.y.max), filter: (u, splits) => splits,
      values: (u, splits) => {
        const { min, max } = u.scales.y;
        const shown = logLabels(splits, min, max, u.bbox.height / uPlot.pxRatio, 18);
        return splits.map((v) => (shown.has(v) ? plain(v) : ""));
      },
    })],
    series: [{}, { points: { show: false } }],
    onCursor: (t, u) => {
      if (t === null) { where.textContent = ""; return; }
      const f = u.cursor.top >= 0 ? u.posToVal(u.cursor.top, "y") : y[0];
      const [i, k] = [cellOf(ys, f), cellOf(xs, t)];
      const v = rows[i]?.[k];
      where.textContent = `at ${significant(t, 4)}, ${significant(y[i] ?? f, 4)} Hz: ${isNumber(v) ? `${plain(v, 4)} ${unit ?? ""}` : "not known"}`;
    },
  });
}

function cellOf(edges, v) {
  let i = 0;
  while (i + 2 < edges.length && edges[i + 1] <= v) ++i;
  return i;
}

function paint(u, xs, ys, rows, tint) {
  const { ctx, bbox } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  const px = xs.map((v) => Math.round(u.valToPos(v, "x", true)));
  const py = ys.map((v) => Math.round(u.valToPos(v, "y", true)));
  rows.forEach((row, i) => row.forEach((v, k) => {
    if (!isNumber(v)) return;
    ctx.fillStyle = tint(v);
    ctx.fillRect(px[k], py[i + 1], px[k + 1] - px[k], py[i] - py[i + 1]);
  }));
  ctx.restore();
}
