// SPDX-License-Identifier: MIT
// Builds the report from the data that the page carries.
import { drawBode } from "./bode.js";
import { drawNyquist } from "./nyquist.js";
import { watchLayout } from "./plot.js";
import { drawSignals } from "./signals.js";
import { drawRoots } from "./roots.js";
import { bootstrapTable, figures, foot, head, modelTables, recordTable, structuresAndChoices, summaryAndFindings, transferFunction } from "./tables.js";

const report = document.getElementById("report");
const result = JSON.parse(document.getElementById("data").textContent);
report.replaceChildren();

/** A part that cannot be drawn must not take the others with it. */
function build(part, root) {
  try {
    part(root, result);
  } catch (error) {
    console.error(part.name, error);
  }
}

for (const part of [head, figures, summaryAndFindings, drawBode, drawNyquist]) build(part, report);
const pair = document.createElement("div");
pair.className = "split two";
report.append(pair);
build(modelTables, pair);
build(recordTable, pair);
if (pair.children.length < 2) pair.className = "split";
for (const part of [drawRoots, bootstrapTable, structuresAndChoices, drawSignals, transferFunction, foot]) build(part, report);
watchLayout(report);
