// SPDX-License-Identifier: MIT
// What the interface's names mean to a reader. Pure functions.
import { interval, isNumber, plain, plusMinus, powers, prettyUnit, significant, words } from "./report/format.js";

/** Name, unit, whether a change is told in percent of the baseline, and which of the axis' units it is in. */
const FIGURES = {
  resonance: ["Resonance", "Hz", true], antiresonance: ["Anti-resonance", "Hz", true], stiffness: ["Stiffness", "", true, "stiffness"],
  driven_inertia: ["Motor inertia", "", true, "inertia"], load_inertia: ["Load inertia", "", true, "inertia"], damping: ["Damping", "", true, "damping"],
  coulomb_friction: ["Dry friction", "", true, "torque"], load_torque: ["Load torque", "", false, "torque"], modulus_margin: ["Modulus margin", "", false],
  phase_margin: ["Phase margin", "°", false], gap: ["Gap to baseline", "", false],
};
/** Of a machine that moves along a line. */
const LINEAR = { driven_inertia: "Motor mass", load_inertia: "Load mass", load_torque: "Load force" };
const ORDER = Object.keys(FIGURES);
const SUFFIX = /_(hz|deg|nm_per_rad|nm_rad|kgm2|nms_per_rad|nm)$/;
/** The name of a figure without its unit: alarms ("phase-margin", "phase-margin-limit") and values ("phase_margin_deg") have it in common. */
export const bare = (name) => String(name).replace(/-/g, "_").replace(/_limit$/, "").replace(SUFFIX, "");
/** What an alarm is about, where that is no figure. */
const CONDITIONS = { data: "Samples are missing or faulty", stale: "No samples come", estimate: "Nothing is trusted although the drive is excited", controller: "Another controller runs", disk: "Rows and alarms cannot be stored, or too much is" };
export const conditionOf = (alarm) => CONDITIONS[alarm] ?? null;

/** What is known of a figure of an axis by its name in the interface ("resonance_hz"). */
export function figureOf(name, axis) {
  if (CONDITIONS[name]) return { name, title: CONDITIONS[name], unit: "", relative: false };
  const [title, unit, relative, own] = FIGURES[bare(name)] ?? [words(bare(name)), "", false];
  return { name, title: (axis?.motion === "linear" && LINEAR[bare(name)]) || title, unit: axis?.units?.[own] ?? unit, relative };
}

/** A sentence of the service, which writes in ASCII: "5.1 +- 0.4 kgm2 (1 -> 2)". */
export const sentence = (text) => powers(String(text ?? "")).replaceAll(" -> ", " → ").replace(/ s2\/(?=[a-z])/g, " s²/");

/** What changed and how much, without since when and why. */
export const brief = (text) => sentence(text).replace(/ since \d{4}-.*$/s, "");

/** Figures of an axis in the order in which they are always shown. */
export function orderedFigures(figures) {
  const place = (name) => (ORDER.includes(bare(name)) ? ORDER.indexOf(bare(name)) : ORDER.length);
  return Object.keys(figures ?? {}).sort((a, b) => place(a) - place(b));
}

/** "15.09 ± 0.10 Hz", ± one standard deviation. */
export function valueText(figure, { value, std } = {}) {
  return isNumber(value) ? interval(value, std, figure.unit) : "–";
}

/** A value with its sign and deviation: "+0.12 ± 0.03". */
function signed(value, std, unit) {
  const parts = plusMinus(value, std);
  if (parts.value === "–") return "–";
  const head = value > 0 && !parts.value.startsWith("+") ? "+" + parts.value : parts.value;
  const tail = unit === "%" ? "\u00a0%" : unit ? " " + prettyUnit(unit) : "";
  if (!parts.half) return head + tail;
  const body = `${head} ± ${parts.half}`;
  return (parts.times || unit === "%" ? `(${body})${parts.times ?? ""}` : body) + tail;
}

/** Change against the baseline, in percent where that says more; empty where there is none. */
export function changeText(figure, { change, change_std: std, baseline } = {}) {
  if (!isNumber(change)) return "";
  if (figure.relative && isNumber(baseline) && baseline !== 0) {
    const part = 100 / Math.abs(baseline);
    return signed(change * part, isNumber(std) ? std * part : null, "%");
  }
  return signed(change, std, figure.unit);
}

/** How many standard deviations a change is; 0 where that is not known. */
export function sigmas({ change, change_std: std } = {}) {
  return isNumber(change) && isNumber(std) && std > 0 ? Math.abs(change) / std : 0;
}

export const hasLimit = ({ low, high } = {}) => isNumber(low) || isNumber(high);

