// SPDX-License-Identifier: MIT
// Charts that the page's data hold ready: sensitivity, the output measured and simulated, spectra.
import { drawChart } from "./chart.js";
import { list } from "./format.js";
import { section } from "./markup.js";

function figure(box, chart, group, height) {
  const place = document.createElement("figure");
  const title = document.createElement("h3");
  title.textContent = chart.title;
  place.append(title);
  box.append(place);
  drawChart(place, { ...chart, section: group }, { height });
}

const isChart = (chart) => Boolean(chart) && list(chart.curves).length > 0;

export function drawLoopShape(root, data) {
  const chart = data.page?.sensitivity;
  if (!isChart(chart)) return;
  const box = section(root, "Sensitivity",
    "|S|: how much of a disturbance at each frequency the loop lets through; above 0 dB it amplifies. |T|: how much of the measurement noise and of the " +
    "reference it follows. Ms, the peak of |S|, is the inverse of the modulus margin; below 1.6 is robust, above 2 is not.", "whole");
  figure(box, chart, "sensitivity", 230);
}

export function drawOverlay(root, data) {
  const chart = data.page?.overlay;
  if (!isChart(chart)) return;
  const box = section(root, "Measured and simulated",
    "The model's output for the recorded input, over the measured one. Drag sideways to enlarge, double-click to see all.", "whole");
  figure(box, chart, "overlay", 260);
}

export function drawSpectra(root, data) {
  const charts = list(data.page?.spectra).filter(isChart);
  if (charts.length === 0) return;
  const box = section(root, "Spectra", "Power of input and output per line, mean removed. What is not excited cannot be identified.", "whole");
  const pair = document.createElement("div");
  pair.className = "pair";
  box.append(pair);
  for (const chart of charts) figure(pair, chart, "spectra", 230);
}
