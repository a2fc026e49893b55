// SPDX-License-Identifier: MIT
// Starts the page: one stream, one clock of drawing, and the view that the URL names.
import { list } from "./report/format.js";
import { watchLayout } from "./report/plot.js";
import { alarmView, alarmsView } from "./alarms.js";
import { get, part, readToken, streamsAreFull } from "./api.js";
import { axisView } from "./axis.js";
import { compareView } from "./compare.js";
import { h, say } from "./dom.js";
import { fleetView } from "./fleet.js";
import { Fleet, summary, troublesOf } from "./model.js";
import { parse } from "./route.js";
import { statusView } from "./status.js";
import { Stream } from "./stream.js";
import { drawTop } from "./top.js";
import { isOpen, plural, sentence } from "./words.js";

/** All axes are asked for anew this often: what a frame left out, and the clock's difference. */
const RESYNC_MS = 60000;
/** Instead of a stream, where too many are open, and where an answer failed. */
const POLL_MS = 4000;
/** The service is asked how it is. */
const SERVICE_MS = 10000;
/** Texts and curves change no more often; nobody reads faster. */
const TICK_MS = 100;
/** One answer has no more alarms. */
const MOST_ALARMS = 1000;
/** New alarms within this time are told together. */
const GATHER_MS = 1500;

const main = document.getElementById("content");
const fleet = new Fleet();
const alarms = new Map();
/** Whether all alarms were told once, and why not the last time; empty: they were. */
const listing = { complete: false, problem: "", running: 0 };
const unixNow = () => Date.now() / 1000;
const serverNow = () => unixNow() + fleet.offset.s;
let view = null;
let shownPath = "";
/** Where the focus was on a page that may be come back to. */
const places = new Map();

let syncing = false;
async function resync() {
  if (syncing) return;
  syncing = true;
  const asked = unixNow();
  try {
    const answer = await get("axes");
    fleet.calibrate(answer.time_s, asked, unixNow());
    fleet.replace(list(answer.axes), performance.now());
    fleet.problem = "";
  } catch (error) {
    console.warn("axes:", error.message);
    fleet.problem = error.message;
  } finally {
    syncing = false;
  }
  view?.update(performance.now(), true);
  showTitle();
}

/** The newest ones, and all that are open, however old. What is in neither has been over for long. */
async function reloadAlarms() {
  const before = new Map(alarms);
  listing.running += 1;
  try {
    const answers = await Promise.all(["", "state=open&"].map((which) => get(`alarms?${which}limit=${MOST_ALARMS}`)));
    const [newest, open] = answers.map((answer) => list(answer.alarms));
    // What the stream told meanwhile is newer.
    const asItWas = (id) => alarms.get(id) === before.get(id);
    const told = new Map([...newest, ...open].map((alarm) => [String(alarm.id), alarm]));
    if (open.length < MOST_ALARMS) for (const id of before.keys()) if (!told.has(id) && asItWas(id)) alarms.delete(id);
    for (const [id, alarm] of told) if (asItWas(id)) alarms.set(id, alarm);
    listing.complete = true;
    listing.problem = "";
  } catch (error) {
    console.warn("alarms:", error.message);
    listing.problem = error.message;
  } finally {
    listing.running -= 1;
  }
}

/** A page may be open for weeks: alarms that are over go, the oldest first. */
function forget() {
  const over = [...alarms].filter(([, a]) => !a.active && a.acknowledged && !a.latched && !a.shelved);
  over.sort(([, a], [, b]) => (a.raised_time_s ?? 0) - (b.raised_time_s ?? 0));
  for (const [id] of over.slice(0, alarms.size - MOST_ALARMS)) alarms.delete(id);
}

let troubles = troublesOf({});
async function askService() {
  try {
    const before = troubles.store;
    troubles = troublesOf(await get("status"));
    if (troubles.store !== before) say(document.getElementById("announce"), troubles.store || "Everything is stored again");
  } catch (error) {
    console.warn("status:", error.message);
  }
}

const fresh = [];
let telling = 0;
const tellNew = () => {
  telling = 0;
  const newest = fresh[fresh.length - 1];
  if (!newest) return;
  const of = newest.axis ?? "the installation";
  say(document.getElementById("announce"), fresh.length === 1 ? `New alarm on ${of}: ${sentence(newest.text)}` : `${plural(fresh.length, "new alarm")}, the newest on ${of}: ${sentence(newest.text)}`);
  fresh.length = 0;
};