/** Whether a value lies beyond its limits, wherever the baseline does. */
export const beyondLimit = ({ value, low, high } = {}) => isNumber(value) && ((isNumber(low) && value < low) || (isNumber(high) && value > high));

/** "136.6 … 150.9 Nm/rad", "at least 0.5"; empty where there is none. */
export function limitsText(figure, { low, high } = {}) {
  const told = [low, high].filter(isNumber).map((x) => plain(x)).join(" … ");
  const side = isNumber(low) && isNumber(high) ? "" : isNumber(low) ? "at least " : "at most ";
  return told && side + told + (figure.unit ? " " + prettyUnit(figure.unit) : "");
}

/** "0.2 s", "12 s", "3 min", "5 h", "2 days". */
export function duration(seconds) {
  if (!isNumber(seconds)) return "–";
  const s = Math.max(0, seconds);
  if (s < 0.0095) return "0.01 s";
  if (s < 9.95) return `${plain(s, s < 1 ? 1 : 2)} s`;
  if (s < 119.5) return `${Math.round(s)} s`;
  if (s < 119.5 * 60) return `${Math.round(s / 60)} min`;
  if (s < 47.5 * 3600) return `${Math.round(s / 3600)} h`;
  return `${Math.round(s / 86400)} days`;
}

/** Latencies: "84 ms", "1.2 s". */
export function latencyText(seconds) {
  if (!isNumber(seconds)) return "–";
  return seconds < 1 ? `${Math.max(1, Math.round(1000 * seconds))} ms` : duration(seconds);
}

const two = (n) => String(n).padStart(2, "0");

/** UNIX seconds in the reader's time zone: "2026-11-29 02:03:04". */
export function moment(seconds, withSeconds = true) {
  if (!isNumber(seconds)) return "–";
  const d = new Date(1000 * seconds);
  const day = `${d.getFullYear()}-${two(d.getMonth() + 1)}-${two(d.getDate())}`;
  return `${day} ${two(d.getHours())}:${two(d.getMinutes())}${withSeconds ? ":" + two(d.getSeconds()) : ""}`;
}

/** The reader's time zone at a time: "+01:00". */
export function zone(seconds) {
  const minutes = -new Date(1000 * seconds).getTimezoneOffset();
  const size = Math.abs(minutes);
  return `${minutes < 0 ? "-" : "+"}${two(Math.floor(size / 60))}:${two(size % 60)}`;
}

/** moment() with its zone: the service's texts may be in another one. */
export const stamp = (seconds) => (isNumber(seconds) ? `${moment(seconds)} ${zone(seconds)}` : "–");

/** The time of the day, with the date where that is not today's. */
export const clock = (seconds, today) => (moment(seconds).slice(0, 10) === moment(today).slice(0, 10) ? moment(seconds).slice(11) : moment(seconds));

/** "Maintenance until 2026-11-29 02:03"; empty where there is none. */
export const maintenanceText = ({ maintenance_until_time_s: until }) => (isNumber(until) ? `Maintenance until ${moment(until, false)}` : "");

/** For <input type="datetime-local">, and back. */
export const toInput = (seconds) => moment(seconds).replace(" ", "T");
export function fromInput(text) {
  const ms = new Date(text).getTime();
  return Number.isFinite(ms) ? ms / 1000 : null;
}

const STATES = {
  waiting: "Waiting for samples", learning: "Learning", following: "Following", stale: "No data", refused: "Refused",
};
export const stateText = (state) => STATES[state] ?? words(state ?? "unknown");

/** What stands in the place of the state of an axis whose figures are not those of now. */
export const staleText = (axis, age) => (axis.state === "refused" ? stateText(axis.state) : isNumber(age) ? `No data for ${duration(age)}` : "No data");

const VERDICTS = {
  trusted: "Trusted", "not-measured": "Nothing measured yet", "not-ready": "Not ready", stopped: "Stopped by a limit", "samples-missing": "Samples missing",
  "not-excited": "Not excited", unphysical: "Not physical", "outside-lines": "Outside the excited lines", "not-converged": "Not converged",
  "residual-grown": "Residual grown",
};
export const verdictText = (verdict) => VERDICTS[verdict] ?? words(verdict ?? "unknown");

