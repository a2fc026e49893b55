// SPDX-License-Identifier: MIT
// The interface of `resonid monitor` from a simulated fleet, for tests of the page and for looking at it:
//   node fake_server.mjs [port] [number of axes] [ms per frame]
// What is measured depends on axis, figure and time alone; time runs as it does.
import { readFileSync, existsSync } from "node:fs";
import { createServer } from "node:http";
import path from "node:path";
import { fileURLToPath } from "node:url";

const here = path.dirname(fileURLToPath(import.meta.url));
const root = path.resolve(here, "../..");
const PAGE = path.join(root, "apps/monitor/web/page");
const REPORT = path.join(root, "src/report/web");
const UPLOT = process.env.RESONID_UPLOT ?? path.join(REPORT, "node_modules/uplot");

const TYPES = { ".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8", ".svg": "image/svg+xml" };
const SECURITY = {
  "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; font-src 'self'; " +
    "manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
   "X-Content-Type-Options": "nosniff", "Cache-Control": "no-store",
};

// --- numbers

function hash(text) {
  let h = 2166136261;
  for (const c of text) h = Math.imul(h ^ c.charCodeAt(0), 16777619);
  h ^= h >>> 15; h = Math.imul(h, 2246822519); h ^= h >>> 13; h = Math.imul(h, 3266489917);
  return (h ^ (h >>> 16)) >>> 0;
}
const uniform = (text) => (hash(text) + 0.5) / 2 ** 32;
/** Normal by Box and Muller, the same for the same text. */
const normal = (text) => Math.sqrt(-2 * Math.log(uniform(text + "r"))) * Math.cos(2 * Math.PI * uniform(text + "p"));

// --- machines: two masses with a belt between

const FIGURES = ["resonance_hz", "antiresonance_hz", "stiffness", "driven_inertia", "load_inertia", "damping", "coulomb_friction", "modulus_margin", "phase_margin_deg", "gap"];
const RELATIVE_STD = { resonance_hz: 0.004, antiresonance_hz: 0.005, stiffness: 0.008, driven_inertia: 0.01, load_inertia: 0.012, damping: 0.05, coulomb_friction: 0.03, modulus_margin: 0.02, phase_margin_deg: 0.02, gap: 0.2 };
const UNITS = { inertia: "kgm2", stiffness: "Nm/rad", damping: "Nms/rad", torque: "Nm", response: "(rad/s)/Nm" };
const LINEAR_UNITS = { inertia: "kg", stiffness: "N/m", damping: "Ns/m", torque: "N", response: "(m/s)/N" };
const CURRENT_UNITS = { inertia: "A s2/rad", stiffness: "A/rad", damping: "A s/rad", torque: "A", response: "(rad/s)/A" };
const unitsOf = (name) => ({ "gantry-y": LINEAR_UNITS, "rotary-4": CURRENT_UNITS })[name] ?? UNITS;
const NAMES = ["belt-1", "conveyor-7", "feeder-a", "feeder-b", "gantry-x", "gantry-y", "lift-3", "palletizer-9", "press-2", "rotary-4", "spindle-1", "winder-5"];

/** For so long an alarm can be shelved, and raw samples are kept. */
const LONGEST_SHELVING_S = 7 * 86400;
const RAW_S = 120;

const machineOf = (name) => {
  const u = (what) => uniform(name + what);
  return { j1: 0.02 * (1 + u("j1")), j2: 0.03 * (1 + u("j2")), k: 100 * (1 + u("k")), d: 0.02 * (1 + u("d")), friction: 0.3 * (1 + u("f")) };
};

/** [real, imag] */
const mul = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
const div = ([a, b], [c, d]) => { const n = c * c + d * d; return [(a * c + b * d) / n, (b * c - a * d) / n]; };
const add = ([a, b], [c, d]) => [a + c, b + d];

