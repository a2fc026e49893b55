// SPDX-License-Identifier: MIT
// What the page knows of the fleet, from the interface's answers and frames. Pure functions and one class without a clock of its own.
import { isNumber, list, words } from "./report/format.js";
import { bare, isOpen, severityOf, sigmas } from "./words.js";

/** From a server that says nothing for so long nobody knows what is now, whatever it last said of an axis. */
const SILENT_MS = 5000;

/** Figures that are older than the newest samples by more than this are not those of now. */
const OLD_S = 5;

/** What a status lacks that has none. */
const NOTHING = { why: "", time_s: null, age_s: null, latency_s: null, maintenance_until_time_s: null, worst_alarm: null };
const NO_FIGURE = { value: null, std: null, change: null, change_std: null };
/** What a figure lacks besides, where a whole status does: a baseline that was forgotten, limits that were taken away. */
const NO_BASELINE = { baseline: null, low: null, high: null };

export class Fleet {
  axes = new Map();
  /** performance.now() of what the server last told of any axis; every axis refers to it. */
  server = { told_at: null };
  /** Server's UNIX time less the browser's, and half the time that a question took: how well it is known. */
  offset = { s: 0, half: Infinity };
  /** Why the axes could not be had the last time; empty: they could. */
  problem = "";

  /** All axes, as /api/v1/axes tells them; those that it lacks are gone. */
  replace(list, now) {
    const names = new Set(list.map((a) => a.name));
    for (const name of this.axes.keys()) if (!names.has(name)) this.axes.delete(name);
    this.server.told_at = now;
    for (const axis of list) this.merge(axis.name, axis, now);
  }

  /** A frame tells of some axes what changes; what hardly does (baseline, limits, counters) stays as it was. */
  frame({ time_s: time, axes }, now, unixNow) {
    const transit = isNumber(time) && Number.isFinite(this.offset.half) ? Math.max(0, unixNow + this.offset.s - time) : 0;
    for (const [name, status] of Object.entries(axes ?? {})) {
      const before = this.axes.get(name)?.sample;
      this.merge(name, status, now);
      // From the newest sample to this page: what the service needed, how long it waited for a frame, and the way here.
      const served = Math.max(status.latency_s ?? 0, status.age_s ?? 0);
      if (status.sample !== before && served > 0) this.axes.get(name).seen_latency_s = served + transit;
    }
  }

  merge(name, status, now) {
    let axis = this.axes.get(name);
    if (!axis) this.axes.set(name, axis = { server: this.server, told_at: now, figures: {} });
    this.server.told_at = now;
    const { figures } = axis;
    // Frames tell neither motion nor units.
    for (const key in figures) Object.assign(figures[key], NO_FIGURE, status.motion ? NO_BASELINE : null);
    for (const key in status.figures) figures[key] = Object.assign(figures[key] ?? {}, status.figures[key]);
    Object.assign(axis, NOTHING, status, { name, figures });
    if (isNumber(status.age_s)) axis.told_at = now;
    return axis;
  }

  /** The clock's difference by a question asked at `asked` and answered at `answered` (both UNIX, the browser's). */
  calibrate(time, asked, answered) {
    if (!isNumber(time)) return;
    const half = (answered - asked) / 2;
    const s = time - (asked + answered) / 2;
    // Clocks drift and are set: what contradicts the best answer so far takes its place.
    if (half <= this.offset.half * 1.5 || Math.abs(s - this.offset.s) > half + this.offset.half) this.offset = { s, half };
  }

  /** When the machine was as an axis' figures, or what it told of another time, say; null where that is now, or not known. */
  asOf(axis, now, serverNow, time = axis.time_s) {
    if (!isNumber(time)) return null;
    const lag = Number.isFinite(this.offset.half) ? serverNow - (ageOf(axis, now) ?? 0) - time : 0;
    return lag > OLD_S || isLearning(axis) || isStale(axis, now) ? time : null;
  }
}

/** Seconds since the newest sample of an axis. */
export const ageOf = (axis, now) => (isNumber(axis.age_s) ? axis.age_s + Math.max(0, now - axis.told_at) / 1000 : null);

/** Learns, or waits to: figures that it may still tell are those of before. */
export const isLearning = ({ state }) => state === "waiting" || state === "learning";

/** Whether the server says nothing of any axis. */
export const isSilent = ({ server }, now) => now - server.told_at > SILENT_MS;

/** How old samples may be is the server's to say, which knows when they are due. */
export const isStale = (axis, now) => axis.state === "stale" || axis.state === "refused" || (axis.state !== "waiting" && isSilent(axis, now));

