// SPDX-License-Identifier: MIT
// Alarms as a list, and one alarm with all that is known of it.
import { list, words } from "./report/format.js";
import { alarmButtons } from "./actions.js";
import { fileLink, get, part } from "./api.js";
import { grid, h, renew, say, sign } from "./dom.js";
import { go, link } from "./route.js";
import { alarmChange, alarmStates, bare, brief, conditionOf, figureOf, isOpen, plural, presence, sentence, severityOf, severityText, stamp } from "./words.js";

const STATES = {
  open: ["Open", isOpen], unacknowledged: ["Not acknowledged", (a) => !a.acknowledged && !a.shelved && !a.suppressed], shelved: ["Shelved", (a) => Boolean(a.shelved)],
  suppressed: ["Suppressed", (a) => Boolean(a.suppressed)], all: ["All", () => true],
};
const MOST = 500;
/** After an answer that failed. */
const AGAIN_MS = 5000;

const signOf = (a) => (a.shelved || a.suppressed ? "off" : a.active ? (a.acknowledged ? "warning" : "bad") : a.acknowledged && !a.latched ? "good" : "over");

/** Open first, then those not acknowledged, those active, by severity, the newest. */
export const worstAlarms = (alarms) => [...alarms].sort((a, b) => isOpen(b) - isOpen(a) || a.acknowledged - b.acknowledged || b.active - a.active ||
  severityOf(b.severity) - severityOf(a.severity) || (b.raised_time_s ?? 0) - (a.raised_time_s ?? 0));

/** An alarm of the installation belongs to no axis. */
const axisLink = (alarm) => (alarm.axis ? h("a", { href: link(["axis", alarm.axis]) }, alarm.axis) : "Installation");

/** One alarm as an item of a list, with what can be done. */
export function alarmLine(alarm) {
  return h("li", { class: `alarm ${signOf(alarm)}`, "data-alarm": alarm.id },
    sign(signOf(alarm)),
    h("div", {}, h("p", { class: "what" }, h("b", { class: `presence ${alarm.active ? "now" : ""}` }, presence(alarm, Date.now() / 1000)), " ", axisLink(alarm), ": ", h("a", { href: link(["alarm", alarm.id]), "data-focus": `open-${alarm.id}` }, sentence(alarm.text))),
      h("p", { class: "small soft" }, `${severityText(alarm.severity)}; ${alarmStates(alarm).join(", ")}; raised ${stamp(alarm.raised_time_s)}`)),
    scoped(alarmButtons(alarm), alarm.id));
}

/** Buttons of several alarms keep the focus by the alarm, too. */
function scoped(box, id) {
  for (const button of box.querySelectorAll("[data-focus]")) button.dataset.focus += `-${id}`;
  return box;
}

export function alarmsView(main, { alarms, listing, query, reloadAlarms }) {
  const stateOf = ({ state }) => (Object.hasOwn(STATES, state ?? "") ? state : "open");
  let show = stateOf(query);
  let axis = query.axis ?? "";
  const filters = Object.entries(STATES).map(([id, [title]]) => {
    const number = h("b", {});
    return { id, number, button: h("button", { type: "button", onclick: () => go(["alarms"], { state: id === "open" ? "" : id, axis }) }, title, " ", number) };
  });
  const search = h("input", { type: "search", id: "search", value: axis, autocomplete: "off", oninput: () => go(["alarms"], { state: show === "open" ? "" : show, axis: search.value.trim() }, { replace: true }) });
  const hits = h("p", { class: "small hits", role: "status" });
  const problem = h("p", { class: "error", role: "alert" });
  const items = h("ul", { class: "alarm-list" });
  main.append(h("h1", {}, "Alarms"), h("div", { class: "tools", role: "search" }, h("label", { for: "search" }, "Axis"), search, h("div", { class: "chips", role: "group", "aria-label": "State" }, filters.map((f) => f.button))), problem, hits, items);
  reloadAlarms();
  const mine = () => [...alarms.values()].filter((a) => (a.axis ?? "installation").toLowerCase().includes(axis.toLowerCase()));
  const view = {
    title: "Alarms", nav: "alarms", shortcut: () => search.focus(),
    query: (next) => { show = stateOf(next); axis = next.axis ?? ""; if (document.activeElement !== search) search.value = axis; view.update(); return true; },
    update: () => {
      const some = worstAlarms(mine().filter(STATES[show][1])).slice(0, MOST);
      renew(items, some, () => some.map(alarmLine));
      say(problem, listing.problem && `The alarms could not be loaded: ${listing.problem}`);
      say(hits, some.length === 0 && !listing.complete ? (listing.problem ? "" : "Loading …") : some.length === 0 ? (show === "open" ? "No alarm is open." : "None.") : some.length === MOST ? `The first ${MOST}` : plural(some.length, "alarm"));
      for (const { id, number, button } of filters) {
        say(number, String(mine().filter(STATES[id][1]).length));
        button.setAttribute("aria-pressed", String(id === show));
      }
    },
  };
  view.update();
  return view;
}

const TRANSITIONS = { latched: "Latched: waits for a person", realarmed: "Raised again: still active", "shelving-expired": "Shelving ended", unsuppressed: "No longer suppressed" };

