// SPDX-License-Identifier: MIT
// One axis: what is wrong, its figures, response, loop and trends, what the estimator does, and what a person can do.
import { isNumber, list, plain, prettyUnit, significant, words } from "./report/format.js";
import { axisButtons, endMaintenanceButton } from "./actions.js";
import { get, part } from "./api.js";
import { alarmLine, worstAlarms } from "./alarms.js";
import { grid, h, mark, renew, say, sign } from "./dom.js";
import { ageOf, alarmsOfAxes, groupOf, isAlarmed, isLearning, isSilent, isStale, latencyOf } from "./model.js";
import { responsePart } from "./response.js";
import { go, link } from "./route.js";
import { trendsPart } from "./trends.js";
import { alarmText, beyondLimit, brief, changeText, clock, count, duration, figureOf, fromInput, GATES, hasLimit, isOpen, latencyText, limitsText, maintenanceText, orderedFigures, presenceOfAll, sigmas, staleText, stamp, stateText, toInput, valueText, verdictText } from "./words.js";

const DETAILS_MS = 5000;
const CLASS = ["good", "none", "none", "warning", "bad"];
const SIGN = ["good", "stale", "off", "warning", "bad"];

export function axisView(main, { fleet, alarms, path, query, serverNow }) {
  const name = path[1];
  /** Drives that are simulated faster than real time are ahead of the clock. */
  const nowOfAxis = () => Math.max(serverNow(), fleet.axes.get(name)?.time_s ?? 0);
  const verdict = h("div", { class: "verdict none" }, h("span", { class: "icon" }), h("div", {}, h("b", {}), h("span", {})));
  const meta = h("p", { class: "meta" });
  const open = h("div", { class: "axis-alarms" });
  const figuresBody = h("tbody", {});
  const figuresHead = ["Figure", "Now", "Baseline", "Change", "Limits", "Standard deviations"].map((t, i) => h("th", { scope: "col", class: i ? "n" : null }, t));
  const figuresTable = h("table", { class: "fold figures-table" }, h("caption", { class: "unseen" }), h("thead", {}, h("tr", {}, figuresHead)), figuresBody);
  const stale = h("p", { class: "stale-text", role: "status" });
  const columns = h("div", {});
  const missing = h("p", { class: "error", role: "alert" });
  const maintained = h("p", { role: "status" });
  const maintenance = h("div", { class: "maintenance" }, maintained, endMaintenanceButton(name));
  main.append(h("p", { class: "crumb" }, h("a", { href: link([]) }, "← Fleet")),
    h("div", { class: "head" }, h("div", {}, h("h1", {}, name), meta), verdict), missing, maintenance, stale, open, columns);
  const left = h("div", {});
  columns.append(h("section", {}, h("h2", {}, "Figures"), h("p", { class: "explain" }, "± one standard deviation. Changes are told against the baseline."),
    h("div", { class: "scroll" }, figuresTable)), left);
  const response = responsePart(columns);
  const live = columns.querySelector(".live");
  let newest = null;
  const showResponse = (told) => {
    newest = told;
    response.show(told);
  };
  const trends = trendsPart(columns, {
    name, serverNow: nowOfAxis, setQuery: (change) => { query = { ...query, ...change }; go(["axis", name], query); },
  });
  trends.query(query);
  const gates = h("ul", { class: "gates" });
  const estimator = h("section", {}, h("h2", {}, "What the estimator is doing"), h("p", { class: "explain" }), gates, h("div", {}));
  const samples = h("section", {}, h("h2", {}, "Samples"), h("div", {}));
  const baselines = h("section", {}, h("h2", {}, "Baselines and actions"), axisButtons(name, () => { details(); trends.reload(); }), h("div", {}));
  columns.append(h("div", { class: "split two" }, estimator, samples), baselines, compareForm(name, nowOfAxis));
  const slots = new Map();
  let more = null;
  let asked = -Infinity;
  let known = fleet.axes.has(name);

  async function details() {
    asked = performance.now();
    try {
      more = await get(`axes/${part(name)}`);
      known = true;
      say(missing, "");
      fleet.merge(name, more, performance.now());
    } catch (error) {
      if (error.status === 404) gone();
      else if (more === null) say(missing, `The axis could not be loaded: ${error.message}`);
    }
  }

  /** Where there was one until the service was configured anew, what stands there is not of now. */
  function gone() {
    known = false;
    say(missing, `There is no axis named ${name}.`);
    say(meta, "");
    mark(columns, "data-stale", true);
    verdict.className = "verdict none";
    renew(verdict.firstElementChild, "gone", () => []);
    for (const line of verdict.querySelectorAll("b, b + span")) say(line, "");
  }

  async function firstResponse() {
    try {
      showResponse(await get(`axes/${part(name)}/response`));
    } catch {
      // There is none yet; the stream brings it when there is.
    }
  }

  /** Since when, as far as it is known; where none came since a restart, the service says so. */
  function noSamples(axis, age) {
    const newest = age === null ? "" : clock(serverNow() - age, serverNow());
    if (axis.samples?.received !== 0 || !axis.why) return `No samples arrive from this axis${newest && ` since ${newest}`}`;
    return axis.why.charAt(0).toUpperCase() + axis.why.slice(1) + (newest && `, the newest sample of ${newest}`);
  }

  /** "not trusted, as of 10:15:04"; empty where it is trusted and of now. */
  const reserve = (axis, before) => [axis.trusted ? "" : "not trusted", before === null ? "" : `as of ${clock(before, serverNow())}`].filter(Boolean).join(", ");

  function figureRows(axis, now) {
    const open = alarmsOfAxes(alarms).get(name);
    const valued = Object.values(axis.figures).some((f) => isNumber(f.value));
    const title = [valued && (isLearning(axis) || isStale(axis, now) || ageOf(axis, now) === null) ? "Last known" : "Now", valued ? reserve(axis, fleet.asOf(axis, now, serverNow())) : ""].filter(Boolean).join(", ");
    say(figuresHead[1], title);
    say(figuresTable.caption, `Figures of the axis: ${title.toLowerCase()}`);
    mark(figuresTable, "data-untrusted", !axis.trusted);
    // Changes are found over time by what the evidence is worth; only some figures have a plain limit.
    mark(figuresTable, "data-no-limit", !Object.values(axis.figures).some(hasLimit));
    for (const key of orderedFigures(axis.figures)) {
      const told = axis.figures[key];
      const figure = figureOf(key, axis);
      if (!slots.has(key)) {
        const cells = ["Now", "Baseline", "Change", "Limits", "Standard deviations"].map((head) => h("td", { class: "n", "data-name": head }));
        slots.set(key, cells);
        figuresBody.append(h("tr", {}, h("th", { scope: "row" }, figure.title), cells));
      }
      const [value, base, change, limits, sigma] = slots.get(key);
      mark(value, "data-name", title);
      say(value, valueText(figure, told));
      say(base, isNumber(told.baseline) ? `${significant(told.baseline, 4)}${figure.unit ? " " + prettyUnit(figure.unit) : ""}` : "–");
      const beyond = beyondLimit(told);
      say(change, changeText(figure, told) || "–");
      mark(change, "data-beyond", beyond || isAlarmed(open, key));
      say(limits, hasLimit(told) ? limitsText(figure, told) + (beyond ? ", exceeded" : "") : "–");
      say(sigma, sigmas(told) ? significant(sigmas(told), 2) : "–");
    }
  }

  function estimatorPart(axis) {
    const e = more?.estimator ?? {};
    say(estimator.querySelector(".explain"), [stateText(axis.state), axis.trusted ? "trusted" : `not trusted: ${axis.why || verdictText(axis.verdict).toLowerCase()}`].join(", ") + ".");
    const all = Object.keys(e.gates ?? {});
    const order = [...Object.keys(GATES).filter((g) => all.includes(g)), ...all.filter((g) => !GATES[g])];
    renew(gates, order.map((g) => [g, e.gates[g]]), () => order.map((g) => {
      const [title, yes, no] = GATES[g] ?? [words(g), "yes", "no"];
      const good = e.gates[g] === true;
      return h("li", { class: good ? "yes" : "no" }, sign(good ? "good" : "warning"), h("div", {}, h("b", {}, `${title}: ${good ? "yes" : "no"}`), h("span", {}, good ? yes : no)));
    }));
    const facts = [
      ["Method", e.method ? words(e.method) : null], ["Memory", isNumber(e.memory_s) ? duration(e.memory_s) : null], ["Learned", isNumber(e.learned_s) ? duration(e.learned_s) : null],
      ["Began with", e.start ? words(e.start) : null], ["Verdict", verdictText(axis.verdict)],
      ["Controller", more?.loop?.controller ?? null], ["Delay of the loop", isNumber(more?.loop?.delay_s) ? `${plain(1000 * more.loop.delay_s, 3)} ms` : null], ["Configuration", more?.configuration_hash?.slice(0, 12) || null],
    ].filter(([, v]) => v !== null);
    renew(estimator.lastElementChild, facts, () => [grid(["Estimator", "Value"], facts, { caption: "Settings of the estimator", className: "facts" })]);
  }

  function samplePart(axis) {
    const s = axis.samples ?? {};
    const rows = [["Source", axis.source ?? "–"], ["Rate", isNumber(axis.rate_hz) ? `${plain(axis.rate_hz, 5)} Hz` : "–"], ["Received", count(s.received)], ["Missing", count(s.missing)],
      ["Late", count(s.late)], ["Double", count(s.duplicate)], ["Lost", count(s.lost)], ["Newest sample", count(axis.sample)]];
    const faults = list(axis.faults).filter((f) => f.count > 0);
    const body = samples.lastElementChild;
    renew(body, [rows, faults], () => [grid(["Counter", "Value"], rows, { caption: "Counters of samples", numeric: [1] }),
      h("h3", {}, "Faults in the data"),
      faults.length ? grid(["Kind", "Times", "Newest"], faults.map((f) => [words(f.kind), count(f.count), f.text ?? ""]), { caption: "Faults in the data", numeric: [1], className: "plain" }) : h("p", { class: "soft" }, "None.")]);
  }

  function baselinePart() {
    const all = list(more?.baselines);
    renew(baselines.lastElementChild, all, () => [all.length ? grid(["Set", "By", "Reason", "Figures"], all.map((b) => [
      stamp(b.time_s) + (b.active ? " (in use)" : ""), b.who ?? "–", b.reason ?? "–",
      orderedFigures(b.figures).slice(0, 3).map((f) => `${figureOf(f, more).title} ${valueText(figureOf(f, more), b.figures[f])}`).join("; ") || "–"]),
    { caption: "Baselines, newest first", className: "plain" }) : h("p", { class: "soft" }, "No baseline yet.")]);
  }

  details();
  firstResponse();
  let filled = -Infinity;
  return {
    title: name, nav: "fleet", axis: name,
    query: (next, nextPath) => {
      if (nextPath[1] !== name || nextPath.length > 2) return false;
      query = next;
      trends.query(next);
      return true;
    },
    stream: { response: (event) => { if (event.axis === undefined || event.axis === name) showResponse(event); } },
    update: (now) => {
      const axis = fleet.axes.get(name);
      if (now - asked > DETAILS_MS) details();
      if (!axis?.units || !known) return; // a frame tells no units
      const old = isStale(axis, now);
      const silent = old && axis.state !== "refused";
      const age = ageOf(axis, now);
      mark(live, "data-untrusted", !axis.trusted);
      const told = newest ? reserve(axis, fleet.asOf(axis, now, serverNow(), newest.time_s ?? null)) : "";
      response.update(now, axis, more?.loop ?? {}, old ? staleText(axis, age) : told.charAt(0).toUpperCase() + told.slice(1));
      if (now - filled < 200) return;
      filled = now;
      const group = groupOf(axis, now);
      const worst = axis.worst_alarm && (alarmsOfAxes(alarms).get(name)?.[0] ?? axis.worst_alarm);
      const over = worst?.active === false;
      const kind = over ? "over" : SIGN[group];
      verdict.className = `verdict ${over ? "warning" : CLASS[group]}`;
      renew(verdict.firstElementChild, kind, () => [sign(kind)]);
      say(verdict.querySelector("b"), worst ? alarmText(worst, axis.unacknowledged) : silent ? "No data" : axis.trusted ? "Trusted" : axis.state === "following" ? "Not trusted" : stateText(axis.state));
      say(verdict.querySelector("b + span"), worst ? brief(worst.text) : (silent && age !== null ? `for ${duration(age)}` : axis.why ?? ""));
      say(meta, `${stateText(silent ? "stale" : axis.state)}; ${age === null ? (axis.sample > 0 ? "no samples since the service started" : "no samples yet") : old ? `newest sample ${duration(age)} ago` : `data ${duration(age)} old, latency ${latencyText(latencyOf(axis))}`}`);
      say(stale, old ? `${isSilent(axis, now) || !["stale", "refused"].includes(axis.state) ? "The server does not answer" : silent ? noSamples(axis, age) : "What this axis sends is refused"}: figures and curves below are the last known ones, not those of now.` : "");
      mark(columns, "data-stale", old);
      const until = maintenanceText(axis);
      say(maintained, until && `${until}: no alarm of this axis is told.`);
      mark(maintenance, "hidden", until === "");
      const mine = worstAlarms([...alarms.values()].filter((a) => a.axis === name && (isOpen(a) || a.shelved || a.suppressed)));
      renew(open, mine, () => (mine.length ? [h("section", { class: "open-alarms" }, h("h2", {}, `Alarms: ${presenceOfAll(mine)}`), h("ul", { class: "alarm-list" }, mine.map(alarmLine)))] : []));
      figureRows(axis, now);
      estimatorPart(axis);
      samplePart(axis);
      baselinePart();
      trends.update(now, axis, more);
    },
    leave: () => { response.leave(); trends.leave(); },
  };
}

/** Two dates, whose figures the next page compares. */
export function compareForm(name, serverNow, a = serverNow() - 86400, b = serverNow()) {
  const [first, second] = [a, b].map((t, i) => h("input", { type: "datetime-local", step: 1, required: true, id: `compare-${i}`, value: toInput(t) }));
  const error = h("p", { class: "error", role: "alert" });
  return h("section", {}, h("h2", {}, "Compare two dates"),
    h("form", {
      class: "range", onsubmit: (event) => {
        event.preventDefault();
        const [x, y] = [fromInput(first.value), fromInput(second.value)];
        if (x === null || y === null || x === y) return say(error, "Two different dates are needed.");
        go(["axis", name, "compare"], { a: x, b: y });
      },
    }, h("label", { for: "compare-0" }, "Then"), first, h("label", { for: "compare-1" }, "and then"), second, h("button", { type: "submit" }, "Compare")), error);
}