/** Torque to the motor's velocity at one frequency. */
function responseAt({ j1, j2, k, d }, f) {
  const s = [0, 2 * Math.PI * f];
  const s2 = mul(s, s);
  const shaft = [k, d * s[1]];
  const load = add([j2 * s2[0], j2 * s2[1]], shaft);
  const motor = add([j1 * s2[0], j1 * s2[1]], shaft);
  return div(mul(s, load), add(mul(motor, load), mul([-shaft[0], -shaft[1]], shaft)));
}

/** A PI controller whose gain the machine was commissioned with, and 2 ms of delay. */
function loopAt(machine, commissioned, f) {
  const w = 2 * Math.PI * f;
  const gain = 2 * Math.PI * 6 * (commissioned.j1 + commissioned.j2) * 0.55;
  const c = [gain, -gain * 6 / w];
  return mul(mul(c, [Math.cos(-w * 0.002), Math.sin(-w * 0.002)]), responseAt(machine, f));
}

const GRID = Array.from({ length: 120 }, (_, i) => 1 * 120 ** (i / 119));

function marginsOf(machine, commissioned) {
  let modulus = Infinity;
  let phase = null;
  let before = null;
  for (let f = 0.5; f < 200; f *= 1.02) {
    const l = loopAt(machine, commissioned, f);
    modulus = Math.min(modulus, Math.hypot(l[0] + 1, l[1]));
    const size = Math.hypot(...l);
    if (before !== null && before >= 1 && size < 1 && phase === null) phase = 180 + (Math.atan2(l[1], l[0]) * 180) / Math.PI;
    before = size;
  }
  return { modulus, phase: phase > 180 ? phase - 360 : phase };
}

/** The margins are a search: once per machine and half percent of its stiffness and inertia. */
const knownMargins = new Map();
const valuesOf = (m, commissioned) => {
  const key = [commissioned.j1, Math.round(200 * m.k / commissioned.k), Math.round(200 * m.j2 / commissioned.j2)].join();
  if (!knownMargins.has(key)) knownMargins.set(key, marginsOf(m, commissioned));
  const margins = knownMargins.get(key);
  return {
    resonance_hz: Math.sqrt(m.k * (1 / m.j1 + 1 / m.j2)) / (2 * Math.PI), antiresonance_hz: Math.sqrt(m.k / m.j2) / (2 * Math.PI), stiffness: m.k,
    driven_inertia: m.j1, load_inertia: m.j2, damping: m.d, coulomb_friction: m.friction, modulus_margin: margins.modulus, phase_margin_deg: margins.phase,
    gap: 0.002 + 1.2 * Math.abs(m.k / commissioned.k - 1),
  };
};

export class Simulation {
  constructor({ axes = 12, now = Date.now() / 1000 } = {}) {
    this.start = now;
    this.names = [...NAMES];
    for (let i = NAMES.length; i < axes; ++i) this.names.push(`axis-${i}`);
    this.names = this.names.slice(0, axes);
    this.commissioned = new Map(this.names.map((n) => [n, machineOf(n)]));
    this.baselines = new Map(this.names.map((n) => [n, [{ sample: 1000, active: true, time_s: now - 40 * 86400, who: "commissioning", reason: "first run", figures: this.figuresWithStd(n, valuesOf(this.commissioned.get(n), this.commissioned.get(n))) }]]));
    this.base = new Map(this.names.map((n) => [n, this.commissioned.get(n)]));
    this.samples = new Map();
    this.alarms = new Map();
    this.events = [];
    this.maintained = new Map();
    this.diskFull = false;
    this.without = new Set(["lift-3"]); // a baseline's response
    this.pause = 0;
    this.keepsFigures = false; // of before, while an axis learns
    this.tellsFigures = true; // while an axis learns
    this.silent = null; // axis, why, and age where it is known: no samples came since a restart
    this.addAlarms();
  }

  figuresWithStd(name, values) {
    return Object.fromEntries(FIGURES.map((f) => [f, { value: values[f], std: this.stdOf(f, values) }]));
  }

  stdOf(f, values) {
    return f === "gap" ? 0.004 : RELATIVE_STD[f] * Math.abs(values[f]);
  }

