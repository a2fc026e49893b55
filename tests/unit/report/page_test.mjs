// SPDX-License-Identifier: MIT
// The arithmetic of the report page, without a browser.
import assert from "node:assert/strict";
import { test } from "node:test";

const web = "../../../src/report/web/";
const format = await import(web + "format.js");
const curves = await import(web + "curves.js");
const ticks = await import(web + "ticks.js");
const geometry = await import(web + "geometry.js");
const nyquist = await import(web + "nyquist.js");
const tables = await import(web + "tables.js");

const near = (actual, expected, tolerance) =>
  assert.ok(Math.abs(actual - expected) <= tolerance, `${actual} is not ${expected} +- ${tolerance}`);

test("interval factors", () => {
  // scipy.stats.norm.ppf(0.5 + c / 2)
  near(format.normalFactor(0.95), 1.959963984540054, 1e-9);
  near(format.normalFactor(0.5), 0.6744897501960817, 1e-9);
  near(format.normalFactor(0.999), 3.2905267314919255, 1e-9);
  near(format.regionFactor(1 - Math.exp(-1)), 1, 1e-12);
});

test("numbers keep their significant digits", () => {
  assert.equal(format.significant(10.667, 4), "10.67");
  assert.equal(format.significant(9.9999, 3), "10.0");
  assert.equal(format.significant(-0.05), "−0.05000");
  assert.equal(format.significant(1.5e-7, 2), "1.5×10⁻⁷");
  assert.equal(format.significant(123456.7, 4), "123500");
  assert.equal(format.significant(null), "–");
  assert.equal(format.plain(0.5), "0.5");
  assert.equal(format.plain(1000), "1000");
});

test("a value ends where its uncertainty does", () => {
  assert.equal(format.interval(0.032, 0.000196, "kgm2"), "0.03200 ± 0.00020 kg m²");
  assert.equal(format.interval(143.75, 0.784, "Nm/rad"), "143.75 ± 0.78 Nm/rad");
  assert.equal(format.interval(15.086, 0.0997, "Hz"), "15.09 ± 0.10 Hz");
  assert.equal(format.interval(2.13e-6, 4e-7), "(2.13 ± 0.40)×10⁻⁶");
  assert.equal(format.interval(9753215, 280000), "(9.75 ± 0.28)×10⁶");
  assert.equal(format.interval(12345, 1234), "12345 ± 1200");
  assert.equal(format.interval(0, 0.00002, "s"), "(0.0 ± 2.0)×10⁻⁵ s");
  assert.equal(format.interval(3.5, undefined, "Hz"), "3.500 Hz");
  assert.equal(format.interval(undefined, 1), "–");
});

test("units and words are set for readers", () => {
  assert.equal(format.prettyUnit("V s2/rad"), "V s²/rad");
  assert.equal(format.prettyUnit("(rad/s)/Nm"), "(rad/s)/Nm");
  assert.equal(format.prettyUnit("kgm2"), "kg m²");
  assert.equal(format.prettyUnit("Nms/rad"), "Nm s/rad");
  assert.equal(format.powers("0.1 +- 0.01 kgm2, a+-b"), "0.1 ± 0.01 kg m², a+-b");
  assert.equal(format.words("driven_inertia"), "Motor inertia");
  assert.equal(format.words("low-coherence"), "Low coherence");
  assert.equal(format.escapeHtml(`<b a="1">'&`), "&lt;b a=&quot;1&quot;&gt;&#39;&amp;");
});

test("points drop what cannot be drawn", () => {
  const line = curves.points({ frequency_hz: [3, 0, 1, 2], real: [1, 1, null, 0], imag: [0, 1, 1, -2] });
  assert.deepEqual(line.map((p) => [p.f, p.abs, p.phase]), [[2, 2, -90], [3, 1, 0]]);
  assert.deepEqual(curves.points(undefined), []);
});

test("phase runs on without jumps", () => {
  assert.deepEqual(curves.unwrap([-170, 170, 150]), [-170, -190, -210]);
  // An unreliable line neither jumps far nor drags its neighbours along.
  assert.deepEqual(curves.unwrap([-170, 60, -175], (i) => i !== 1), [-170, -300, -175]);
  assert.deepEqual(curves.unwrap([]), []);
});

test("bands are the disc of the confidence region", () => {
  const confidence = 1 - Math.exp(-1); // radius = std
  const [p, drowned] = curves.measuredBode({ frequency_hz: [1, 2], real: [2, 1], imag: [0, 0.1], std: [1, 3] }, confidence);
  near(p.dbLow, 0, 1e-9);
  near(p.dbHigh, 20 * Math.log10(3), 1e-9);
  near(p.degreesHigh, 30, 1e-9);
  near(p.degreesLow, -30, 1e-9);
  assert.equal(drowned.degreesHigh - drowned.degrees, 180);
  near(drowned.db - drowned.dbLow, 30, 1e-9);
});

