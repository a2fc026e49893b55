// SPDX-License-Identifier: MIT
// Draws the charts of a document into their places; its text and tables are there already.
import { drawChart } from "./chart.js";
import { drawPlane } from "./plane.js";
import { watchLayout } from "./plot.js";

const charts = JSON.parse(document.getElementById("data").textContent);

for (const figure of document.querySelectorAll("figure[data-chart]")) {
  const chart = charts[Number(figure.dataset.chart)];
  const place = document.createElement("div");
  figure.querySelector("h3").after(place);
  // A chart that cannot be drawn must not take the others with it.
  try {
    (chart.equal_axes ? drawPlane : drawChart)(place, chart);
  } catch (error) {
    console.error(chart.title, error);
    place.textContent = "This chart could not be drawn.";
  }
}
watchLayout(document.getElementById("document"));