  /** belt-1 loosens: 5 % in half an hour before the start, then 0.4 % a second; winder-5 has another load. */
  machineAt(name, t) {
    const m = { ...this.commissioned.get(name) };
    const since = t - (this.start - 1800);
    if (name === "belt-1" && since > 0) m.k *= 1 - 0.05 * Math.min(1, since / 1800) - Math.min(0.25, 0.004 * Math.max(0, t - this.start));
    if (name === "winder-5" && t > this.start - 86400) m.j2 *= 1.3;
    m.k *= 1 + 0.004 * Math.sin((2 * Math.PI * t) / 86400 + hash(name));
    return m;
  }

  valuesAt(name, t) {
    return valuesOf(this.machineAt(name, t), this.commissioned.get(name));
  }

  stateOf(name) {
    if (name === this.silent?.axis) return { state: "stale", trusted: false, verdict: "trusted", why: this.silent.why };
    if (name === "press-2") return { state: "stale", trusted: false, verdict: "samples-missing", why: "no samples arrive" };
    if (name === "conveyor-7") return { state: "following", trusted: false, verdict: "not-excited", why: "the drive stands still: nothing moves it enough to be identified" };
    if (name === "palletizer-9") return { state: "learning", trusted: false, verdict: "not-converged", why: "learning for 14 s of 60 s" };
    return { state: "following", trusted: true, verdict: "trusted", why: "" };
  }

  ageOf(name, now) {
    return name === "press-2" ? now - this.start + 412 : 0.03 + 0.02 * uniform(name);
  }

  /** When the machine was as the figures say. */
  timeOf(name, now) {
    return ["conveyor-7", "palletizer-9"].includes(name) ? this.start - 90 : now - this.ageOf(name, now);
  }

  statusOf(name, now, full = false) {
    const t = now - this.ageOf(name, now);
    const values = this.valuesAt(name, name === "press-2" ? this.start - 412 : now);
    const base = valuesOf(this.base.get(name), this.commissioned.get(name));
    const state = this.stateOf(name);
    const figures = {};
    for (const f of FIGURES) {
      if (state.state === "learning" && !this.tellsFigures) continue;
      if (state.verdict === "not-excited" && !["resonance_hz", "stiffness"].includes(f)) continue;
      const std = this.stdOf(f, values);
      const value = values[f] + 0.6 * std * normal(`${name}${f}${Math.floor(2 * t)}`);
      const limits = f === "gap" ? { high: 0.1 } : f === "modulus_margin" ? { low: 0.1 } : { low: base[f] - 0.04 * Math.abs(base[f]), high: base[f] + 0.04 * Math.abs(base[f]) };
      const measured = state.state === "learning" && !this.keepsFigures ? {} : { value, std, change: value - base[f], change_std: std * 1.2 };
      figures[f] = { ...measured, baseline: base[f], ...limits };
    }
    const mine = [...this.alarms.values()].filter((a) => a.axis === name && !a.shelved && !a.suppressed);
    const active = mine.filter((a) => a.active);
    const open = mine.filter((a) => !a.acknowledged);
    const told = mine.filter((a) => a.active || !a.acknowledged || a.latched);
    const worst = [...open, ...active, ...told][0];
    const n = Math.round((now - this.start + 3600) * 1000);
    const silent = name === this.silent?.axis ? { time_s: undefined, latency_s: undefined, age_s: this.silent.age_s, samples: { received: 0, missing: 0, late: 0, duplicate: 0, lost: 0 } } : {};
    return {
      name, ...state, time_s: this.timeOf(name, now), motion: name === "gantry-y" ? "linear" : "rotary", units: unitsOf(name), age_s: this.ageOf(name, now), latency_s: 0.04 + 0.03 * uniform(name + "l"), rate_hz: 1000, sample: n, maintenance_until_time_s: this.maintained.get(name), ...(worst ? { worst_alarm: { severity: worst.severity, text: worst.text } } : {}),
      alarms: told.length, unacknowledged: open.length, figures,
      samples: { received: n, missing: name === "feeder-b" ? 120 : 0, late: name === "feeder-b" ? 7 : 0, duplicate: 0, lost: 0 },
      faults: name === "feeder-b" ? [{ kind: "format", count: 3, text: "line 17: <script>alert('no')</script> is no number" }] : [], ...silent, source: name === "press-2" ? "plc" : "broker",
      ...(full ? {
        estimator: {
          method: "physical", memory_s: 20, learned_s: state.state === "learning" ? 14 : 60, start: "plan",
          gates: { ready: true, excited: state.verdict !== "not-excited", converged: state.verdict === "trusted", physical: true, residual: true, complete: state.state !== "stale", covered: true },
        },
        loop: { controller: "pi:2.1,12" }, baselines: this.baselines.get(name), configuration_hash: "9f1c04aa", longest_shelving_s: LONGEST_SHELVING_S, raw_from_time_s: now - RAW_S,
      } : {}),
    };
  }

