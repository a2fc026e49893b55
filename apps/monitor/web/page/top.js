// SPDX-License-Identifier: MIT
// The head of every page: whether the server is there, how old the data are, how long they took, how many alarms are open.
import { h, mark, say, sign } from "./dom.js";
import { ageOf, isStale, summary } from "./model.js";
import { link } from "./route.js";
import { duration, latencyText, plural, staleText, zone } from "./words.js";

const LINKS = [["fleet", "Fleet", []], ["alarms", "Alarms", ["alarms"]], ["status", "Status", ["status"]]];

export function drawTop(header) {
  const nav = header.querySelector("nav");
  const links = new Map(LINKS.map(([id, title, path]) => [id, h("a", { href: link(path) }, title)]));
  nav.append(...links.values());
  const strip = header.querySelector("#strip");
  const items = Object.fromEntries(["connection", "store", "service", "age", "latency", "alarms", "zone"].map((name) => {
    const icon = h("span", { class: "icon" });
    const text = h("span", {});
    const leads = { store: "status", service: "status", alarms: "alarms" }[name];
    const item = h(leads ? "a" : "span", { class: `item ${name}`, href: leads ? link([leads]) : null }, icon, text);
    strip.append(item);
    let shown = null;
    return [name, (kind, words) => {
      if (kind !== shown) {
        icon.replaceChildren(...(kind ? [sign(kind)] : []));
        item.className = `item ${name} ${kind ?? ""}`;
        shown = kind;
      }
      say(text, words);
      mark(item, "hidden", words === "");
    }];
  }));
  return {
    current: (id) => { for (const [name, a] of links) mark(a, "aria-current", name === id ? "page" : null); },
    update: ({ fleet, alarms, listing, stream, now, axis, troubles }) => {
      const axes = [...fleet.axes.values()];
      const all = summary(axes, alarms, now);
      if (stream.state === "open") items.connection("good", "Connected");
      else if (stream.full) items.connection("bad", "Too many pages are open; close others for live data here");
      else if (stream.state === "broken") items.connection("bad", `Connection lost ${duration((now - stream.brokenAt) / 1000)} ago, trying again`);
      else items.connection("wait", "Connecting");
      const { store, lost, sources } = troubles;
      items.store(store ? (lost ? "bad" : "warning") : null, store);
      items.service(sources.length ? "warning" : null, sources.length > 1 ? `${sources[0]}, and ${sources.length - 1} more` : sources[0] ?? "");
      // One axis' page tells of that axis, the others of all.
      const one = axis ? fleet.axes.get(axis) : null;
      const age = one ? ageOf(one, now) : all.age;
      const stale = one ? isStale(one, now) : all.axes > 0 && all.stale === all.axes;
      if (age === null) items.age("wait", "No data yet");
      else if (stale) items.age("stale", staleText(one ?? {}, age));
      else items.age(null, `Data ${duration(age)} old` + (!one && all.stale ? `, ${plural(all.stale, "axis", "axes")} without data` : ""));
      const latency = one ? one.seen_latency_s : all.latency;
      items.latency(null, stale || latency === null || latency === undefined ? "Latency –" : `Latency ${latencyText(latency)}`);
      items.zone(null, `Times ${zone(Date.now() / 1000)}`);
      const heard = stream.state === "open" || stream.full;
      if (all.alarms === 0 && !listing.complete) items.alarms("wait", "Alarms not known yet");
      else if (all.alarms === 0) items.alarms(heard ? "good" : "stale", heard ? "No alarm open" : "No alarm was open");
      else items.alarms(all.unacknowledged ? "bad" : "warning", `${plural(all.alarms, "alarm")} open` + (all.unacknowledged ? `, ${all.unacknowledged} not acknowledged` : ""));
    },
  };
}
