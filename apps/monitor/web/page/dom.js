// SPDX-License-Identifier: MIT
// Elements from names, attributes and children. Texts stay texts: nothing that came from the data becomes markup.

/** An element. `on` handlers by "onclick" ..., booleans set or leave out an attribute, null and false children drop out. */
export function h(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key === "value" && name !== "option" && name !== "li") element.value = value;
    else element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.flat().filter((c) => c !== null && c !== undefined && c !== false));
  return element;
}

/** Changes a text only where it differs: what is selected or read stays. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function mark(element, name, value) {
  if (name.startsWith("aria-") && typeof value === "boolean") element.setAttribute(name, String(value));
  else if (value === null || value === undefined || value === false) element.removeAttribute(name);
  else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value === true ? "" : value);
}

/** The element of a data-focus, or where there is none any more, one nearby: of the same alarm, or the first. */
export function nearest(part, focus) {
  const all = [...part.querySelectorAll("[data-focus]")];
  const tail = /-[^-]*$/.exec(focus)?.[0];
  return all.find((e) => e.dataset.focus === focus) ?? all.find((e) => tail && e.dataset.focus.endsWith(tail)) ?? all[0];
}

/** Replaces the children of a part that is shown anew, if `key` says that they differ; the focus stays with the element of the
 *  same data-focus. */
export function renew(part, key, children) {
  const text = JSON.stringify(key);
  if (part.shownKey === text) return;
  part.shownKey = text;
  const focus = part.contains(document.activeElement) ? document.activeElement.closest("[data-focus]")?.dataset.focus : null;
  part.replaceChildren(...children().flat().filter(Boolean));
  if (focus) nearest(part, focus)?.focus({ preventScroll: true });
}

const SVG = "http://www.w3.org/2000/svg";
const SIGNS = {
  good: "M6 12.5l4 4 8-9", bad: "M12 5v9M12 18v.5", warning: "M12 5v9M12 18v.5", over: "M7 12.5l3.5 3.5 6.5-7.5", off: "M6 12h12", stale: "M12 6v6l4 3", wait: "M6 12h.5M12 12h.5M18 12h.5",
};
const FRAMES = { bad: "M12 1.5L23.4 22H.6z", warning: "M12 .8L23.2 12 12 23.2 .8 12z" };

/** A sign whose shape, not only its colour, tells what it says. */
export function sign(kind) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  svg.setAttribute("class", `sign ${kind}`);
  const frame = document.createElementNS(SVG, FRAMES[kind] ? "path" : "circle");
  if (FRAMES[kind]) frame.setAttribute("d", FRAMES[kind]);
  else for (const [key, value] of [["cx", 12], ["cy", 12], ["r", 11]]) frame.setAttribute(key, value);
  frame.setAttribute("class", "frame");
  const line = document.createElementNS(SVG, "path");
  line.setAttribute("d", SIGNS[kind]);
  line.setAttribute("class", "line");
  svg.append(frame, line);
  return svg;
}

/** A table of texts and nodes; the first cell of a row is its heading, columns in `numeric` align right. */
export function grid(head, rows, { caption = null, numeric = [], className = "" } = {}) {
  const fold = head.length > 3;
  const cell = (i) => ({ class: numeric.includes(i) ? "n" : null, "data-name": fold ? head[i] : null });
  return h("div", { class: "scroll" }, h("table", { class: `${fold ? "fold" : ""} ${className}`.trim() || null },
    caption ? h("caption", { class: "unseen" }, caption) : null,
    h("thead", {}, h("tr", {}, head.map((text, i) => h("th", { scope: "col", class: numeric.includes(i) ? "n" : null }, text)))),
    h("tbody", {}, rows.map((row) => h("tr", {}, row.map((content, i) =>
      (i ? h("td", cell(i), content) : h("th", { scope: "row" }, content))))))));
}