  responseOf(name, now) {
    const t = name === "press-2" ? this.start - 412 : now;
    const curve = (machine, noisy) => {
      const out = { frequency_hz: GRID, real: [], imag: [], std: [], coherence: [], coherence_std: [], loop: { real: [], imag: [], std: [] } };
      GRID.forEach((f, i) => {
        let g = responseAt(machine, f);
        let l = loopAt(machine, this.commissioned.get(name), f);
        const relative = 0.02 + 0.1 * Math.exp(-(Math.log(f / 2) ** 2)) * 0.3;
        if (noisy) {
          const e = [1 + 0.4 * relative * normal(`${name}${i}re${Math.floor(2 * t)}`), 0.4 * relative * normal(`${name}${i}im${Math.floor(2 * t)}`)];
          g = mul(g, e);
          l = mul(l, e);
        }
        out.real.push(g[0]); out.imag.push(g[1]); out.std.push(relative * Math.hypot(...g) + 0.004);
        const coherence = Math.max(0, Math.min(1, 1 - 3 * relative ** 1.5 - 0.02 * uniform(`${name}${i}`)));
        out.coherence.push(coherence);
        out.coherence_std.push(Math.sqrt((2 * coherence) / 30) * (1 - coherence));
        out.loop.real.push(l[0]); out.loop.imag.push(l[1]); out.loop.std.push(relative * Math.hypot(...l));
      });
      return out;
    };
    const base = curve(this.base.get(name), false);
    delete base.coherence;
    delete base.coherence_std;
    delete base.loop;
    return { time_s: this.timeOf(name, now), ...curve(this.machineAt(name, t), true), ...(this.without.has(name) ? {} : { baseline: base }) };
  }

  /** By the machine of the baseline itself, without its response. */
  baselineLoop(name) {
    const values = GRID.map((f) => loopAt(this.base.get(name), this.commissioned.get(name), f));
    return { real: values.map(([re]) => re), imag: values.map(([, im]) => im) };
  }

  historyOf(name, names, from, to, points) {
    const span = to - from;
    const lengths = { row: 1, "five-minutes": 300, hour: 3600, day: 86400 };
    const resolution = span <= 2 * 86400 ? "row" : span <= 62 * 86400 && span / points < 3600 ? "five-minutes" : span / points < 86400 ? "hour" : "day";
    const step = Math.max(span / points, lengths[resolution]);
    const out = { time_s: [], figures: Object.fromEntries(names.map((f) => [f, { value: [], std: [], min: [], max: [], trusted: [] }])), resolution };
    const end = Math.min(to, name === "press-2" ? this.start - 412 : Date.now() / 1000);
    for (let t = Math.ceil(from / step) * step; t <= end; t += step) {
      if (t < this.start - 3 * 365 * 86400) continue;
      out.time_s.push(t);
      const values = valuesOf(this.machineAt(name, t), this.commissioned.get(name));
      const hidden = name === "conveyor-7" || uniform(`${name}${Math.floor(t / (20 * step))}`) < 0.06;
      for (const f of names) {
        const column = out.figures[f];
        const std = this.stdOf(f, values) * (hidden ? 4 : 1);
        const value = values[f] + 0.5 * std * normal(`${name}${f}${Math.round(t)}`);
        column.value.push(value); column.std.push(std); column.min.push(value - 2.5 * std); column.max.push(value + 2.5 * std); column.trusted.push(hidden ? 0 : 1);
      }
    }
    return out;
  }

