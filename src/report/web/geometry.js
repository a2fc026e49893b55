// SPDX-License-Identifier: MIT
// What part of the complex plane is shown, and where its labels go. Pure functions.

/** A square view: the unit circle, the point -1 with its circle, and the curve as far as it stays near them. */
export function homeView(curve, measured, marks) {
  const shown = [[-1.15, 0], [1, 0], [0, 1], [0, -1]];
  for (const mark of Object.values(marks)) shown.push([mark.real, mark.imag]);
  if (marks.modulus) {
    const r = Math.min(marks.modulus.radius, 2);
    shown.push([-1 - r, 0], [-1, r], [-1, -r]);
  }
  // Below the crossover an integrator runs far out; what matters is past it, resonance lobes included.
  const from = marks.crossover && marks.crossover.frequency_hz > 0 ? 0.8 * marks.crossover.frequency_hz : 0;
  for (const p of [...curve, ...measured]) {
    if (p.f >= from && p.abs <= 4) shown.push([p.re, p.im]);
  }
  const range = (i) => {
    let [low, high] = [Infinity, -Infinity];
    for (const s of shown) { low = Math.min(low, s[i]); high = Math.max(high, s[i]); }
    return [low, high];
  };
  const [reLow, reHigh] = range(0);
  const [imLow, imHigh] = range(1);
  return viewAround(reLow, imLow, reHigh, imHigh, 1.1);
}

/** The smallest square view that holds a rectangle. */
export function viewAround(re1, im1, re2, im2, room = 1) {
  const half = Math.max(Math.abs(re1 - re2), Math.abs(im1 - im2), 1e-6) / 2;
  return { re: (re1 + re2) / 2, im: (im1 + im2) / 2, half: half * room };
}

/** The arc at `radius` from the negative real axis to the ray of the crossover: the phase margin. */
export function arcEnds(crossover, radius) {
  let angle = Math.atan2(crossover.imag, crossover.real);
  const margin = angle <= 0 ? angle + Math.PI : angle - Math.PI; // signed, from -180 degrees
  angle = -Math.PI + margin;
  const at = (a) => [radius * Math.cos(a), radius * Math.sin(a)];
  return {
    from: at(-Math.PI), to: at(angle), middle: at(-Math.PI + margin / 2), margin,
    large: Math.abs(margin) > Math.PI ? 1 : 0,
    sweep: margin > 0 ? 0 : 1, // screen y points down
  };
}

const LETTER = 6.9;
const LINE = 16;

/** The first place around a point, from near to far, where a label of its length touches nothing; else the least bad. */
export function freeSpot(label, frame, taken, line) {
  const width = label.text.length * LETTER;
  let best = null;
  for (const away of [label.clear, label.clear + 14, label.clear + 30]) {
    for (const [h, v] of [[1, -1], [1, 1], [-1, -1], [-1, 1], [0, -1], [0, 1], [1, 0], [-1, 0]]) {
      const x = label.x + h * away - (h < 0 ? width : h === 0 ? width / 2 : 0);
      const y = label.y + v * away * 0.8 - LINE / 2 + (v * LINE) / 2;
      const spot = { left: x, right: x + width, top: y, bottom: y + LINE };
      const out = spot.left < frame.left + 2 || spot.right > frame.right - 2 || spot.top < frame.top + 2 || spot.bottom > frame.bottom - 2;
      const touches = taken.filter((t) => spot.left < t.right && spot.right > t.left && spot.top < t.bottom && spot.bottom > t.top).length;
      const crossed = line.filter(([px, py]) => px > spot.left - 2 && px < spot.right + 2 && py > spot.top && py < spot.bottom).length;
      const cost = (out ? 1000 : 0) + 100 * touches + (crossed ? 20 : 0) + away / 10;
      if (!best || cost < best.cost) best = { ...spot, cost };
    }
  }
  return best;
}
