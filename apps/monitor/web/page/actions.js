// SPDX-License-Identifier: MIT
// What a person can do to an alarm or an axis. Each asks who and why, tells what was done, and calls `done`.
import { part, post } from "./api.js";
import { askPerson, DURATIONS, notice } from "./dialogs.js";
import { h } from "./dom.js";
import { sentence } from "./words.js";

const ALARM = {
  acknowledge: { title: "Acknowledge the alarm", text: "You have seen it. It stays active until its cause is gone.", button: "Acknowledge", did: "Acknowledged", optional: true },
  shelve: {
    title: "Shelve the alarm", text: "It is out of the way until the end of the time, or until it is unshelved.", button: "Shelve", did: "Shelved",
    fields: [{ name: "seconds", label: "For", kind: "select", options: DURATIONS }],
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
    fields: [{ name: "seconds", label: "For", kind: "select", options: DURATIONS }],
  },
};
const END_MAINTENANCE = { title: "End the maintenance", text: "Alarms of this axis are told again.", button: "End maintenance", did: "Maintenance ended", optional: true };

async function perform(action, path, name, of, done = () => {}) {
  const result = await askPerson({
    ...action, title: `${action.title}: ${of}`,
    run: ({ who, reason, seconds }) => post(`${path}/${name}`, { who, ...(reason ? { reason } : {}), ...(seconds ? { seconds: Number(seconds) } : {}) }),
  });
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
  names.push(alarm.shelved ? "unshelve" : "shelve");
  if (alarm.latched && !alarm.active) names.push("reset");
  return h("div", { class: "buttons" }, buttons(ALARM, names, `alarms/${part(alarm.id)}`, sentence(alarm.text), done));
}

/** The stream tells what becomes of it. */
export const endMaintenanceButton = (name) => buttons({ "end-maintenance": END_MAINTENANCE }, ["end-maintenance"], `axes/${part(name)}`, name)[0];

export function axisButtons(name, done) {
  return h("div", { class: "buttons" }, buttons(AXIS, Object.keys(AXIS), `axes/${part(name)}`, name, done));
}