  compare(name, a, b) {
    const figures = {};
    const [va, vb] = [a, b].map((t) => valuesOf(this.machineAt(name, t), this.commissioned.get(name)));
    for (const f of FIGURES) {
      const [sa, sb] = [this.stdOf(f, va) / 5, this.stdOf(f, vb) / 5];
      const std = Math.hypot(sa, sb);
      const sigma = Math.abs(vb[f] - va[f]) / std;
      figures[f] = { a: { value: va[f], std: sa }, b: { value: vb[f], std: sb }, difference: vb[f] - va[f], std, sigma };
    }
    return { a_time_s: a, b_time_s: b, figures };
  }

  // --- alarms

  addAlarms() {
    const s = this.start;
    if (this.names.includes("belt-1")) {
      const k = this.commissioned.get("belt-1").k;
      this.raise({
        id: 1, axis: "belt-1", alarm: "stiffness", severity: "medium", since_time_s: s - 1100, raised_time_s: s - 900,
        text: `Stiffness fell by 3.00 +- 0.60 % (${k.toFixed(1)} -> ${(0.97 * k).toFixed(1)} Nm/rad)`, cause: "likely cause: belt or coupling looser (inertias unchanged)",
        change: { before: k, after: 0.97 * k, size: -0.03 * k, std: 0.006 * k, relative: -0.03, sigma: 5 }, evidence: true,
      }, s - 900);
    }
    if (this.names.includes("winder-5")) {
      const j = this.commissioned.get("winder-5").j2;
      this.raise({
        id: 2, axis: "winder-5", alarm: "load-inertia", severity: "medium", since_time_s: s - 86400, raised_time_s: s - 86390,
        text: "Load inertia rose by 30.0 +- 1.4 %", cause: "likely cause: heavier load (motor inertia unchanged)",
        change: { before: j, after: 1.3 * j, size: 0.3 * j, std: 0.014 * j, relative: 0.3, sigma: 21 }, evidence: true,
      }, s - 86390);
      this.act(2, "acknowledge", { who: "Lee", reason: "full reel" }, s - 86000);
    }
    if (this.names.includes("press-2")) {
      this.raise({ id: 3, axis: "press-2", alarm: "stale", severity: "medium", since_time_s: s - 412, raised_time_s: s - 407, text: "No samples since 5 s", cause: "source plc: connection refused", evidence: false }, s - 407);
      this.alarms.get(3).shelved = { until_time_s: s + 3 * 3600, reason: "PLC is being replaced", who: "Lee" };
    }
  }

  raise(alarm, time = Date.now() / 1000) {
    const full = { active: true, acknowledged: false, latched: false, evidence: false, ...alarm };
    this.alarms.set(full.id, full);
    this.events.push({ time_s: time, alarm: full.id, axis: full.axis, transition: "raised", state: "active", text: full.text, sample: 0 });
    return full;
  }

  act(id, what, { who, reason, seconds, until_time_s: until }, time = Date.now() / 1000) {
    const alarm = this.alarms.get(id);
    if (what === "acknowledge") alarm.acknowledged = true;
    if (what === "shelve") alarm.shelved = { until_time_s: until ?? time + seconds, reason, who };
    if (what === "unshelve") delete alarm.shelved;
    if (what === "reset") alarm.latched = false;
    this.events.push({ time_s: time, alarm: id, axis: alarm.axis, transition: { acknowledge: "acknowledged", shelve: "shelved", unshelve: "unshelved", reset: "reset" }[what], state: "active", text: alarm.text, sample: 0, who, reason });
    return alarm;
  }

