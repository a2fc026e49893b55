// SPDX-License-Identifier: MIT
// Pole-zero picture and the model's tube: pure functions of the report page.
import assert from "node:assert/strict";
import test from "node:test";
import { modelBode, tube } from "../../../src/report/web/curves.js";
import { ellipseOf, rootsOf, viewOfRoots } from "../../../src/report/web/roots.js";

const pole = { real: -3, imag: 4, covariance: [[0.04, 0.01], [0.01, 0.09]] };

test("the ellipse keeps its distance in units of the covariance", () => {
  const radius = 2.4477;
  const points = ellipseOf(pole, radius);
  const [[a, b], [, d]] = pole.covariance;
  const det = a * d - b * b;
  for (const [x, y] of points) {
    const [dx, dy] = [x - pole.real, y - pole.imag];
    assert.ok(Math.abs((d * dx * dx - 2 * b * dx * dy + a * dy * dy) / det - radius * radius) < 1e-9);
  }
  assert.ok(points.length > 30);
});

test("a root that is known exactly has no ellipse, a real one a line", () => {
  assert.deepEqual(ellipseOf({ real: -1, imag: 0 }, 2), []);
  assert.deepEqual(ellipseOf({ real: -1, imag: 0, covariance: [[0, 0], [0, 0]] }, 2), []);
  for (const [, y] of ellipseOf({ real: -1, imag: 0, covariance: [[0.25, 0], [0, 0]] }, 2)) assert.equal(y, 0);
});

test("frequency and damping ratio of a pole carry its errors", () => {
  const [root] = rootsOf({ poles: [pole, { ...pole, imag: -4 }] }, 0.95);
  assert.equal(root.size, 5);
  assert.equal(root.ratio, 0.6);
  // d|s| = (-3 dx + 4 dy)/5; zeta = -re/|s|: d zeta = -(16 dx + 12 dy)/125
  assert.ok(Math.abs(root.sizeStd - Math.sqrt((9 * 0.04 - 24 * 0.01 + 16 * 0.09) / 25)) < 1e-12);
  assert.ok(Math.abs(root.ratioStd - Math.sqrt(256 * 0.04 + 384 * 0.01 + 144 * 0.09) / 125) < 1e-12);
});

test("the lower half mirrors the upper and is left out; broken entries are passed over", () => {
  const roots = rootsOf({ poles: [pole, { real: -3, imag: -4 }, { real: "x", imag: 1 }, null], zeros: [{ real: -1, imag: 2 }] }, 0.95);
  assert.deepEqual(roots.map((r) => r.kind), ["pole", "zero"]);
  assert.deepEqual(rootsOf({}, 0.95), []);
});

test("the view holds every root, its ellipse and the origin", () => {
  const roots = rootsOf({ poles: [pole], zeros: [{ real: -1, imag: 9 }] }, 0.95);
  const view = viewOfRoots(roots);
  for (const [x, y] of [[0, 0], [-3, 4], [-1, 9], ...roots[0].ellipse]) {
    assert.ok(view.left < x && x < view.right && view.bottom < y && y < view.top, `${x}, ${y}`);
  }
});

test("the tube lies at the radius on both sides of the curve", () => {
  const curve = [0, 1, 2, 3].map((re) => ({ re, im: 1 }));
  const around = tube(curve, [0.1, 0.2, 0.2, 0.1]);
  assert.equal(around.length, 8);
  assert.deepEqual(around.slice(0, 4).map((p) => Math.round(10 * (p.im - 1))), [1, 2, 2, 1]);
  assert.deepEqual(around.slice(4).map((p) => Math.round(10 * (p.im - 1))), [-1, -2, -2, -1]);
  assert.deepEqual(tube(curve, [null, null, null, null]), []);
});

test("the model's band is that of its standard deviation", () => {
  const columns = { frequency_hz: [1], real: [2], imag: [0], std: [0.1] };
  const [p] = modelBode(columns, 1 - Math.exp(-1)); // radius = std
  assert.ok(Math.abs(p.dbHigh - 20 * Math.log10(2.1)) < 1e-9 && Math.abs(p.dbLow - 20 * Math.log10(1.9)) < 1e-9);
  assert.equal("dbLow" in modelBode({ frequency_hz: [1], real: [2], imag: [0] })[0], false);
});
