// SPDX-License-Identifier: MIT
// Small pieces of page that several sections share.
import { escapeHtml } from "./format.js";

/** A titled box at the end of `root`; returns it. */
export function section(root, title, explain = "", className = "") {
  const box = document.createElement("section");
  box.className = className;
  box.innerHTML = `<h2>${escapeHtml(title)}</h2>` + (explain ? `<p class="explain">${escapeHtml(explain)}</p>` : "");
  root.append(box);
  return box;
}

const SWATCH = {
  point: '<circle cx="12" cy="7" r="3.6" fill="var(--measured)"/>',
  faint: '<circle cx="12" cy="7" r="3" fill="var(--measured)" opacity=".35"/>',
  hollow: '<circle cx="12" cy="7" r="4" fill="var(--card)" stroke="var(--measured)" stroke-width="1.6"/>',
  band: '<rect x="1" y="1" width="22" height="12" rx="2" fill="var(--band)"/>',
  whisker: '<path d="M12 1v12M8 1h8M8 13h8" fill="none" stroke="var(--measured)" stroke-width="1.4"/>',
  noise: '<path d="M1 7h22" stroke="var(--noise)" stroke-width="1"/><circle cx="12" cy="7" r="2" fill="var(--noise)"/>',
  distortion: '<circle cx="12" cy="7" r="3" fill="var(--card)" stroke="var(--distortion)" stroke-width="1.4"/>',
  line: '<path d="M1 7h22" stroke="var(--model)" stroke-width="2.4"/>',
  unit: '<path d="M1 7h22" stroke="var(--soft)" stroke-width="1.6" stroke-dasharray="5 3"/>',
  critical: '<path d="M7 7h10M12 2v10" stroke="var(--bad)" stroke-width="2.4"/>',
  modulus: '<circle cx="12" cy="7" r="5.5" fill="var(--resonance)" fill-opacity=".15" stroke="var(--resonance)" stroke-width="1.5"/>',
  crossover: '<circle cx="12" cy="7" r="4.5" fill="var(--antiresonance)"/>',
  pole: '<path d="M8 3l8 8M8 11l8 -8" stroke="var(--resonance)" stroke-width="2"/>',
  zero: '<circle cx="12" cy="7" r="4" fill="none" stroke="var(--antiresonance)" stroke-width="2"/>',
  ellipse: '<ellipse cx="12" cy="7" rx="10" ry="5.5" fill="var(--resonance)" fill-opacity=".18" stroke="var(--resonance)" stroke-width="1"/>',
  load: '<circle cx="12" cy="7" r="2.6" fill="none" stroke="var(--load)" stroke-width="1.3"/>',
  loadLine: '<path d="M1 7h22" stroke="var(--load)" stroke-width="1.5"/>',
  planned: '<path d="M1 7h22" stroke="var(--ink)" stroke-width="1.8" stroke-dasharray="7 4"/>',
  modelBand: '<rect x="1" y="1" width="22" height="12" rx="2" fill="var(--model)" fill-opacity=".2"/>',
  gain: '<circle cx="12" cy="7" r="4.5" fill="var(--note)"/>',
};

/** An entry of a legend: what is drawn, its name, and what stands after it. */
export const entry = (drawing, name, more = "") =>
  `<span><svg viewBox="0 0 24 14" aria-hidden="true">${drawing}</svg>${escapeHtml(name)}${more}</span>`;

export function legend(items) {
  const box = document.createElement("div");
  box.className = "legend";
  box.innerHTML = items.map(([kind, text]) => entry(SWATCH[kind], text)).join("");
  return box;
}

/** More columns are folded on a phone: a row's cells then stand below each other, with their columns' names. */
const MOST_COLUMNS = 3;

/** Rows of cells, all escaped; `head` may be null. The first cell of a row is its heading; `numeric` columns align right. */
export function table(head, rows, numeric = []) {
  const fold = head !== null && head.length > MOST_COLUMNS;
  const kind = (i) => (numeric.includes(i) ? ' class="n"' : "") + (fold ? ` data-name="${escapeHtml(head[i] ?? "")}"` : "");
  const top = head
    ? `<thead><tr>${head.map((h, i) => `<th scope="col"${numeric.includes(i) ? ' class="n"' : ""}>${escapeHtml(h)}</th>`).join("")}</tr></thead>`
    : "";
  const body = rows.map((row) =>
    `<tr>${row.map((cell, i) => (i ? `<td${kind(i)}>${escapeHtml(cell)}</td>` : `<th scope="row">${escapeHtml(cell)}</th>`)).join("")}</tr>`);
  return `<div class="scroll"><table${fold ? ' class="fold"' : ""}>${top}<tbody>${body.join("")}</tbody></table></div>`;
}