function alarmEvent(alarm) {
  const old = alarms.get(String(alarm.id));
  alarms.set(String(alarm.id), alarm);
  if (alarms.size > 2 * MOST_ALARMS) forget();
  showTitle();
  if (!alarm.axis) askService(); // of the installation: what it is about stands in the header
  if (alarm.active && isOpen(alarm) && !alarm.acknowledged && !(old?.active && !old.acknowledged)) {
    fresh.push(alarm);
    if (!telling) telling = setTimeout(tellNew, GATHER_MS);
  }
}

const stream = new Stream({
  hello: ({ resumed }) => { if (!resumed) reloadAlarms(); },
  frame: (frame) => {
    fleet.frame(frame, performance.now(), unixNow());
    showTitle();
  },
  alarm: alarmEvent,
  axis: (status) => fleet.merge(status.name, status, performance.now()),
  refused: async () => {
    resync(); // which asks for a token, if that is why
    // An axis that is not there has none: the others have.
    const { axis } = stream;
    if (axis && (await get(`axes/${part(axis)}`).catch((error) => error)).status === 404 && axis === stream.axis) return stream.follow(null);
    const full = await streamsAreFull() && stream.state === "broken";
    if (full && !stream.full) say(document.getElementById("announce"), "Too many pages are open: no live data here");
    if (full) reloadAlarms();
    stream.full = full;
  },
  response: (event) => view?.stream?.response(event),
  state: (state) => {
    if (state === "open" && fleet.server.told_at !== null) resync();
    say(document.getElementById("announce"), state === "broken" ? "Connection lost, trying again" : state === "open" ? "Connected" : "");
    document.body.dataset.connection = state;
  },
}, readToken);

const VIEWS = { "": fleetView, axis: axisView, alarms: alarmsView, alarm: alarmView, status: statusView };
const top = drawTop(document.getElementById("top"));

function notFound(root) {
  root.append(h("h1", {}, "Not found"), h("p", {}, h("a", { href: "#/" }, "To the fleet")));
  return { title: "Not found", nav: "", update: () => {} };
}

function route() {
  const { path, query } = parse(location.hash);
  const key = path.join("/");
  if (view && key === shownPath && view.query?.(query, path)) return;
  if (view) {
    if (view.remember) places.set(shownPath, view.remember());
    view.leave?.();
  }
  const first = view === null;
  const named = Object.hasOwn(VIEWS, path[0] ?? "") ? VIEWS[path[0] ?? ""] : notFound;
  const build = path[0] === "axis" ? (path[2] === "compare" ? compareView : path[1] ? axisView : notFound) : named;
  main.replaceChildren();
  shownPath = key;
  view = build(main, { fleet, alarms, listing, path, query, serverNow, reloadAlarms });
  stream.follow(view.axis ?? null);
  top.current(view.nav);
  view.update(performance.now(), true);
  scrollTo(0, 0);
  // A new page is read from its heading; on the way back the focus returns to where it was.
  if (!first && !view.restore?.(places.get(key))) {
    const title = main.querySelector("h1");
    title.tabIndex = -1;
    title.focus({ preventScroll: true });
  }
}

addEventListener("hashchange", route);
addEventListener("keydown", (event) => {
  if (event.key !== "/" || event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, textarea, select, dialog")) return;
  event.preventDefault();
  if (view.shortcut) view.shortcut();
  else location.hash = "#/";
});

// A hash of its own would lead to another view.
document.querySelector(".skip").addEventListener("click", (event) => {
  event.preventDefault();
  main.focus();
});

/** Also in a background tab, where nothing is drawn. */
function showTitle() {
  const open = summary([...fleet.axes.values()], alarms, performance.now()).unacknowledged;
  const text = `${open ? `(${open}) ` : ""}${view?.title ?? ""} – resonid`;
  if (document.title !== text) document.title = text;
}

let ticked = -Infinity;
function tick(now) {
  requestAnimationFrame(tick);
  if (now - ticked < TICK_MS) return;
  ticked = now;
  top.update({ fleet, alarms, listing, stream, now: performance.now(), axis: view?.axis, troubles });
  view?.update(performance.now());
  showTitle();
}

watchLayout(main);
resync();
setInterval(resync, RESYNC_MS);
setInterval(() => {
  if (stream.full || fleet.problem) resync();
  if (listing.problem && !listing.running) reloadAlarms();
}, POLL_MS);
askService();
setInterval(askService, SERVICE_MS);
route();
requestAnimationFrame(tick);
