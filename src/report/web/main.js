// SPDX-License-Identifier: MIT
// Draws a page from the data that it carries: the charts of a document, whose text and tables are there already, or an
// identification's result.
import { drawBode } from "./bode.js";
import { drawChart } from "./chart.js";
import { drawHeat } from "./heat.js";
import { drawLoopShape, drawOverlay, drawSpectra } from "./extras.js";
import { drawNyquist } from "./nyquist.js";
import { drawPlane } from "./plane.js";
import { watchLayout } from "./plot.js";
import { drawRoots } from "./roots.js";
import { drawSignals } from "./signals.js";
import { bootstrapTable, figures, foot, head, modelTables, provenance, recordTable, structuresAndChoices, summaryAndFindings, transferFunction } from "./tables.js";

const page = document.getElementById("page");
const data = JSON.parse(document.getElementById("data").textContent);

/** A part that cannot be drawn must not take the others with it. */
function build(part, root, ...rest) {
  try {
    part(root, ...rest);
  } catch (error) {
    console.error(part.name, error);
    return false;
  }
  return true;
}

function drawResult(result) {
  page.replaceChildren();
  for (const part of [head, figures, summaryAndFindings, drawBode, drawNyquist, drawLoopShape, drawOverlay]) build(part, page, result);
  const pair = document.createElement("div");
  pair.className = "split two";
  page.append(pair);
  build(modelTables, pair, result);
  build(recordTable, pair, result);
  if (pair.children.length < 2) pair.className = "split";
  for (const part of [drawRoots, drawSpectra, bootstrapTable, structuresAndChoices, drawSignals, transferFunction, provenance, foot]) build(part, page, result);
}

function drawCharts(charts) {
  for (const figure of page.querySelectorAll("figure[data-chart]")) {
    const chart = charts[Number(figure.dataset.chart)];
    const place = document.createElement("div");
    figure.querySelector("h3").after(place);
    if (!build(chart.map ? drawHeat : chart.equal_axes ? drawPlane : drawChart, place, chart)) place.textContent = "This chart could not be drawn.";
  }
}

(Array.isArray(data) ? drawCharts : drawResult)(data);
watchLayout(page);

/** A table that is wider than its place can be scrolled by the keyboard. */
for (const box of document.querySelectorAll(".scroll")) {
  if (box.scrollWidth <= box.clientWidth) continue;
  box.tabIndex = 0;
  box.setAttribute("role", "region");
  box.setAttribute("aria-label", "Table, wider than the page");
}
/** One page of what matters, or all of it; all where nothing is marked for the one page. */
function printButtons() {
  const root = document.documentElement;
  const sheet = page.querySelector("section.sheet:not(.provenance)") !== null;
  root.classList.toggle("print-all", !sheet);
  const foot = page.querySelector("footer") ?? page.appendChild(document.createElement("footer"));
  const group = document.createElement("div");
  group.className = "buttons screen-only";
  for (const [text, all] of sheet ? [["Print one page", false], ["Print everything", true]] : [["Print", true]]) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = text;
    button.addEventListener("click", () => {
      root.classList.toggle("print-all", all);
      print();
    });
    group.append(button);
  }
  foot.append(group);
  addEventListener("afterprint", () => root.classList.toggle("print-all", !sheet));
}

printButtons();