/** Seconds from the newest sample to this page, or to its estimate; null where the sender's clock is ahead, so that nobody knows. */
export const latencyOf = (axis) => axis.seen_latency_s ?? (axis.latency_s > 0 ? axis.latency_s : null);

/** Why an axis stands where it does in the list: 4 unacknowledged alarm, 3 alarm, 2 not trusted, 1 no data, 0 well. */
export function groupOf(axis, now) {
  if (axis.unacknowledged > 0) return 4;
  if (axis.alarms > 0) return 3;
  if (isStale(axis, now) || axis.state === "waiting") return 1;
  return axis.trusted ? 0 : 2;
}

/** Open alarms of each axis, the worst first, those that are active before those that are over; of equals the one that came first, which the
 *  others follow from more often than not. */
export function alarmsOfAxes(alarms) {
  const all = new Map();
  for (const alarm of alarms.values()) {
    if (!alarm.axis || !isOpen(alarm)) continue;
    if (!all.has(alarm.axis)) all.set(alarm.axis, []);
    all.get(alarm.axis).push(alarm);
  }
  for (const some of all.values()) {
    some.sort((a, b) => b.active - a.active || a.acknowledged - b.acknowledged || severityOf(b.severity) - severityOf(a.severity) || (a.raised_time_s ?? 0) - (b.raised_time_s ?? 0));
  }
  return all;
}

/** Whether one of these alarms is about the figure. */
export const isAlarmed = (open, figure) => (open ?? []).some((a) => a.active && bare(a.alarm) === bare(figure));

/** Worst first: group, severity, name; no figure, whose noise would move rows about. */
export function worstFirst(axes, now) {
  const keyed = axes.map((axis) => ({
    axis, group: groupOf(axis, now), severity: severityOf(axis.worst_alarm?.severity),
  }));
  keyed.sort((a, b) => b.group - a.group || b.severity - a.severity ||
    a.axis.name.localeCompare(b.axis.name, "en", { numeric: true }));
  return keyed.map((k) => k.axis);
}

export const FILTERS = {
  all: ["All", () => true], alarms: ["With alarms", (a) => a.alarms > 0 || a.unacknowledged > 0],
  untrusted: ["Not trusted", (a, now) => !a.trusted && !isStale(a, now)], stale: ["No data", isStale],
  maintenance: ["In maintenance", (a) => isNumber(a.maintenance_until_time_s)],
};

export function matches(axis, { q = "", show = "all" }, now) {
  if (!(FILTERS[show] ?? FILTERS.all)[1](axis, now)) return false;
  const text = `${axis.name} ${axis.why ?? ""} ${axis.worst_alarm?.text ?? ""} ${axis.source ?? ""} ${axis.verdict ?? ""}`.toLowerCase();
  return q.toLowerCase().split(/\s+/).every((word) => text.includes(word));
}

/** The figure that changed most, by standard deviations. */
export function mostChanged(figures) {
  let best = null;
  for (const [name, figure] of Object.entries(figures ?? {})) {
    const s = sigmas(figure);
    if (s > 0 && (!best || s > best.sigmas)) best = { name, figure, sigmas: s };
  }
  return best;
}

/** What of the service itself asks for somebody: the store, or empty, and its sources. */
export const troublesOf = ({ store, sources }) => ({
  store: store?.disk_full ? "Disk full: nothing is stored" : store?.failing ? "Nothing can be stored" : store?.over_limit ? "More is stored than may be" : "",
  lost: Boolean(store?.disk_full || store?.failing),
  sources: list(sources).filter((s) => !["starting", "running", "ended"].includes(s.state)).map((s) => `Source ${s.name} ${words(s.state ?? "").toLowerCase()}`),
});

/** For the header: the youngest data and the longest way of those that deliver, open alarms (also of the installation), and axes without data. */
export function summary(axes, alarms, now) {
  const out = { axes: axes.length, stale: 0, alarms: 0, unacknowledged: 0, age: null, latency: null };
  for (const alarm of alarms.values()) {
    if (alarm.axis || !isOpen(alarm)) continue; // those of an axis it counts itself
    out.alarms += 1;
    out.unacknowledged += alarm.acknowledged ? 0 : 1;
  }
  for (const axis of axes) {
    out.alarms += axis.alarms ?? 0;
    out.unacknowledged += axis.unacknowledged ?? 0;
    const age = ageOf(axis, now);
    if (isStale(axis, now)) out.stale += 1;
    else if (isNumber(axis.seen_latency_s)) out.latency = Math.max(out.latency ?? 0, axis.seen_latency_s);
    if (age !== null && (out.age === null || age < out.age)) out.age = age;
  }
  return out;
}