test("measured phase lands on the turn of the model; unsettled lines are told", () => {
  const model = curves.modelBode({ frequency_hz: [1, 2, 3, 4], real: [0, -1, 0, 1], imag: [-1, 0, 1, 0] });
  assert.deepEqual(model.map((p) => Math.round(p.degrees)), [-90, -180, -270, -360]);
  const [a, b] = curves.measuredBode({ frequency_hz: [2, 3], real: [-1, 0.1], imag: [0.1, 1], unsettled_hz: [3] }, 0.95, model);
  near(a.degrees, -185.71, 0.01);
  near(b.degrees, -275.71, 0.01);
  assert.deepEqual([a.settled, b.settled], [true, false]);
});

test("curves of different grids share one axis", () => {
  const out = curves.align([[1, 3], [2, 3]], [{ grid: 0, values: [10, 30] }, { grid: 1, values: [20, 31] }]);
  assert.deepEqual(out, [[1, 2, 3], [10, null, 30], [null, 20, 31]]);
});

test("a wide band does not squeeze the points", () => {
  const [low, high] = curves.limits([0, 10], [-100, 12, null], { allow: 5, margin: 0 });
  near(low, -5, 1e-9);
  near(high, 12, 1e-9);
  assert.deepEqual(curves.limits([], []), [0, 1]);
});

test("ticks are round", () => {
  assert.deepEqual(ticks.phaseTicks(-100, 100, 6), [-90, -45, 0, 45, 90]);
  assert.deepEqual(ticks.phaseTicks(-380, 40, 6), [-360, -270, -180, -90, 0]);
  assert.deepEqual(ticks.decibelTicks(-23, 11, 6), [-20, -10, 0, 10]);
  assert.deepEqual(ticks.linearTicks(-0.3, 0.31, 6), [-0.2, 0, 0.2]);
  assert.deepEqual(ticks.logTicks(8, 30), [8, 9, 10, 20, 30]);
  assert.deepEqual(ticks.logTicks(10, 12), [10, 10.5, 11, 11.5, 12]);
  assert.deepEqual(ticks.logTicks(0, 5), []);
  const labels = ticks.logLabels(ticks.logTicks(1, 100), 1, 100, 200, 30);
  assert.deepEqual([...labels].sort((a, b) => a - b), [1, 2, 5, 10, 20, 50, 100]);
});

test("the phase margin's arc starts at -180 degrees", () => {
  const late = geometry.arcEnds({ real: Math.cos(-2), imag: Math.sin(-2) }, 1);
  near(late.margin, Math.PI - 2, 1e-12);
  near(late.to[1], Math.sin(-2), 1e-12);
  const unstable = geometry.arcEnds({ real: -1, imag: 0.1 }, 1);
  assert.ok(unstable.margin < 0);
});

test("the view holds unit circle, marks and the curve past the crossover", () => {
  const curve = [{ f: 0.1, re: -3, im: -9, abs: 9.5 }, { f: 5, re: 2.5, im: -1, abs: 2.7 }];
  const view = geometry.homeView(curve, [], { crossover: { real: 0, imag: -1, frequency_hz: 2 } });
  assert.ok(view.re + view.half >= 2.5 && view.re - view.half <= -1 && view.im - view.half <= -1 && view.im - view.half > -9);
});

test("labels keep clear of one another", () => {
  const frame = { left: 0, top: 0, right: 400, bottom: 400 };
  const first = geometry.freeSpot({ x: 200, y: 200, text: "one", clear: 8 }, frame, [], []);
  const second = geometry.freeSpot({ x: 200, y: 200, text: "two", clear: 8 }, frame, [first], []);
  assert.ok(second.left >= first.right || second.right <= first.left || second.top >= first.bottom || second.bottom <= first.top);
});

test("a line that nothing excites is told from the others", () => {
  const line = curves.measuredBode({ frequency_hz: [1, 2, 3, 4], real: [1, 1, 1, 1], imag: [0, 0, 0, 0], std: [0.1, 0.6, null, 0.1], coherence: [0.9, 0.9, null, 0.1] }, 0.95);
  assert.deepEqual(line.map((p) => p.weak), [false, true, false, true]);
});

