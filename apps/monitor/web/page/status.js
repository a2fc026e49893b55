// SPDX-License-Identifier: MIT
// The installation: sources and what they promise, store, threshold, version.
import { isNumber, list, words } from "./report/format.js";
import { get } from "./api.js";
import { grid, h, renew, say } from "./dom.js";
import { bytesText, count, duration, plural, sentence, stamp } from "./words.js";

const EVERY_MS = 3000;

export function statusView(main) {
  const problem = h("p", { class: "error", role: "alert" });
  const [about, sources, deliveries, store, audit] = ["Service", "Sources", "Alarms told", "Store and threshold", "Audit trail"].map((title) => h("section", {}, h("h2", {}, title), h("div", {})));
  main.append(h("h1", {}, "Status"), problem, about, sources, deliveries, store, audit);
  let asked = -Infinity;
  const load = async () => {
    asked = performance.now();
    try {
      const [s, trail] = await Promise.all([get("status"), get("audit?limit=50").catch((error) => ({ problem: error.message }))]);
      say(problem, trail.problem ? `The audit trail could not be loaded: ${trail.problem}` : "");
      const put = (box, rows, caption) => renew(box.lastElementChild, rows, () => [grid(["What", "Value"], rows, { caption, className: "facts" })]);
      put(about, [["Version", s.version ?? "–"], ["Started", stamp(s.started_time_s)], ["Running for", duration(s.uptime_s)], ["Axes", count(s.axes)]], "The service");
      const head = ["Source", "Kind", "State", "Promise", "Messages", "Bytes", "Lost", "Note"];
      const rows = list(s.sources).map((x) => [x.name, x.kind ?? "–", words(x.state ?? "–"), x.promise ?? "–", count(x.messages), bytesText(x.bytes), count(x.lost), x.text ?? ""]);
      renew(sources.lastElementChild, rows, () => [rows.length ? grid(head, rows, { caption: "Sources of samples", numeric: [4, 5, 6], className: "plain" }) : h("p", { class: "soft" }, "None.")]);
      const told = list(s.deliveries).map((x) => [x.name, count(x.waiting), count(x.delivered), count(x.failures), count(x.given_up), x.text ? `Last try failed: ${x.text}` : ""]);
      renew(deliveries.lastElementChild, told, () => [told.length ? grid(["To", "Waiting", "Delivered", "Failed tries", "Given up", "Note"], told, { caption: "Where alarms are told", numeric: [1, 2, 3, 4], className: "plain" }) : h("p", { class: "soft" }, "Nowhere: no webhook, broker or server is configured.")]);
      const [db, limit] = [s.store ?? {}, s.threshold ?? {}];
      put(store, [["Stored", bytesText(db.bytes)], ["Waiting to be stored", isNumber(db.pending) ? plural(db.pending, "row") : "–"],
        ["Disk", db.disk_full ? "FULL: nothing is stored until there is room" : db.text || "has room"],
        ["One false alarm of the installation in", duration(limit.false_alarm_interval_s)], ["One false alarm per figure in", duration(limit.per_figure_s)]], "Store and threshold");
      const events = list(trail.audit);
      if (!trail.problem) renew(audit.lastElementChild, events, () => [events.length ? grid(["Time", "Axis", "What", "Alarm", "By", "Reason"], events.map((e) => [stamp(e.time_s), e.axis ?? "–", words(e.action), sentence(e.text) || "–", e.who ?? "–", e.reason ?? ""]), { caption: "What people and the service did, newest first", className: "plain" }) : h("p", { class: "soft" }, "Nothing yet.")]);
    } catch (error) {
      say(problem, `The status could not be loaded: ${error.message}`);
    }
  };
  return { title: "Status", nav: "status", update: (now) => { if (now - asked > EVERY_MS) load(); } };
}
