// SPDX-License-Identifier: MIT
// The arithmetic of a document's charts, without a browser.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

const web = "../../../src/report/web/";
const series = await import(web + "series.js");
const plane = await import(web + "plane.js");
const heat = await import(web + "heat.js");

const chart = {
  section: 1, x_label: "t", log_x: false,
  curves: [{ name: "a", mark: "line", x: [0, 1, 2], y: [5, null, 7] }, { name: "b", mark: "points", x: [0.5, 2], y: [1, 2], at: [9, null] }],
};

test("gaps of a curve stay gaps, places that it lacks are passed over", () => {
  const columns = series.columnsOf(series.curvesOf(chart));
  assert.deepEqual(columns[0], [0, 0.5, 1, 2]);
  assert.deepEqual(columns[1], [5, undefined, null, 7]);
  assert.deepEqual(columns[2], [undefined, 1, undefined, 2]);
});

test("what cannot be drawn drops out", () => {
  const [only] = series.curvesOf({ log_x: true, curves: [{ name: "x", x: [0, 1, "2", null], y: [1, "a", 2, 3] }] });
  assert.deepEqual(only.points, [{ x: 1, y: null, at: null }]);
  assert.deepEqual(series.curvesOf({}), []);
});

test("colours begin again after the last", () => {
  const many = series.curvesOf({ curves: Array.from({ length: series.COLOURS + 1 }, () => ({})) });
  assert.equal(many[series.COLOURS].colour, many[0].colour);
  assert.notEqual(many[1].colour, many[0].colour);
});

test("the reading is the nearest point, none beyond a curve's ends", () => {
  const points = [1, 2, 4, 8].map((x) => ({ x, y: 10 * x }));
  assert.equal(series.pointAt(points, 2.9).y, 20);
  assert.equal(series.pointAt(points, 3.1).y, 40);
  assert.equal(series.pointAt(points, 2.9, true).y, 40); // nearer in ratio
  assert.equal(series.pointAt(points, 8.1).y, 80);
  assert.equal(series.pointAt(points, 80), null);
  assert.equal(series.pointAt([], 1), null);
});

test("extents leave gaps out, and are never empty", () => {
  assert.deepEqual(series.extentOf(series.curvesOf(chart)), { x: [0, 2], y: [1, 7] });
  assert.deepEqual(series.extentOf([]), { x: [0, 1], y: [0, 1] });
});

test("a plane holds all its points and is no narrow strip", () => {
  const view = plane.viewOf({ x: [0, 10], y: [-1, 1] });
  assert.ok(view.wide >= 10 && view.high >= 5);
  const point = plane.viewOf({ x: [3, 3], y: [4, 4] });
  assert.ok(point.wide > 0 && point.high > 0);
});

test("a curve in a plane is not drawn across its gaps, whichever coordinate they lack", () => {
  const map = { x: (v) => v, y: (v) => v };
  const path = (x, y) => plane.pathOf(series.curvesOf({ equal_axes: true, curves: [{ name: "loop", x, y }] })[0].points, map);
  assert.equal(path([0, 1, 2, 3], [4, 5, 6, 7]), "M0.0 4.0L1.0 5.0L2.0 6.0L3.0 7.0");
  assert.equal(path([0, 1, 2, 3, 4], [4, 5, null, 7, 8]), "M0.0 4.0L1.0 5.0M3.0 7.0L4.0 8.0");
  assert.equal(path([0, 1, null, 3, 4], [4, 5, null, 7, 8]), "M0.0 4.0L1.0 5.0M3.0 7.0L4.0 8.0");
  assert.equal(path([0, 1, null, 3, 4], [4, 5, 6, 7, 8]), "M0.0 4.0L1.0 5.0M3.0 7.0L4.0 8.0");
  const [gap] = series.curvesOf({ equal_axes: true, curves: [{ name: "loop", x: [0, null, 3], y: [4, null, 7] }] });
  assert.deepEqual(series.extentOf([gap]), { x: [0, 3], y: [4, 7] });
});

test("a band is a stretch of points that have both bounds", () => {
  const [curve] = series.curvesOf({ curves: [{ name: "band", mark: "band", x: [0, 1, 2, 3, 4, 5], lower: [0, 1, null, 3, 4, 5], upper: [1, 2, 3, 4, null, 6] }] });
  assert.deepEqual(series.bandsOf(curve.points).map((s) => s.map((p) => p.x)), [[0, 1]]);
  assert.deepEqual(series.extentOf([curve]), { x: [0, 5], y: [0, 6] });
});

test("regions of one name share a colour, and what is no number lies at the edge", () => {
  const [a, b, c] = series.shapesOf({ shapes: [
    { kind: "rectangle", name: "fixed", x: 1, y: null, x_end: 2, y_end: null }, { kind: "circle", name: "unit", x: 0, y: 0, radius: 1 },
    { kind: "rectangle", name: "fixed", x: 3, x_end: 4 }] });
  assert.equal(a.colour, c.colour);
  assert.notEqual(a.colour, b.colour);
  assert.deepEqual([a.x, a.y, a.xEnd, a.yEnd], [1, -Infinity, 2, Infinity]);
});

