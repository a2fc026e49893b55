// SPDX-License-Identifier: MIT
// What a person can do to an alarm or an axis. Each asks who and why, tells what was done, and calls `done`.
import { get, part, post } from "./api.js";
import { askPerson, durations, notice } from "./dialogs.js";
import { h } from "./dom.js";
import { sentence } from "./words.js";

/** A server that does not tell by then says in its answer what is too long. */
const TELL_MS = 2000;

const timeField = (longest) => ({ name: "seconds", label: "For", kind: "select", options: durations(longest) });

/** For how long the alarm of a path can be shelved; undefined where that is not known. */
async function longestShelving(path) {
  try {
    return (await get(path, AbortSignal.timeout(TELL_MS))).longest_shelving_s;
  } catch {
    return undefined;
  }
}

const ALARM = {
  acknowledge: { title: "Acknowledge the alarm", text: "You have seen it. It stays active until its cause is gone.", button: "Acknowledge", did: "Acknowledged", optional: true },
  shelve: {
    title: "Shelve the alarm", text: "It is out of the way until the end of the time, or until it is unshelved.", button: "Shelve", did: "Shelved",
    fields: async (path) => [timeField(await longestShelving(path))],
  },
  unshelve: { title: "Unshelve the alarm", button: "Unshelve", did: "Unshelved", optional: true },
  reset: { title: "Reset the latched alarm", text: "It cleared by itself and waits for a person.", button: "Reset", did: "Reset", optional: true },
};
const AXIS = {
  baseline: {
    title: "Set the baseline", text: "Changes are told against the figures of now. The old baseline stays in the list.", button: "Set baseline", did: "Baseline set",
  },
  relearn: {
    title: "Learn anew", text: "The estimator forgets what it knows and learns the axis from the start; until then no alarm of its figures comes.", button: "Learn anew", did: "Learning anew",
  },
  maintenance: {
    title: "Maintenance", text: "Alarms of this axis are suppressed for the time given.", button: "Begin maintenance", did: "Maintenance begun",
    fields: () => [timeField()],
  },
};
const END_MAINTENANCE = { title: "End the maintenance", text: "Alarms of this axis are told again.", button: "End maintenance", did: "Maintenance ended", optional: true };

/** A question is open, or about to be: a second press asks no second one. */
let asked = false;

async function perform(action, path, name, of, done = () => {}) {
  if (asked) return;
  asked = true;
  const result = await askPerson({
    ...action, fields: await action.fields?.(path), title: `${action.title}: ${of}`,
    run: ({ who, reason, seconds }) => post(`${path}/${name}`, { who, ...(reason ? { reason } : {}), ...(seconds ? { seconds: Number(seconds) } : {}) }),
  }).finally(() => { asked = false; });
  if (result === null) return;
  notice(`${action.did}: ${of}`);
  done(result);
}

function buttons(actions, names, path, of, done) {
  return names.map((name) => h("button", { type: "button", "data-focus": `do-${name}`, onclick: () => perform(actions[name], path, name, of, done) }, actions[name].button));
}

/** Buttons for what an alarm's state allows. One of the installation goes by itself. */
export function alarmButtons(alarm, done) {
  if (!alarm.axis) return h("div", { class: "buttons" });
  const names = [];
  if (!alarm.acknowledged) names.push("acknowledge");
  if (alarm.shelved) names.push("unshelve");
  else if (alarm.active || !alarm.acknowledged || alarm.latched) names.push("shelve");
  if (alarm.latched && !alarm.active && alarm.acknowledged) names.push("reset");
  return h("div", { class: "buttons" }, buttons(ALARM, names, `alarms/${part(alarm.id)}`, sentence(alarm.text), done));
}

/** The stream tells what becomes of it. */
export const endMaintenanceButton = (name) => buttons({ "end-maintenance": END_MAINTENANCE }, ["end-maintenance"], `axes/${part(name)}`, name)[0];

export function axisButtons(name, done) {
  return h("div", { class: "buttons" }, buttons(AXIS, Object.keys(AXIS), `axes/${part(name)}`, name, done));
}