test("a coherence has its band, and one measured beside the points does not make them weak", () => {
  const columns = { frequency_hz: [1, 2], real: [1, 1], imag: [0, 0], std: [0.1, 0.1], coherence: [0.98, 0.1], coherence_std: [0.05, null] };
  const [a, b] = curves.measuredBode(columns, 0.6827, [], false);
  assert.ok(Math.abs(a.coherenceLow - 0.93) < 1e-4 && a.coherenceHigh === 1);
  assert.ok(b.coherenceLow === null && b.coherenceHigh === null && !b.weak);
  assert.ok(curves.measuredBode(columns, 0.6827)[1].weak);
});

test("the cards hold the inertia ratio, and Ms and Mt beside the modulus margin", () => {
  const cards = tables.keyFigures({ resonances: [{ kind: "resonance", frequency_hz: 15, std_hz: 0.1 }], loop: { modulus_margin: 0.8 },
    page: { inertia_ratio: { value: 1.25, std: 0.01 }, peaks: { ms: 1.25, mt: 1.1 } } });
  const ratio = cards.find((c) => c.name === "Inertia ratio");
  assert.equal(ratio.value, "1.250");
  assert.equal(ratio.half, "0.020");
  assert.match(cards.find((c) => c.name === "Modulus margin").under, /Ms 1\.25, Mt 1\.10/);
});

test("a planned loop's margins stand beside those of the loop that ran", () => {
  const loop = { crossover_hz: 2.7, phase_margin_deg: 63.5 };
  const planned = { loop: { crossover_hz: 4.6, crossover_std_hz: 0.05, gain_margin_db: 13.4 } };
  assert.deepEqual(nyquist.marginRows({ loop, marks: {}, planned, factor: 2 }).map((r) => r.slice(0, 3)),
    [["Crossover", "2.70 Hz", "4.60 ± 0.10 Hz"], ["Phase margin", "63.5 °", "–"], ["Gain margin", "–", "13.4 dB"]]);
  assert.equal(nyquist.marginRows({ loop, marks: {}, planned: null, factor: 2 })[0].length, 3);
});

test("a planned loop shows the least of its phase margins, and every crossing", () => {
  const crossings = [{ frequency_hz: 9.29, phase_margin_deg: 69.8, phase_margin_std_deg: 1.6, falling: true },
    { frequency_hz: 43.9, phase_margin_deg: -9.5, falling: false }];
  const data = { planned_loop: { phase_margin_deg: 69.8 }, page: { planned_crossings: crossings }, findings: [{ id: "planned-may-be-unstable" }] };
  const planned = nyquist.plannedOf(data, []);
  assert.equal(planned.title, "Planned: may be unstable");
  const phase = nyquist.marginRows({ loop: {}, marks: {}, planned, factor: 2 }).find((r) => r[0] === "Phase margin");
  assert.equal(phase[2], "−9.50 ° at 43.9 Hz");
  assert.deepEqual(nyquist.crossingRows({ crossings, factor: 2 }).map((r) => r.slice(0, 2)), [["9.29 Hz", "falls"], ["43.9 Hz", "rises"]]);
  assert.deepEqual(nyquist.crossingRows({ crossings: crossings.slice(0, 1), factor: 2 }), []);
});

test("of a planned loop that is not judged no margin is shown", () => {
  const planned = nyquist.plannedOf({ planned_loop: { modulus_margin: 0.8 }, findings: [{ id: "planned-not-judged" }] }, []);
  assert.equal(planned.title, "Planned: not known");
  assert.deepEqual(nyquist.marginRows({ loop: { modulus_margin: 0.9 }, marks: {}, planned, factor: 2 }).map((r) => r[2]), ["–"]);
});

test("the frequency axis reaches for the lines that say something", () => {
  const line = (f, weak) => ({ f, weak });
  const model = [0.1, 1, 10, 100].map((f) => line(f));
  assert.deepEqual(curves.shownBand([line(0.2, true), line(5, false), line(20, false), line(90, true)], model), [3.5, 28]);
  assert.deepEqual(curves.shownBand([line(0.2, true), line(90, true)], model), [0.1, 100]);
  assert.deepEqual(curves.shownBand([], model), [0.1, 100]);
});

test("what the reader found stands beside what was recorded", () => {
  let html = "";
  const box = { insertAdjacentHTML: (_, added) => { html += added; } };
  globalThis.document = { createElement: () => box };
  tables.recordTable({ append: () => {} }, { record: { file: "r.csv", samples: 100, reading: ["decimal comma", "no unit in 'u': Nm assumed"] }, method: "welch" });
  delete globalThis.document;
  assert.match(html, />Reader<.*decimal comma; no unit in/);
});
