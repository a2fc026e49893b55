// SPDX-License-Identifier: MIT
// Numbers, units and words as a reader wants them. Pure functions.

export const isNumber = (x) => typeof x === "number" && Number.isFinite(x);
export const list = (x) => (Array.isArray(x) ? x : []);

/** Everything shown that came from the data passes here before it becomes markup. */
export function escapeHtml(text) {
  const map = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#39;" };
  return String(text).replace(/[&<>"']/g, (c) => map[c]);
}

const SUPERSCRIPT = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
const minus = (text) => text.replace("-", "−");

export const superscript = (whole) => [...String(whole)].map((c) => SUPERSCRIPT[c]).join("");
const powerOfTen = (exponent) => "10" + superscript(exponent);

/** A number with `digits` significant digits; a power of ten only where it saves the reader from counting zeros. */
export function significant(value, digits = 4) {
  if (!isNumber(value)) return "–";
  if (value === 0) return "0";
  const rounded = Number(value.toPrecision(digits));
  const exponent = Math.floor(Math.log10(Math.abs(rounded)));
  if (exponent < -4 || exponent >= 6) {
    const mantissa = (rounded / 10 ** exponent).toPrecision(digits);
    return `${minus(mantissa)}×${powerOfTen(exponent)}`;
  }
  return minus(rounded.toFixed(Math.max(0, digits - 1 - exponent)));
}

/** As significant(), without the zeros at its end: for axes and thresholds. */
export function plain(value, digits = 4) {
  const text = significant(value, digits);
  return text.includes("×") || !text.includes(".") ? text : text.replace(/0+$/, "").replace(/\.$/, "");
}

/** Value and half-width of its interval, both ended at the second digit of the half-width. */
export function plusMinus(value, half) {
  if (!isNumber(value)) return { value: "–", half: "" };
  if (!isNumber(half) || half <= 0) return { value: significant(value), half: "" };
  const top = Math.floor(Math.log10(Number(half.toPrecision(2))));
  const size = value === 0 ? top : Math.floor(Math.log10(Math.abs(value)));
  const largest = Math.max(size, top);
  const scale = largest < -3 || largest >= 6 ? largest : 0;
  const decimals = Math.min(12, Math.max(0, 1 - top + scale));
  // Written to 2 digits even where that leaves zeros before the point: 1200, not 1234.
  const halfRounded = Number(half.toPrecision(2)) / 10 ** scale;
  return {
    value: minus((value / 10 ** scale).toFixed(decimals)),
    half: halfRounded.toFixed(decimals),
    times: scale === 0 ? "" : `×${powerOfTen(scale)}`,
  };
}

/** plusMinus() in one line, with its unit. */
export function interval(value, half, unit = "") {
  const parts = plusMinus(value, half);
  const tail = unit ? " " + prettyUnit(unit) : "";
  if (!parts.half) return parts.value + tail;
  const body = `${parts.value} ± ${parts.half}`;
  return (parts.times ? `(${body})${parts.times}` : body) + tail;
}

/** kgm2 -> kg m2, Nms/rad -> Nm s/rad. */
const wholeUnits = (text) => String(text ?? "").replace(/\bkgm2\b/g, "kg m2").replace(/\bNms\/rad\b/g, "Nm s/rad").replace(/\bNs\/m\b/g, "N s/m");

/** kgm2 -> kg m², V s2/rad -> V s²/rad. */
export function prettyUnit(unit) {
  return wholeUnits(unit).replace(/([A-Za-z])([23])(?![A-Za-z0-9])/g, (_, letter, digit) => letter + SUPERSCRIPT[digit]);
}

/** A text with signs and the powers of its units: "0.1 +- 0.01 kgm2" -> "0.1 ± 0.01 kg m²". */
export function powers(text) {
  return wholeUnits(text).replace(/\bkg m2\b/g, "kg m²").replace(/\)\^2/g, ")²").replace(/\/s2\b/g, "/s²")
    .replace(/(^|[ (])\+-(?=[ \d])/g, "$1±");
}

/** "low-coherence" and "driven_inertia" ("motor inertia") as words. */
export function words(id) {
  const text = String(id).replace(/[-_]+/g, " ").trim().replace(/^driven /, "motor ").replace(/^antiresonance/, "anti-resonance").replace(/^coulomb friction/, "dry friction");
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** Half-width of a real normal quantity's interval in standard deviations: 1.96 at 0.95. */
export function normalFactor(confidence) {
  const target = Math.min(Math.max(confidence, 0), 1 - 1e-12);
  let low = 0;
  let high = 8;
  for (let i = 0; i < 60; ++i) {
    const middle = 0.5 * (low + high);
    if (normalMass(middle) < target) low = middle;
    else high = middle;
  }
  return 0.5 * (low + high);
}

/** Probability of |x| < z: composite Simpson over the density, exact to 1e-12 for z <= 8. */
function normalMass(z) {
  const steps = 400;
  const density = (x) => Math.exp(-0.5 * x * x);
  let sum = density(0) + density(z);
  for (let i = 1; i < steps; ++i) sum += (i % 2 ? 4 : 2) * density((z * i) / steps);
  return ((sum * z) / steps / 3) * Math.sqrt(2 / Math.PI);
}

/** Radius of a complex value's region in total standard deviations: E|e|² = std², region std sqrt(-ln(1-c)). */
export function regionFactor(confidence) {
  return Math.sqrt(-Math.log(1 - Math.min(Math.max(confidence, 0), 1 - 1e-12)));
}

export function percent(fraction) {
  return plain(100 * fraction, 3) + "\u00a0%";
}
