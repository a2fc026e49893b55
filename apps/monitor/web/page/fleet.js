// SPDX-License-Identifier: MIT
// The list of all axes, worst first. A row is filled when it comes into view and then kept up to date; what is not seen costs nothing.
import { h, mark, say, sign } from "./dom.js";
import { ageOf, alarmsOfAxes, FILTERS, groupOf, isAlarmed, isStale, latencyOf, matches, mostChanged, worstFirst } from "./model.js";
import { go, link } from "./route.js";
import { alarmText, beyondLimit, changeText, clock, duration, figureOf, latencyText, maintenanceText, orderedFigures, plural, sentence, staleText, stateText, valueText } from "./words.js";

/** Figures that a row shows, and from how many standard deviations on another one takes the place of the last. */
const FIGURES = ["resonance", "stiffness", "modulus_margin", "load_inertia"];
const CHANGED = 5;
/** So many rows at first, and more at a time: the worst ones, or what was searched for. */
const PAGE = 100;
/** A pause in typing after which is searched. */
const TYPING_MS = 120;
/** Rows change places no more often than this, and not soon after a person moved among them. */
const ORDER_MS = 1500;
const TOUCHED_MS = 4000;

const SIGN = ["good", "stale", "off", "warning", "bad"];

export function fleetView(main, { fleet, alarms, query, serverNow }) {
  let open = new Map();
  let typing = 0;
  let shown = { q: query.q ?? "", show: query.show ?? "all" };
  const search = h("input", {
    type: "search", id: "search", placeholder: "Name, reason, alarm", value: shown.q, autocomplete: "off", "aria-keyshortcuts": "/",
    oninput: () => {
      clearTimeout(typing);
      typing = setTimeout(() => go([], { q: search.value.trim(), show: shown.show === "all" ? "" : shown.show }, { replace: true }), TYPING_MS);
    },
    onkeydown: (event) => {
      if (event.key === "ArrowDown" || event.key === "Enter") { event.preventDefault(); focusRow(visible[0]); }
      if (event.key === "Escape") { search.value = ""; search.dispatchEvent(new Event("input")); }
    },
  });
  const filters = Object.entries(FILTERS).map(([id, [title]]) => {
    const number = h("b", {});
    const button = h("button", {
      type: "button", "data-focus": id, "aria-pressed": "false",
      onclick: () => go([], { q: shown.q, show: id === "all" ? "" : id }),
    }, title, " ", number);
    return { id, button, number };
  });
  const how = h("p", { class: "small soft", id: "how" }, "Worst first. Values ± one standard deviation; changes against the baseline. Keys: / to search, arrows to choose, Enter to open.");
  const hits = h("p", { class: "hits small", role: "status" });
  const list = h("div", { class: "rows", role: "list", "aria-label": "Axes, worst first", "aria-describedby": "how" });
  const more = h("button", { type: "button", class: "more", onclick: () => {
    const first = visible.length;
    limit += PAGE;
    view.update(performance.now(), true);
    focusRow(visible[first]);
  } });
  main.append(h("h1", {}, "Fleet"),
    h("div", { class: "tools", role: "search" }, h("label", { for: "search" }, "Search axes"), search,
      h("div", { class: "chips", role: "group", "aria-label": "Show" }, filters.map((f) => f.button))),
    hits, list, more, how);

  const rows = new Map();
  let visible = [];
  let limit = PAGE;
  let current = null;
  let ordered = -Infinity;
  let known = 0;
  let touched = -Infinity;
  const seen = new Set();
  // The browser skips what is far out of view (content-visibility) and tells when it no longer does: cheaper than to watch each row.
  const skips = "oncontentvisibilityautostatechange" in list;
  list.addEventListener("contentvisibilityautostatechange", (event) => {
    const name = event.target.dataset.axis;
    if (event.skipped) seen.delete(name);
    else {
      seen.add(name);
      fill(name);
    }
  });

  function focusRow(name) {
    if (!rows.has(name)) return;
    setCurrent(name);
    rows.get(name).link.focus();
  }

  /** One row at a time is reached by Tab; the arrows go on from there. */
  function setCurrent(name) {
    if (current && rows.has(current)) rows.get(current).link.tabIndex = -1;
    current = name;
    if (rows.has(name)) rows.get(name).link.tabIndex = 0;
  }

  const touch = () => { touched = performance.now(); };
  for (const name of ["pointermove", "pointerdown", "keydown", "focusin"]) list.addEventListener(name, touch, { passive: true });
  list.addEventListener("focusin", (event) => {
    const row = event.target.closest("[data-axis]");
    if (row) setCurrent(row.dataset.axis);
  });
  list.addEventListener("keydown", (event) => {
    const at = visible.indexOf(current);
    const page = Math.max(1, Math.floor(innerHeight / 110));
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, PageDown: at + page, PageUp: at - page, Home: 0, End: visible.length - 1 }[event.key];
    if (to === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (event.key === "ArrowUp" && at === 0) search.focus();
    else focusRow(visible[Math.min(Math.max(to, 0), visible.length - 1)]);
  });

  function rowOf(name) {
    const parts = {
      link: h("a", { href: link(["axis", name]), tabindex: -1 }, name), sign: h("span", { class: "icon" }), state: h("span", { class: "state" }), maintenance: h("span", { class: "in-maintenance" }),
      text: h("span", { class: "why" }), figures: h("dl", { class: "values" }), data: h("span", { class: "data" }),
    };
    const row = h("div", { role: "listitem", class: "row", "data-axis": name },
      h("div", { class: "row-head" }, parts.sign, parts.link, parts.state, parts.maintenance), parts.data, parts.text, parts.figures);
    row.addEventListener("click", (event) => { if (!event.target.closest("a") && !String(getSelection())) parts.link.click(); });
    if (!skips) seen.add(name);
    return { row, ...parts, slots: [], kind: null };
  }

  function fill(name, now = performance.now()) {
    const axis = fleet.axes.get(name);
    const r = rows.get(name);
    if (!axis || !r) return;
    const stale = isStale(axis, now);
    const worst = axis.worst_alarm && (open.get(name)?.[0] ?? axis.worst_alarm);
    const kind = worst?.active === false ? "over" : SIGN[groupOf(axis, now)];
    if (r.kind !== kind) {
      r.sign.replaceChildren(sign(kind));
      r.row.className = `row ${kind}`;
      r.kind = kind;
    }
    mark(r.row, "data-stale", stale);
    mark(r.row, "data-untrusted", !axis.trusted);
    const age = ageOf(axis, now);
    say(r.state, stale ? staleText(axis, age) : axis.state === "following" ? (axis.trusted ? "Trusted" : "Not trusted") : stateText(axis.state));
    say(r.maintenance, maintenanceText(axis));
    say(r.text, worst ? `${alarmText(worst, axis.unacknowledged)}: ${sentence(worst.text)}` + (axis.alarms > 1 ? ` (and ${axis.alarms - 1} more)` : "")
      : axis.trusted && !stale ? "" : axis.why ?? "");
    const before = Object.values(axis.figures).some((f) => Number.isFinite(f.value)) ? fleet.asOf(axis, now, serverNow()) : null;
    say(r.data, (stale ? "" : age === null ? (axis.sample > 0 ? "no data since the service started" : "no data yet") : `${duration(age)} old, latency ${latencyText(latencyOf(axis))}`) +
      (before === null ? "" : `${stale ? "" : "; "}figures as of ${clock(before, serverNow())}`));
    fillFigures(r, axis);
  }

  function fillFigures(r, axis) {
    if (!axis.units) return;
    const names = orderedFigures(axis.figures).filter((name) => Number.isFinite(axis.figures[name].value));
    const usual = FIGURES.map((f) => names.find((name) => name.startsWith(f))).filter(Boolean);
    let some = [...usual, ...names.filter((name) => !usual.includes(name))].slice(0, FIGURES.length);
    const most = mostChanged(axis.figures);
    if (most && most.sigmas > CHANGED && !some.includes(most.name)) some = [...some.slice(0, FIGURES.length - 1), most.name];
    while (r.slots.length < some.length) {
      const slot = { name: h("dt", {}), value: h("dd", {}), change: h("dd", { class: "change" }) };
      slot.part = h("div", {}, slot.name, slot.value, slot.change);
      r.slots.push(slot);
      r.figures.append(slot.part);
    }
    r.slots.forEach((slot, i) => {
      mark(slot.part, "hidden", i >= some.length);
      if (i >= some.length) return;
      const told = axis.figures[some[i]];
      const figure = figureOf(some[i], axis);
      say(slot.name, figure.title);
      say(slot.value, valueText(figure, told));
      const alarmed = isAlarmed(open.get(axis.name), some[i]);
      const beyond = alarmed || beyondLimit(told);
      say(slot.change, (changeText(figure, told) || "no baseline") + (beyondLimit(told) ? ", beyond its limit" : alarmed ? ", alarm" : ""));
      mark(slot.change, "data-beyond", beyond);
    });
  }

  function order(now, force) {
    const busy = now - touched < TOUCHED_MS;
    const all = [...fleet.axes.values()];
    const fresh = known !== all.length;
    known = all.length;
    if (!force && !fresh && (busy || now - ordered < ORDER_MS)) return;
    ordered = now;
    for (const name of rows.keys()) {
      if (fleet.axes.has(name)) continue;
      rows.get(name).row.remove();
      rows.delete(name);
      seen.delete(name);
    }
    const found = worstFirst(all.filter((a) => matches(a, shown, now)), now).map((a) => a.name);
    visible = found.slice(0, limit);
    const wanted = new Set(visible);
    for (const [name, r] of rows) if (!wanted.has(name) && r.row.isConnected) r.row.remove();
    const focused = list.contains(document.activeElement) ? document.activeElement : null;
    let place = list.firstChild;
    for (const name of visible) {
      if (!rows.has(name)) rows.set(name, rowOf(name));
      const { row } = rows.get(name);
      if (row === place) place = place.nextSibling;
      else list.insertBefore(row, place);
    }
    // What is moved loses the focus.
    if (focused?.isConnected && document.activeElement !== focused) focused.focus({ preventScroll: true });
    if (!wanted.has(current)) setCurrent(visible[0] ?? null);
    say(hits, all.length === 0 ? (fleet.problem ? `The axes could not be loaded: ${fleet.problem}` : fleet.server.told_at === null ? "Loading …" : "No axes yet: the server waits for the first samples.")
      : (found.length === all.length ? plural(all.length, "axis", "axes") : `${plural(found.length, "axis", "axes")} of ${all.length}`) +
        (found.length > visible.length ? `, the worst ${visible.length} shown` : ""));
    mark(more, "hidden", found.length <= visible.length);
    say(more, `Show ${Math.min(PAGE, found.length - visible.length)} more`);
  }

  let filled = -Infinity;
  const view = {
    title: "Fleet", nav: "fleet", shortcut: () => search.focus(), remember: () => current,
    restore: (name) => { if (name && rows.has(name)) { focusRow(name); rows.get(name).row.scrollIntoView({ block: "center" }); return true; } return false; },
    query: (next) => {
      shown = { q: next.q ?? "", show: next.show ?? "all" };
      limit = PAGE;
      if (document.activeElement !== search) search.value = shown.q;
      view.update(performance.now(), true);
      return true;
    },
    leave: () => clearTimeout(typing),
    update: (now, force = false) => {
      if (!force && now - filled < 200) return;
      filled = now;
      open = alarmsOfAxes(alarms);
      order(now, force);
      for (const name of seen) fill(name, now);
      for (const { id, button, number } of filters) {
        let n = 0;
        for (const axis of fleet.axes.values()) if (FILTERS[id][1](axis, now)) n += 1;
        say(number, String(n));
        mark(button, "aria-pressed", id === shown.show);
      }
    },
  };
  view.update(performance.now(), true);
  return view;
}
