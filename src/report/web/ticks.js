// SPDX-License-Identifier: MIT
// Where an axis carries its numbers. Pure functions.

/** Round steps of 1, 2, 5 over a linear axis. */
export function linearTicks(low, high, most = 6) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const rough = span / Math.max(1, most);
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step = decade * [1, 2, 5, 10].find((m) => m * decade >= rough * (1 - 1e-9));
  return multiples(low, high, step);
}

/** Steps that an engineer counts a phase in. */
export function phaseTicks(low, high, most = 6) {
  const step = [5, 10, 15, 30, 45, 90, 180, 360].find((s) => (high - low) / s <= most) ?? 720;
  return multiples(low, high, step);
}

/** Steps of decibels: 1, 2, 3, 5, 10, 20, 40. */
export function decibelTicks(low, high, most = 6) {
  const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 40].find((s) => (high - low) / s <= most) ?? 80;
  return multiples(low, high, step);
}

function multiples(low, high, step) {
  const out = [];
  const digits = Math.max(0, 2 - Math.floor(Math.log10(step)));
  const slack = 1e-9 * step;
  for (let k = Math.ceil((low - slack) / step); k * step <= high + slack; ++k) {
    out.push(Number((k * step).toFixed(Math.min(digits, 12))) + 0);
  }
  return out;
}

/** Grid lines of a logarithmic axis (1 ... 9 per decade); a zoomed axis of half a decade counts linearly. */
export function logTicks(low, high) {
  if (!(low > 0) || !(high > low)) return [];
  if (high / low < 3.5) return linearTicks(low, high, 7).filter((x) => x > 0);
  const out = [];
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); ++e) {
    for (let m = 1; m <= 9; ++m) {
      const x = Number((m * 10 ** e).toPrecision(3));
      if (x >= low * (1 - 1e-9) && x <= high * (1 + 1e-9)) out.push(x);
    }
  }
  return out;
}

/** Of logTicks(), those that carry a number: as many of 1, 2, 5, then 3, then the rest, as keep `gap` pixels apart. */
export function logLabels(ticks, low, high, width, gap = 34) {
  const place = (x) => (width * Math.log(x / low)) / Math.log(high / low);
  const chosen = [];
  const rank = (x) => {
    const mantissa = Math.round(Number((x / 10 ** Math.floor(Math.log10(x) + 1e-9)).toPrecision(2)) * 10) / 10;
    return mantissa === 1 ? 0 : mantissa === 2 || mantissa === 5 ? 1 : mantissa === 3 ? 2 : 3;
  };
  for (const level of [0, 1, 2, 3]) {
    for (const x of ticks) {
      if (rank(x) === level && chosen.every((c) => Math.abs(place(c) - place(x)) >= gap)) chosen.push(x);
    }
  }
  return new Set(chosen);
}