  do(name, what, { who, reason, seconds }, time) {
    if (what === "baseline") {
      this.base.set(name, this.machineAt(name, time));
      this.without.delete(name);
      for (const old of this.baselines.get(name)) old.active = false;
      this.baselines.get(name).unshift({ sample: 2000, active: true, time_s: time, who, reason, figures: this.figuresWithStd(name, this.valuesAt(name, time)) });
    }
    if (what === "maintenance") this.maintained.set(name, time + seconds);
    if (what === "end-maintenance") this.maintained.delete(name);
    for (const alarm of this.alarms.values()) {
      if (alarm.axis === name && this.maintained.has(name)) alarm.suppressed = "maintenance";
      else if (alarm.axis === name) delete alarm.suppressed;
    }
    this.events.push({ time_s: time, axis: name, transition: what, who, reason });
  }
}

// --- server

const fault = (status, message, field = "") => Object.assign(new Error(message), { status, field });

function files() {
  const from = (folder, prefix, names) => names.map((name) => [prefix + name, path.join(folder, name)]);
  return (name) => {
    if (name === "/" || name === "/index.html") return path.join(PAGE, "index.html");
    const map = { "/uplot.js": path.join(UPLOT, "dist/uPlot.iife.min.js"), "/uplot.css": path.join(UPLOT, "dist/uPlot.min.css") };
    if (map[name]) return map[name];
    const m = /^\/(report\/)?([a-z_]+\.(?:js|css|svg))$/.exec(name);
    return m ? path.join(m[1] ? REPORT : PAGE, m[2]) : null;
  };
}