export function alarmView(main, { fleet, alarms, path }) {
  const id = path[1];
  // Written anew, it keeps the focus from which a new page is read.
  const title = (text) => h("h1", { tabindex: -1, "data-focus": "title" }, text);
  const head = h("div", {}, title("Alarm"));
  const facts = h("section", {}, h("h2", {}, "What is known"), h("div", {}));
  const events = h("section", {}, h("h2", {}, "Events"), h("p", { class: "explain" }, "What happened to this alarm, and who did what."), h("div", {}));
  const problem = h("p", { class: "error", role: "alert" });
  main.append(h("p", { class: "crumb" }, h("a", { href: link(["alarms"]) }, "← Alarms")), head, problem, facts, events);
  let state = "";
  let asked = 0;
  let again = Infinity;
  const loadEvents = async () => {
    const mine = ++asked;
    again = Infinity;
    try {
      const told = list((await get(`alarms/${part(id)}/events`)).events);
      if (mine !== asked) return;
      events.lastElementChild.replaceChildren(grid(["Time", "What", "By", "Reason", "Text"], told.map((e) => [stamp(e.time_s), TRANSITIONS[e.transition] ?? words(e.transition ?? ""), e.who ?? "–", e.reason ?? "", sentence(e.text)]), { caption: "Events of the alarm", className: "plain" }));
    } catch (error) {
      if (mine !== asked) return;
      again = performance.now() + AGAIN_MS;
      events.lastElementChild.replaceChildren(h("p", { class: "error" }, `Events could not be loaded: ${error.message}`));
    }
  };
  /** One that is over for longer than the list goes back. */
  let old = null;
  let retry = Infinity;
  const load = async () => {
    retry = Infinity;
    try {
      old = await get(`alarms/${part(id)}`);
    } catch (error) {
      const none = [400, 404].includes(error.status);
      if (!none) retry = performance.now() + AGAIN_MS;
      if (!alarms.has(id)) say(problem, none ? `There is no alarm ${id}.` : `The alarm could not be loaded: ${error.message}`);
    }
  };
  if (!alarms.has(id)) load();
  const view = {
    title: "Alarm", nav: "alarms",
    update: (now) => {
      if (now > again) loadEvents();
      const alarm = alarms.get(id) ?? old;
      if (!alarm && now > retry) load();
      if (!alarm) return;
      const axis = fleet.axes.get(alarm.axis);
      const key = JSON.stringify([alarm, axis?.motion, axis?.units]);
      if (key === state) return;
      state = key;
      say(problem, "");
      const text = brief(alarm.text);
      view.title = `${alarm.axis ?? "Installation"}: ${text}`;
      loadEvents();
      renew(head, alarm, () => [h("div", { class: "head" }, h("div", {}, title(text), h("p", { class: "meta" }, axisLink(alarm), `, ${severityText(alarm.severity)}`)),
        h("div", { class: `verdict ${{ bad: "bad", warning: "warning", over: "warning", good: "good", off: "none" }[signOf(alarm)]}` }, sign(signOf(alarm)), h("div", {}, h("b", {}, alarm.active ? "Active" : "Cleared"), h("span", {}, alarmStates(alarm).slice(1).join(", "))))),
      alarmButtons(alarm, loadEvents)]);
      const figure = figureOf(alarm.alarm, axis);
      const [, guess, cause] = /^(?:(likely|possible) cause: )?(?:cause unknown)?(.*)$/s.exec(sentence(alarm.cause));
      const rows = [
        ["Change", alarmChange(alarm, axis) || "–"], [guess === "possible" ? "Possible cause" : "Likely cause", cause || "not known"], [conditionOf(alarm.alarm) ? "Condition" : "Figure", figure.title], ["Since", stamp(alarm.since_time_s)], ["Raised", stamp(alarm.raised_time_s)],
        alarm.cleared_time_s ? ["Cleared", stamp(alarm.cleared_time_s)] : null,
        alarm.shelved ? ["Shelved", `until ${stamp(alarm.shelved.until_time_s)} by ${alarm.shelved.who ?? "?"}: ${alarm.shelved.reason ?? ""}`] : null,
        alarm.suppressed ? ["Suppressed by", words(alarm.suppressed)] : null,
      ].filter(Boolean);
      const around = alarm.since_time_s ?? alarm.raised_time_s;
      renew(facts.lastElementChild, [rows, alarm.evidence], () => [grid(["Of the alarm", "Value"], rows, { caption: "What is known of the alarm", className: "facts" }),
        h("ul", { class: "links" },
          alarm.axis ? h("li", {}, h("a", { href: link(["axis", alarm.axis], { from: around - 1800, to: (alarm.cleared_time_s ?? alarm.raised_time_s) + 1800, f: bare(alarm.alarm) }) }, "Trend around it")) : null,
          alarm.evidence ? h("li", {}, fileLink(`alarms/${part(id)}/evidence.csv`, "Evidence: raw samples as CSV", { download: `${id}.csv` })) : null,
          alarm.evidence ? h("li", {}, fileLink(`alarms/${part(id)}/report.html`, "Evidence: report of identify")) : alarm.axis ? h("li", { class: "soft" }, "No raw samples around it are kept.") : null)]);
    },
  };
  view.update();
  return view;
}