test("a circle named after a curve has its colour, and only what speaks against the data is red", () => {
  const shapes = series.shapesOf({ curves: [{ name: "a.csv", x: [], y: [] }, { name: "b.csv", x: [], y: [] }], shapes: [
    { kind: "circle", name: "unit circle", x: 0, y: 0, radius: 1 }, { kind: "circle", name: "b.csv: modulus margin 0.8", x: -1, y: 0, radius: 0.8 },
    { kind: "rectangle", name: "not trusted", x: 1, x_end: 2 }, { kind: "rectangle", name: "judged", x: 1, x_end: 2 }] });
  assert.deepEqual(shapes.slice(0, 2).map((s) => s.colour), ["soft", "c1"]);
  const alone = (name) => series.shapesOf({ shapes: [{ kind: "rectangle", name, x: 1, x_end: 2 }] })[0].colour;
  assert.equal(alone("not trusted"), "r0");
  assert.notEqual(alone("judged"), "r0");
});

test("bounds have one colour, whether a second curve stands before them or not", () => {
  const colours = (names) => series.curvesOf({ curves: names.map((name) => ({ name })) }).map((c) => c.colour);
  assert.deepEqual(colours(["PI", "running controller", "bound 1.4"]), ["c0", "c1", "c2"]);
  assert.deepEqual(colours(["cascade", "bound 1.05"]), ["c0", "c2"]);
  assert.deepEqual(colours(["bound 1.4", "PI"]), ["c2", "c0"]);
});

test("a model has the colour of what it was fitted to", () => {
  const curves = series.curvesOf({ curves: ["a.csv", "b.csv", "model of a.csv", "model of b.csv", "other"].map((name) => ({ name })) });
  assert.deepEqual(curves.map((c) => c.colour), ["c0", "c1", "c0", "c1", "c2"]);
});

test("a range must be two ascending numbers", () => {
  assert.deepEqual(series.rangeOf([1, 2]), [1, 2]);
  for (const wrong of [undefined, [2, 1], [1], [1, null], "12"]) assert.equal(series.rangeOf(wrong), null);
});

test("what says little is drawn, and no axis reaches for it", () => {
  const curves = series.curvesOf({ curves: [
    { name: "measured", mark: "points", x: [1, 2], y: [5, 6] }, { name: "hardly excited", mark: "faint", x: [3, 4], y: [90, -90] },
    { name: "model", mark: "dashed", x: [1, 2], y: [5, 6] }] });
  assert.deepEqual(series.extentOf(curves), { x: [1, 2], y: [5, 6] });
  assert.equal(curves[1].colour, curves[0].colour);
  assert.notEqual(curves[2].colour, curves[0].colour);
  assert.equal(curves[1].points.length, 2);
  assert.deepEqual(series.extentOf([curves[1]]), { x: [3, 4], y: [-90, 90] }); // unless there is nothing else
});

test("cells of a heat map meet half-way, in ratio on a logarithmic axis", () => {
  assert.deepEqual(heat.edgesOf([0, 2, 4]), [-1, 1, 3, 5]);
  const edges = heat.edgesOf([1, 4, 16], true);
  [0.5, 2, 8, 32].forEach((e, i) => assert.ok(Math.abs(edges[i] - e) < 1e-9));
  assert.deepEqual(heat.edgesOf([]), []);
});

test("a heat map's colours span its values, whatever strays", () => {
  const rows = [Array.from({ length: 500 }, (_, i) => i), [null, 1e9]];
  const [low, high] = heat.scaleOf(rows);
  assert.ok(low >= 0 && low < 10 && high < 500);
  assert.deepEqual(heat.scaleOf([[null]]), [0, 1]);
  assert.deepEqual(heat.scaleOf([[3, 3]]), [2, 4]);
  assert.equal(heat.shade(-1), "rgb(68,1,84)");
  assert.equal(heat.shade(2), "rgb(253,231,37)");
});

// WCAG 2.1, 1.4.3 and 1.4.11: relative luminance and contrast ratio.
const luminance = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255)
  .map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)).reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
const contrast = (a, b) => {
  const [high, low] = [luminance(a), luminance(b)].sort((x, y) => y - x);
  return (high + 0.05) / (low + 0.05);
};

test("contrast is computed as the standard has it", () => {
  assert.ok(Math.abs(contrast("#000000", "#ffffff") - 21) < 1e-9);
  assert.ok(Math.abs(contrast("#777777", "#ffffff") - 4.48) < 0.01); // the known near miss
});

for (const theme of ["light", "dark"]) {
  test(`text and curves of the ${theme} palette meet WCAG AA`, () => {
    const css = readFileSync(new URL(web + "page.css", import.meta.url), "utf8");
    const blocks = [...css.matchAll(/:root(?::not\(\.printing\))? \{([^}]*--[^}]*)\}/g)];
    const dark = blocks.filter((b) => b[0].includes(":not(.printing)"));
    const light = blocks.filter((b) => !b[0].includes(":not(.printing)"));
    const palette = {};
    for (const block of [...light, ...(theme === "dark" ? dark : [])]) {
      for (const [, name, value] of block[1].matchAll(/--([a-z0-9-]+): (#[0-9a-f]{6});/g)) palette[name] = value;
    }
    const text = ["ink", "soft", "measured", "model", "good", "bad", "note", "resonance", "antiresonance"];
    const soft = [["good", "good-soft"], ["bad", "bad-soft"], ["note", "note-soft"], ["ink", "page"], ["soft", "page"], ["ink", "good-soft"]];
    for (const [front, back] of [...text.map((name) => [name, "card"]), ...soft]) {
      assert.ok(contrast(palette[front], palette[back]) >= 4.5, `${front} on ${back}: ${contrast(palette[front], palette[back])}`);
    }
    const drawn = ["noise", "distortion", "load", "signal", ...Array.from({ length: 8 }, (_, i) => `c${i}`), "r0", "r1", "r2", "r3"];
    for (const name of drawn) assert.ok(contrast(palette[name], palette.card) >= 3, `${name}: ${contrast(palette[name], palette.card)}`);
  });
}
