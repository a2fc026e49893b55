// SPDX-License-Identifier: MIT
// From complex values to what the pictures draw. Pure functions.
import { isNumber, list, normalFactor, regionFactor } from "./format.js";

const DEGREES = 180 / Math.PI;
const toDb = (x) => 20 * Math.log10(x);
/** A lower bound at or below zero has no decibels: the band ends this far under its point. */
const FLOOR_DB = 30;
/** A line with more relative error than this says nothing about the turn its neighbours are on. */
const RELIABLE = 0.3;
/** A line known worse than this says nothing: nothing excites it. Drawn faint, and no axis reaches for it. */
const SAYS_NOTHING = 0.5;
const INCOHERENT = 0.3;

/** Columns -> points in ascending frequency; lines without a usable value drop out. */
export function points(columns) {
  const frequency = list(columns && columns.frequency_hz);
  const out = [];
  frequency.forEach((f, i) => {
    const re = list(columns.real)[i];
    const im = list(columns.imag)[i];
    if (!isNumber(f) || f <= 0 || !isNumber(re) || !isNumber(im)) return;
    const std = list(columns.std)[i];
    const coherence = list(columns.coherence)[i];
    const coherenceStd = list(columns.coherence_std)[i];
    const level = (name) => {
      const value = list(columns[name])[i];
      return isNumber(value) && value > 0 ? toDb(value) : null;
    };
    out.push({
      f, re, im, abs: Math.hypot(re, im), phase: Math.atan2(im, re) * DEGREES,
      noiseDb: level("noise_std"), distortionDb: level("distortion_std"),
      std: isNumber(std) && std >= 0 ? std : null,
      coherence: isNumber(coherence) ? coherence : null,
      coherenceStd: isNumber(coherence) && isNumber(coherenceStd) ? coherenceStd : null,
    });
  });
  return out.sort((a, b) => a.f - b.f);
}

export const wrapDegrees = (x) => x - 360 * Math.round(x / 360);

/** A phase that runs on without jumps, started so that its median lies within -270 ... 90: drives lag. */
export function unwrap(phases, reliable = () => true) {
  let previous = null;
  const out = phases.map((phase, i) => {
    const value = previous === null ? phase : previous + wrapDegrees(phase - previous);
    if (reliable(i)) previous = value;
    return value;
  });
  if (out.length === 0) return out;
  const sorted = [...out].sort((a, b) => a - b);
  const turns = 360 * Math.round((sorted[sorted.length >> 1] + 90) / 360);
  return out.map((x) => x - turns);
}

/** Linear interpolation over log frequency, constant beyond both ends. */
export function interpolate(frequencies, values, f) {
  const last = frequencies.length - 1;
  if (f <= frequencies[0]) return values[0];
  if (f >= frequencies[last]) return values[last];
  let low = 0;
  let high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (frequencies[middle] <= f) low = middle;
    else high = middle;
  }
  const share = Math.log(f / frequencies[low]) / Math.log(frequencies[high] / frequencies[low]);
  return values[low] + share * (values[high] - values[low]);
}

/** Magnitude in dB and continuous phase in degrees of a model curve, with the bounds that its covariance gives them. */
export function modelBode(columns, confidence = 0.95) {
  const line = points(columns);
  const phase = unwrap(line.map((p) => p.phase));
  const factor = regionFactor(confidence);
  return line.map((p, i) => {
    const point = { ...p, db: p.abs > 0 ? toDb(p.abs) : null, degrees: phase[i] };
    if (!p.std || point.db === null) return point;
    const around = bounds(p.abs, p.std * factor);
    return { ...point, dbLow: around.low, dbHigh: around.high, degreesLow: phase[i] - around.angle, degreesHigh: phase[i] + around.angle };
  });
}

/** Measured points with the bounds of their confidence region. The phase follows the model where there is one:
 *  a noisy line then lands on the right turn by itself. `ownCoherence`: the coherence is that of the points' own measurement, and
 *  tells which of them say nothing. */