/** Starts the server. `token`: what writes need; `readToken`: what reads need, true for the same; the list of axes waits for what `listing` returns. Returns its address, its simulation, and how to disturb it. */
export async function startServer({ axes = 12, token = null, readToken = false, listing = () => {}, port = 0, frameMs = 100 } = {}) {
  const simulation = new Simulation({ axes });
  const fileOf = files();
  const sockets = new Set();
  const streams = new Set();
  const log = { posts: [], resumed: [], queries: [] };
  const sent = []; // alarm events by id
  let id = 0;
  let down = false;
  const limits = { streams: Infinity, failing: null }; // reads whose address is like the latter fail
  const readsWith = readToken === true ? token : readToken || null;

  const write = (stream, name, data) => stream.response.write(`id: ${id}\nevent: ${name}\ndata: ${JSON.stringify(data)}\n\n`);
  const broadcastAlarm = (alarm) => {
    id += 1;
    sent.push({ id, alarm: structuredClone(alarm) });
    for (const stream of streams) write(stream, "alarm", alarm);
  };

  const listed = (query) => {
    const open = query.get("state") === "open";
    const [from, to] = [["from", -Infinity], ["to", Infinity]].map(([key, without]) => (query.has(key) ? Number(query.get(key)) : without));
    const all = [...simulation.alarms.values()].filter((a) => (!query.get("axis") || a.axis === query.get("axis")) && a.raised_time_s <= to && (a.cleared_time_s ?? Infinity) >= from && (!open || a.active || !a.acknowledged || a.latched || a.shelved));
    return { alarms: all.sort((a, b) => b.raised_time_s - a.raised_time_s).slice(0, Number(query.get("limit") ?? 100)) };
  };
  const whole = (status) => Object.fromEntries(Object.entries(status).filter(([, value]) => value !== "" && value !== undefined));

  function read(parts, query, now) {
    const [what, name, more] = parts;
    if (what === "axes" && !name) return { time_s: now, axes: simulation.names.map((n) => whole(simulation.statusOf(n, now))) };
    if (what === "axes") {
      if (!simulation.names.includes(name)) throw fault(404, `no axis ${name}`, "axis");
      if (!more) return whole(simulation.statusOf(name, now, true));
      if (more === "response") return simulation.responseOf(name, now);
      if (more === "compare") return simulation.compare(name, Number(query.get("a")), Number(query.get("b")));
      if (more === "history") return simulation.historyOf(name, query.get("figure").split(","), Number(query.get("from")), Number(query.get("to")), Number(query.get("points")));
    }
    if (what === "alarms" && !name) return listed(query);
    if (what === "alarms" && !more) {
      if (!simulation.alarms.has(Number(name))) throw fault(404, `no alarm ${name}`, "id");
      return { ...simulation.alarms.get(Number(name)), longest_shelving_s: LONGEST_SHELVING_S };
    }
    if (what === "alarms" && more === "events") {
      return { events: simulation.events.filter((e) => e.alarm === Number(name)).map(({ time_s, sample, transition, state, text, who, reason }) => ({ time_s, sample, transition, state, text, who, reason })) };
    }
    if (what === "audit") {
      const entries = simulation.events.filter((e) => e.who).map(({ time_s, axis, transition, text = "", who, reason }) => ({ time_s, axis, action: transition, text, who, reason }));
      return { audit: entries.sort((a, b) => b.time_s - a.time_s) };
    }
    if (what === "status") {
      return {
        version: "0.1.0", started_time_s: simulation.start - 3600, uptime_s: now - simulation.start + 3600, axes: simulation.names.length,
        sources: [{ name: "broker", kind: "mqtt", state: "running", promise: "nothing lost while the broker's queue lasts", messages: 123456, bytes: 987654321, lost: 0, text: "" },
          { name: "plc", kind: "tcp", state: "waiting", promise: "nothing lost if the client keeps until acknowledged", messages: 4711, bytes: 1234567, lost: 12, text: "connection refused" }],
        store: { bytes: 345678901, pending: 3, disk_full: simulation.diskFull, failing: simulation.diskFull, over_limit: false, text: simulation.diskFull ? "database or disk is full" : "" }, threshold: { false_alarm_interval_s: 3.6e6, per_figure_s: 3.6e6 * 12 * 11 },
      };
    }
    throw fault(404, "no such path");
  }

  function change(parts, body, now) {
    const [what, name, action] = parts;
    if (!body.who) throw fault(400, "1 ... 200 characters are required", "who");
    if (["shelve", "maintenance"].includes(action) && !(body.reason && body.seconds > 0)) throw fault(400, "a reason and an end are required", "reason");
    if (action === "shelve" && body.seconds > LONGEST_SHELVING_S) throw fault(400, "7 days at most", "seconds");
    if (action === "reset" && !simulation.alarms.get(Number(name))?.acknowledged) throw fault(409, "needs an alarm that is acknowledged", "id");
    if (what === "alarms" && simulation.alarms.has(Number(name)) && ["acknowledge", "shelve", "unshelve", "reset"].includes(action)) {
      broadcastAlarm(simulation.act(Number(name), action, body, now));
      return { accepted: true };
    }
    if (what === "axes" && simulation.names.includes(name) && ["baseline", "relearn", "maintenance", "end-maintenance"].includes(action)) {
      simulation.do(name, action, body, now);
      if (action.endsWith("maintenance")) for (const alarm of simulation.alarms.values()) if (alarm.axis === name) broadcastAlarm(alarm);
      return { accepted: true };
    }
    throw fault(404, "no such path");
  }

  const server = createServer(async (request, response) => {
    const url = new URL(request.url, "http://x");
    const reply = (status, type, body) => { response.writeHead(status, { ...SECURITY, "Content-Type": type }); response.end(body); };
    const json = (status, value) => reply(status, "application/json", JSON.stringify(value));
    try {
      if (!url.pathname.startsWith("/api/v1/")) {
        const file = fileOf(url.pathname);
        if (!file || !existsSync(file)) return reply(404, "text/plain", "not found");
        return reply(200, TYPES[path.extname(file)], readFileSync(file));
      }
      const parts = url.pathname.slice("/api/v1/".length).split("/").map(decodeURIComponent);
      const now = Date.now() / 1000;
      if (request.method === "POST") {
        let text = "";
        for await (const chunk of request) text += chunk;
        if (token !== null && request.headers.authorization !== `Bearer ${token}`) {
          if (readsWith && request.headers.authorization === `Bearer ${readsWith}`) throw fault(403, "this token is for reading only", "authorization");
          throw fault(401, "a token is needed", "authorization");
        }
        const body = JSON.parse(text);
        log.posts.push({ path: url.pathname, body });
        return json(200, change(parts, body, now));
      }
      const may = url.searchParams.get("token") ?? (request.headers.authorization ?? "").replace("Bearer ", "");
      if (readsWith && may !== token && may !== readsWith) throw fault(401, "a token is needed", "authorization");
      if (parts[0] === "stream") {
        if (streams.size >= limits.streams) throw fault(429, "more event streams than one client may have open", "streams");
        const axis = url.searchParams.get("axis");
        if (axis && !simulation.names.includes(axis)) throw fault(404, `no axis ${axis}`, "axis");
        response.writeHead(200, { ...SECURITY, "Content-Type": "text/event-stream" });
        const stream = { response, axis };
        const last = request.headers["last-event-id"];
        response.write("retry: 500\n\n");
        if (last !== undefined) {
          log.resumed.push(Number(last));
          for (const event of sent) if (event.id > Number(last)) response.write(`id: ${event.id}\nevent: alarm\ndata: ${JSON.stringify(event.alarm)}\n\n`);
        }
        write(stream, "hello", { resumed: last !== undefined, time_s: now });
        streams.add(stream);
        request.on("close", () => streams.delete(stream));
        return undefined;
      }
      if (limits.failing?.test(request.url)) throw fault(503, "the store is busy", "store");
      if (/^(evidence\.csv|raw)$/.test(parts[2] ?? "")) return reply(200, "text/csv", "t,ru,u,y\n0,0,0,0\n");
      if (parts[2] === "report.html") return reply(200, "text/html", "<!doctype html><html lang=en><title>report</title><h1>identify</h1>");
      log.queries.push(request.url);
      if (url.pathname === "/api/v1/axes") await listing();
      return json(200, read(parts, url.searchParams, now));
    } catch (error) {
      return json(error.status ?? 500, { error: { field: error.field ?? "", message: error.message } });
    }
  });
  server.on("connection", (socket) => {
    if (down) return socket.destroy();
    sockets.add(socket);
    socket.on("close", () => sockets.delete(socket));
    return undefined;
  });

  /** What changes from frame to frame. */
  const short = ({ state, trusted, verdict, why, time_s, age_s, latency_s, sample, maintenance_until_time_s, worst_alarm, alarms, unacknowledged, figures }) => whole({
    state, trusted, verdict, why, time_s, age_s, latency_s, sample, maintenance_until_time_s, worst_alarm, alarms, unacknowledged,
    figures: Object.fromEntries(Object.entries(figures).map(([f, { value, std, change, change_std }]) => [f, { value, std, change, change_std }])),
  });

  let beat = 0;
  const timer = setInterval(() => {
    if (streams.size === 0) return;
    const now = Date.now() / 1000;
    id += 1;
    beat += 1;
    const frame = { time_s: now, axes: {} };
    for (const name of simulation.names) frame.axes[name] = short(simulation.statusOf(name, now));
    for (const stream of streams) {
      write(stream, "frame", frame);
      if (!simulation.names.includes(stream.axis)) continue;
      write(stream, "axis", whole(simulation.statusOf(stream.axis, now)));
      if (beat % 3 === 0 && stream.axis !== "press-2") write(stream, "response", { axis: stream.axis, ...simulation.responseOf(stream.axis, now) });
    }
  }, frameMs);

  await new Promise((resolve) => { server.listen(port, "127.0.0.1", resolve); });
  return {
    url: `http://127.0.0.1:${server.address().port}/`, simulation, log, streams, limits,
    raise: (alarm) => broadcastAlarm(simulation.raise(alarm)),
    /** Every connection breaks and none is taken until restore(). */
    cut: () => { down = true; for (const socket of sockets) socket.destroy(); },
    restore: () => { down = false; },
    close: () => { clearInterval(timer); for (const socket of sockets) socket.destroy(); return new Promise((resolve) => { server.close(resolve); }); },
  };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const server = await startServer({ port: Number(process.argv[2] ?? 8080), axes: Number(process.argv[3] ?? 12), frameMs: Number(process.argv[4] ?? 100) });
  console.log(server.url);
}