/** What each gate asks, and what its failing means. */
export const GATES = {
  ready: ["Ready", "enough samples since the start", "too few samples since the start"],
  complete: ["Complete", "no samples missing lately", "samples are missing"],
  excited: ["Excited", "the drive moves enough to be identified", "the drive does not move enough to be identified"],
  physical: ["Physical", "masses, stiffness and damping are positive", "the estimate is no possible machine"],
  covered: ["Covered", "the resonance lies within the excited frequencies", "the resonance lies outside of the excited frequencies"],
  converged: ["Converged", "the standard deviations are small enough", "the standard deviations are still too large"],
  residual: ["Explained", "the residual is as small as usual", "the residual has grown: the model does not explain the data"],
};

const SEVERITY = { urgent: 4, critical: 4, error: 3, high: 3, warning: 2, medium: 2, info: 1, low: 1 };
/** Higher is worse; numbers (OPC UA: 1 ... 1000) stay. */
export const severityOf = (severity) => (isNumber(severity) ? severity : SEVERITY[String(severity).toLowerCase()] ?? 0);
export const severityText = (severity) => (isNumber(severity) ? `severity ${severity}` : words(severity ?? ""));

/** States of an alarm as words, the most important first. */
export function alarmStates(alarm) {
  const out = [alarm.active ? "active" : "cleared"];
  if (!alarm.acknowledged) out.push("not acknowledged");
  else out.push("acknowledged");
  if (alarm.latched) out.push("latched until reset");
  if (alarm.shelved) {
    const { until_time_s: until, who, reason } = alarm.shelved;
    out.push(`shelved${isNumber(until) ? ` until ${moment(until, false)}` : ""}${who ? ` by ${who}` : ""}${reason ? `: ${reason}` : ""}`);
  }
  if (alarm.suppressed) out.push(`suppressed: ${words(alarm.suppressed).toLowerCase()}`);
  return out;
}

/** Whether the alarm's cause is there now, before anything else is read: "Active now", "Over since 10:15:04". */
export const presence = (alarm, today) => (alarm.active ? "Active now" : isNumber(alarm.cleared_time_s) ? `Over since ${clock(alarm.cleared_time_s, today)}` : "Over");

/** The same for several alarms: "1 active now, 2 over but not acknowledged". */
export function presenceOfAll(alarms) {
  const parts = [[alarms.filter((a) => a.active).length, "active now"], [alarms.filter((a) => !a.active && !a.acknowledged).length, "over but not acknowledged"],
    [alarms.filter((a) => !a.active && a.acknowledged).length, "over and acknowledged"]];
  return parts.filter(([n]) => n > 0).map(([n, text]) => `${count(n)} ${text}`).join(", ");
}

/** What stands in the place of the state of an axis whose worst alarm this is; where only the axis told of it, it is taken for active. */
export const alarmText = ({ active }, unacknowledged) => (active === false ? (unacknowledged ? "Alarm over, not acknowledged" : "Alarm over, acknowledged") : unacknowledged ? "Alarm" : "Alarm, acknowledged");

/** An alarm that asks a person for something. */
export const isOpen = (alarm) => !alarm.shelved && !alarm.suppressed && (alarm.active || !alarm.acknowledged || alarm.latched === true);

/** "from 143.7 to 136.4 Nm/rad, by −7.3 ± 0.8 Nm/rad (−5.1 %), 9.1 standard deviations". */
export function alarmChange(alarm, axis) {
  const c = alarm.change;
  if (!c || !isNumber(c.size)) return "";
  const { unit } = figureOf(alarm.alarm, axis);
  const parts = [];
  if (isNumber(c.before) && isNumber(c.after)) {
    const tail = unit ? " " + prettyUnit(unit) : "";
    parts.push(`from ${interval(c.before, c.std)}${tail} to ${interval(c.after, c.std)}${tail}`);
  }
  const share = isNumber(c.relative) ? ` (${c.relative > 0 ? "+" : ""}${plain(100 * c.relative, 3)}\u00a0%)` : "";
  parts.push(`by ${signed(c.size, c.std, unit)}${share}`);
  if (isNumber(c.sigma)) parts.push(`${significant(Math.abs(c.sigma), 2)} standard deviations`);
  return parts.join(", ");
}

export const bytesText = (bytes) => {
  if (!isNumber(bytes)) return "–";
  const step = [[1e12, "TB"], [1e9, "GB"], [1e6, "MB"], [1e3, "kB"]].find(([size]) => bytes >= size);
  return step ? `${plain(bytes / step[0], 3)} ${step[1]}` : `${bytes} B`;
};

/** 1234567 -> "1 234 567". */
export const count = (n) => (isNumber(n) ? String(Math.round(n)).replace(/\B(?=(\d{3})+$)/g, "\u202f") : "–");

export const plural = (n, one, many = one + "s") => `${count(n)} ${n === 1 ? one : many}`;
