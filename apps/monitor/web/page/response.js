// SPDX-License-Identifier: MIT
// The live frequency response and the loop of one axis, over those of the baseline, drawn by the report's own charts.
import { drawBode } from "./report/bode.js";
import { points } from "./report/curves.js";
import { isNumber, list, plain, significant } from "./report/format.js";
import { drawNyquist } from "./report/nyquist.js";
import { release } from "./report/plot.js";
import { grid, h } from "./dom.js";

/** All that stands behind a ± on this page is one standard deviation; of complex values the region of the same probability. */
const CONFIDENCE = 0.6827;
const EXPLAIN = "How strongly and how late the velocity follows the torque at each frequency, now and at the baseline. Shaded: one standard " +
  "deviation. Dashed: anti-resonance and resonance now. Coherence: of the newest raw samples, whatever the estimate says.";
/** Curves move this often; less often while one is read by the keyboard, which would be told each time. */
const DRAW_MS = 200;
const READ_MS = 5000;

const withFrequency = (columns, frequency) => (columns ? { frequency_hz: frequency, ...columns } : undefined);

/** L of the baseline's machine with the controller of now: L changes as the response does. Null where the frequencies differ. */
export function baselineLoop({ frequency_hz: frequency, real, imag, loop, baseline }) {
  const same = loop && baseline && list(baseline.frequency_hz).length === frequency.length &&
    frequency.every((f, i) => Math.abs(baseline.frequency_hz[i] - f) <= 1e-9 * f);
  if (!same) return null;
  const out = { frequency_hz: frequency, real: [], imag: [] };
  frequency.forEach((_, i) => {
    const square = real[i] ** 2 + imag[i] ** 2;
    const ratio = [(baseline.real[i] * real[i] + baseline.imag[i] * imag[i]) / square, (baseline.imag[i] * real[i] - baseline.real[i] * imag[i]) / square];
    const value = [loop.real[i] * ratio[0] - loop.imag[i] * ratio[1], loop.real[i] * ratio[1] + loop.imag[i] * ratio[0]];
    // What is not known stays null: null * 1 would be 0.
    const known = [real, imag, baseline.real, baseline.imag, loop.real, loop.imag].every((column) => isNumber(column[i])) && square > 0;
    out.real.push(known ? value[0] : null);
    out.imag.push(known ? value[1] : null);
  });
  return out;
}

/** As the report's charts want it. */
function reportOf(response, { figures, units }, loop) {
  const frequency = response.frequency_hz;
  const value = (name) => figures[name] ?? {};
  const margins = (read, deviation) => Object.fromEntries(["modulus_margin", "phase_margin_deg"].flatMap((name) => {
    const x = read(value(name));
    const std = deviation(value(name));
    const stdName = name === "phase_margin_deg" ? "phase_margin_std_deg" : "modulus_margin_std";
    return isNumber(x) ? [[name, x], ...(isNumber(std) ? [[stdName, std]] : [])] : [];
  }));
  const other = baselineLoop(response);
  return {
    frequency_response: response,
    resonances: [["antiresonance_hz", "antiresonance"], ["resonance_hz", "resonance"]].map(([name, kind]) =>
      ({ kind, frequency_hz: value(name).value, std_hz: value(name).std })),
    loop: { ...margins((f) => f.value, (f) => f.std), ...(isNumber(loop.crossover_hz) ? { crossover_hz: loop.crossover_hz } : {}) },
    planned_loop: other ? margins((f) => f.baseline, () => null) : undefined,
    page: {
      confidence: CONFIDENCE, joined: true, explain: EXPLAIN, units: { response: units?.response ?? "" },
      names: { measured: "now", model: "baseline", curve: "L now", planned: "L of the baseline, controller of now", ran: "Now", other: "Baseline" },
      model_curve: response.baseline, loop_curve: withFrequency(response.loop, frequency), planned_curve: other ?? undefined,
    },
  };
}

/** The kinds of curves that there are: with others the pictures are built anew. */
const kindOf = (r) => [r.coherence, r.coherence_std, r.baseline, r.loop, baselineLoop(r)].map((c) => (c ? 1 : 0)).join("") + (list(r.frequency_hz).length > 400);

export function responsePart(root) {
  const place = h("div", { class: "live" });
  const none = h("section", {}, h("h2", {}, "Frequency response"), h("p", { class: "explain" }, "Nothing measured yet."));
  root.append(place);
  place.append(none);
  let newest = null;
  let drawn = null;
  let kind = null;
  let bode = null;
  let nyquist = null;
  let last = -Infinity;

  const build = (data) => {
    release(place);
    place.replaceChildren();
    bode = drawBode(place, data);
    nyquist = drawNyquist(place, data);
    if (!bode) place.append(none);
    else place.firstElementChild.append(tableOnDemand("Response as a table", () => responseTable(newest)));
  };

  return {
    show: (response) => { newest = response; },
    /** `stale`: a text over the curves that says so, or empty. */
    update: (now, axis, loop, stale) => {
      place.classList.toggle("stale", stale !== "");
      for (const box of place.querySelectorAll(":scope > section")) box.dataset.stale = stale;
      const pause = place.contains(document.activeElement) ? READ_MS : DRAW_MS;
      if (!newest || newest === drawn || now - last < pause) return;
      last = now;
      drawn = newest;
      const data = reportOf(newest, axis, loop);
      if (kindOf(newest) !== kind) {
        kind = kindOf(newest);
        build(data);
      } else {
        bode?.(data);
        nyquist?.(data);
      }
    },
    leave: () => release(place),
  };
}

/** A table that is made when it is asked for. */
export function tableOnDemand(title, make) {
  const box = h("details", { class: "on-demand", ontoggle: () => { box.querySelector(":scope > div")?.remove(); if (box.open) box.append(make()); } }, h("summary", {}, title));
  return box;
}

function responseTable(response) {
  const db = (p) => significant(20 * Math.log10(p.abs), 4);
  const now = points(response);
  const base = new Map(points(response.baseline).map((p) => [p.f, p]));
  const head = ["Frequency, Hz", "Magnitude, dB", "± relative", "Phase, °", "Coherence", "± coherence", "Baseline, dB", "Baseline, °"];
  return grid(head, now.map((p) => {
    const b = base.get(p.f);
    return [significant(p.f, 4), db(p), p.std === null ? "–" : significant(p.std / p.abs, 2), plain(Math.round(10 * p.phase) / 10, 5),
      p.coherence === null ? "–" : significant(p.coherence, 3), p.coherenceStd === null ? "–" : significant(p.coherenceStd, 2),
      b ? db(b) : "–", b ? plain(Math.round(10 * b.phase) / 10, 5) : "–"];
  }), { caption: "Frequency response now and at the baseline", numeric: [1, 2, 3, 4, 5, 6, 7], className: "numbers" });
}