export function measuredBode(columns, confidence, model = [], ownCoherence = true) {
  const line = points(columns);
  const grid = model.map((p) => p.f);
  const curve = model.map((p) => p.degrees);
  const phase = model.length
    ? line.map((p) => {
        const expected = interpolate(grid, curve, p.f);
        return expected + wrapDegrees(p.phase - expected);
      })
    : unwrap(line.map((p) => p.phase), (i) => line[i].std === null || line[i].std < RELIABLE * line[i].abs);
  const unsettled = list(columns && columns.unsettled_hz).filter(isNumber);
  const factor = regionFactor(confidence);
  const real = normalFactor(confidence);
  return line.map((p, i) => {
    const radius = p.std === null ? null : p.std * factor;
    const db = p.abs > 0 ? toDb(p.abs) : null;
    const half = p.coherenceStd === null ? null : real * p.coherenceStd;
    const around = radius === null || db === null ? null : bounds(p.abs, radius);
    return {
      ...p, radius, db, degrees: phase[i],
      weak: (p.std !== null && p.std > SAYS_NOTHING * p.abs) || (ownCoherence && p.coherence !== null && p.coherence < INCOHERENT),
      settled: !unsettled.some((f) => Math.abs(f - p.f) <= 1e-6 * p.f),
      coherenceHalf: half,
      coherenceLow: half === null ? null : Math.max(0, p.coherence - half), coherenceHigh: half === null ? null : Math.min(1, p.coherence + half),
      dbLow: around && around.low, dbHigh: around && around.high,
      degreesLow: around && phase[i] - around.angle, degreesHigh: around && phase[i] + around.angle,
    };
  });
}

/** The frequencies that are shown: the lines that say something, with a little of the model beyond them; all where none does. */
export function shownBand(measured, model) {
  const ends = (line) => line.reduce(([low, high], p) => [Math.min(low, p.f), Math.max(high, p.f)], [Infinity, -Infinity]);
  const [low, high] = ends([...measured, ...model]);
  const strong = measured.filter((p) => !p.weak);
  if (strong.length < 2) return [low, high];
  const [first, last] = ends(strong);
  return [Math.max(low, 0.7 * first), Math.min(high, 1.4 * last)];
}

/** The disc of `radius` around a value of modulus `abs`, as extremes of magnitude and angle. */
function bounds(abs, radius) {
  const floor = toDb(abs) - FLOOR_DB;
  return {
    low: radius < abs ? Math.max(floor, toDb(abs - radius)) : floor,
    high: toDb(abs + radius),
    angle: radius < abs ? Math.asin(radius / abs) * DEGREES : 180,
  };
}

/** The tube around a curve in the complex plane that the discs of its points fill, as one closed line. */
export function tube(curve, radius) {
  const [left, right] = [[], []];
  curve.forEach((p, i) => {
    const [a, b] = [curve[Math.max(0, i - 1)], curve[Math.min(curve.length - 1, i + 1)]];
    const length = Math.hypot(b.re - a.re, b.im - a.im);
    if (!(length > 0) || !isNumber(radius[i])) return;
    const [x, y] = [(-(b.im - a.im) / length) * radius[i], ((b.re - a.re) / length) * radius[i]];
    left.push({ re: p.re + x, im: p.im + y });
    right.push({ re: p.re - x, im: p.im - y });
  });
  return [...left, ...right.reverse()];
}

/** One ascending axis for curves of different grids; columns get null where they have no point. */
export function align(grids, columns) {
  const x = [...new Set(grids.flat())].sort((a, b) => a - b);
  const index = new Map(x.map((value, i) => [value, i]));
  return [x, ...columns.map(({ grid, values }) => {
    const out = new Array(x.length).fill(null);
    grids[grid].forEach((value, i) => { out[index.get(value)] = values[i] ?? null; });
    return out;
  })];
}

/** Limits of an axis: the points with a margin, and of the bands no more than `allow` beyond the points. */
export function limits(values, bandValues, { allow = Infinity, margin = 0.06, least = 1 } = {}) {
  let low = Infinity;
  let high = -Infinity;
  for (const v of values) if (isNumber(v)) { low = Math.min(low, v); high = Math.max(high, v); }
  if (low > high) return [0, 1];
  const [inner, outer] = [low - allow, high + allow];
  for (const v of bandValues) {
    if (isNumber(v)) { low = Math.min(low, Math.max(v, inner)); high = Math.max(high, Math.min(v, outer)); }
  }
  const extra = Math.max(margin * (high - low), 0.5 * (least - (high - low)), 1e-12);
  return [low - extra, high + extra];
}

export function nearest(line, f) {
  let best = null;
  for (const p of line) {
    if (!best || Math.abs(Math.log(p.f / f)) < Math.abs(Math.log(best.f / f))) best = p;
  }
  return best;
}
