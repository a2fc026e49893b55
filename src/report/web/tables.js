// SPDX-License-Identifier: MIT
// Everything of the report that is words and figures.
import { escapeHtml, interval, isNumber, list, normalFactor, percent, plain, plusMinus, powers, prettyUnit, significant, superscript, words } from "./format.js";
import { section, table } from "./markup.js";

const sign = (kind) => `<svg aria-hidden="true"><use href="#sign-${kind}"/></svg>`;

/** 200 000 is read faster than 200000. */
const grouped = (whole) => (Math.abs(whole) < 10000 ? String(whole) : whole.toLocaleString("en").replace(/,/g, "\u202f"));
const APPROACH = {
  direct: "direct: from input to output", indirect: "indirect: from excitation to output, without the loop's effect",
  joint: "joint: from excitation to input and output",
};

const RANK = { error: 0, warning: 1, info: 2 };
const severity = (finding) => (finding.severity in RANK ? finding.severity : "warning");

export function sortedFindings(findings) {
  return list(findings).filter((f) => f && typeof f === "object" && !f.follows)
    .sort((a, b) => RANK[severity(a)] - RANK[severity(b)]);
}

export function head(root, data) {
  const page = data.page ?? {};
  const record = data.record ?? {};
  const facts = [];
  if (record.file && record.file !== page.title) facts.push(String(record.file).split(/[\\/]/).pop());
  if (isNumber(record.samples)) facts.push(`${grouped(record.samples)} samples`);
  if (isNumber(record.sample_rate_hz)) facts.push(`${plain(record.sample_rate_hz, 6)} Hz`);
  if (isNumber(record.samples) && record.sample_rate_hz > 0) facts.push(`${significant(record.samples / record.sample_rate_hz, 3)} s`);
  const box = document.createElement("header");
  box.className = "head";
  box.innerHTML = `<div><div class="brand">resonid · identification</div><h1>${escapeHtml(page.title ?? "Identification")}</h1>` +
    `<p class="meta">${escapeHtml(facts.join(" · "))}</p></div>` + verdict(data);
  root.append(box);
}

const titleOf = (data, finding) => data.page?.finding_titles?.[finding.id] ?? words(finding.id ?? "finding");

function verdict(data) {
  if (typeof data.trusted !== "boolean") {
    return '<div class="verdict none"><div><b>Not judged</b><span>This result holds no verdict.</span></div></div>';
  }
  const serious = sortedFindings(data.findings).filter((f) => severity(f) !== "info");
  if (data.trusted) {
    const text = serious.length ? `with ${serious.length} warning${serious.length > 1 ? "s" : ""}, see the findings` : "Every check passed.";
    return `<div class="verdict good" role="status">${sign("good")}<div><b>Trusted</b><span>${text}</span></div></div>`;
  }
  const errors = serious.filter((f) => severity(f) === "error");
  const reasons = (errors.length ? errors : serious).map((f) => titleOf(data, f).toLowerCase());
  const shown = reasons.slice(0, 3).join(", ") + (reasons.length > 3 ? ` and ${reasons.length - 3} more` : "");
  return `<div class="verdict bad" role="status">${sign("bad")}<div><b>Not trusted</b><span>${escapeHtml(shown || "see the findings")}</span></div></div>`;
}

const modulusNote = (peaks) => (isNumber(peaks?.ms)
  ? `minimum distance to −1; Ms ${significant(peaks.ms, 3)}${isNumber(peaks.mt) ? `, Mt ${significant(peaks.mt, 3)}` : ""}` : "minimum distance to −1");

/** The figures that an engineer looks for first, at most six. */
export function keyFigures(data) {
  const confidence = data.page?.confidence ?? 0.95;
  const factor = normalFactor(confidence);
  const loop = data.loop ?? {};
  const out = [];
  const add = (name, value, unit, half, under, accent) => {
    if (isNumber(value)) out.push({ name, ...plusMinus(value, half), unit, under, accent });
  };
  const resonances = list(data.resonances).filter((r) => isNumber(r?.frequency_hz));
  const ratio = (r) => (isNumber(r.damping_ratio) ? `damping ratio ${significant(r.damping_ratio, 2)}` : "");
  for (const r of resonances.slice(0, 3)) {
    const anti = r.kind === "antiresonance";
    add(anti ? "Anti-resonance" : "Resonance", r.frequency_hz, "Hz", r.std_hz * factor, ratio(r), anti ? "antiresonance" : "resonance");
  }
  if (Array.isArray(data.resonances) && resonances.length === 0) {
    const rigid = data.model?.structure === "rigid";
    out.push({ name: "Resonance", word: "none", under: rigid ? "moves as one rigid body" : "none found in the band", accent: "resonance" });
  }
  const addLoop = (name, value, std, unit, under) => {
    const shown = std > 0 ? plusMinus(value, std * factor) : { value: significant(value, 3) };
    if (isNumber(value)) out.push({ name, ...shown, unit, under, accent: "model" });
  };
  addLoop("Crossover", loop.crossover_hz, loop.crossover_std_hz, "Hz", "of the open loop");
  addLoop("Phase margin", loop.phase_margin_deg, loop.phase_margin_std_deg, "°", "delay included");
  addLoop("Modulus margin", loop.modulus_margin, loop.modulus_margin_std, "", modulusNote(data.page?.peaks));
  const inertias = data.page?.inertia_ratio;
  if (inertias) add("Inertia ratio", inertias.value, "", inertias.std * factor, "load over motor", "measured");
  const parameters = data.model?.parameters ?? {};
  for (const name of ["driven_inertia", "load_inertia", "stiffness", "viscous_friction", "damping"]) {
    const p = parameters[name];
    if (out.length < 5 && isNumber(p?.value) && isPhysical(p.unit)) add(parameterName(name, p.unit), p.value, p.unit ?? "", p.std * factor, "", "measured");
  }
  return out.slice(0, 6);
}

export function figures(root, data) {
  const cards = keyFigures(data);
  if (cards.length === 0) return;
  const confidence = data.page?.confidence ?? 0.95;
  const box = document.createElement("dl");
  box.className = "figures";
  box.style.setProperty("--count", cards.length);
  box.innerHTML = cards.map((c) => {
    const unit = c.unit === "°" ? "°" : c.unit ? ` <small>${escapeHtml((c.times ?? "") + " " + prettyUnit(c.unit))}</small>` : "";
    const lines = [c.half ? `± ${c.half}${c.times ?? ""} at ${percent(confidence)}` : "", c.under].filter(Boolean);
    const value = c.word ? `<div class="value word">${escapeHtml(c.word)}</div>` : `<div class="value"><span>${c.value}</span>${unit}</div>`;
    return `<div class="figure" style="--accent:var(--${c.accent})"><dt>${c.name}</dt><dd>${value}` +
      `${lines.map((l) => `<div class="under">${escapeHtml(l)}</div>`).join("")}</dd></div>`;
  }).join("");
  root.append(box);
}

export function summaryAndFindings(root, data) {
  const sentences = list(data.page?.summary).filter((s) => typeof s === "string");
  const findings = sortedFindings(data.findings);
  const known = Array.isArray(data.findings);
  if (sentences.length === 0 && !known) return;
  const many = findings.length > 3;
  const both = sentences.length > 0 && findings.length > 0 && !many;
  const split = document.createElement("div");
  split.className = both ? "split two" : "split";
  root.append(split);
  if (sentences.length) {
    const box = section(split, "Summary", "", "sheet");
    box.insertAdjacentHTML("beforeend", `<ul class="summary">${sentences.map((s) => `<li>${escapeHtml(s)}</li>`).join("")}</ul>`);
    if (known && findings.length === 0) box.insertAdjacentHTML("beforeend", '<p class="explain none">Findings: none, every check passed.</p>');
  }
  if (!known || (sentences.length && findings.length === 0)) return;
  const box = section(split, "Findings", "", "sheet");
  const items = findings.map((f) => {
    const figures = [
      isNumber(f.value) ? `found ${plain(f.value, 3)}` : "",
      isNumber(f.threshold) ? `limit ${plain(f.threshold, 3)}` : "",
    ].filter(Boolean).join(", ");
    const kind = severity(f);
    const name = { error: "Error", warning: "Warning", info: "Note" }[kind];
    return `<li><span class="tag ${kind}">${name}</span><div><b>${escapeHtml(titleOf(data, f))}</b>` +
      `${f.meaning ? `<p>${escapeHtml(powers(f.meaning))}</p>` : ""}${figures ? `<p class="soft small">${escapeHtml(figures)}</p>` : ""}</div></li>`;
  });
  box.insertAdjacentHTML("beforeend", items.length
    ? `<ul class="findings${many ? " many" : ""}">${items.join("")}</ul>`
    : '<p class="explain">None: every check passed.</p>');
}

/** Units built from volts, amperes ...: the parameter is a coefficient, not the physical quantity of its name. */
function isPhysical(unit) {
  return !/(^|[ /])(V|A|deg|rpm|%)([ /]|$)/.test(String(unit ?? ""));
}

function parameterName(name, unit) {
  if (unit === "kg") return words(name).replace(/inertia$/, "mass");
  if (isPhysical(unit)) return words(name);
  return { driven_inertia: "Motor coefficient", middle_inertia: "Middle coefficient", load_inertia: "Load coefficient" }[name] ?? words(name);
}

export function modelTables(root, data) {
  const confidence = data.page?.confidence ?? 0.95;
  const factor = normalFactor(confidence);
  const rows = ordered(data.model?.parameters).filter(([, p]) => isNumber(p?.value)).map(([name, p]) => [
    parameterName(name, p.unit), interval(p.value, p.std * factor, p.unit ?? ""),
    p.std > 0 && p.std * factor < Math.abs(p.value) ? percent((p.std * factor) / Math.abs(p.value)) : "–",
  ]);
  const resonances = list(data.resonances).filter((r) => isNumber(r?.frequency_hz)).map((r) => [
    r.kind === "antiresonance" ? "Anti-resonance" : words(r.kind ?? "resonance"), interval(r.frequency_hz, r.std_hz * factor, "Hz"),
    isNumber(r.damping_ratio) ? (r.damping_ratio_std > 0 ? interval(r.damping_ratio, r.damping_ratio_std * factor) : significant(r.damping_ratio, 2)) : "–",
    r.source ?? "–",
  ]);
  const validation = [...validationRows(data.validation, data.page?.units?.output), ...elsewhereRows(data.cross_validation)];
  if (rows.length + resonances.length + validation.length === 0) return;
  const structure = data.model?.structure ? ` (${data.model.structure})` : "";
  const box = section(root, "Model" + structure,
    `Ranges are ${percent(confidence)} confidence intervals, provided that the structure is right.`, "model sheet");
  if (rows.length) box.insertAdjacentHTML("beforeend", table(["Parameter", "Value", "Relative"], rows, [2]));
  if (resonances.length) {
    box.insertAdjacentHTML("beforeend", "<h3>Resonances</h3>" + table(["Kind", "Frequency", "Damping", "From"], resonances, [2]));
  }
  if (validation.length) box.insertAdjacentHTML("beforeend", "<h3>Validation</h3>" + table(null, validation));
}

/** Intervals of the bootstrap beside those of the covariance. */
export function bootstrapTable(root, data) {
  const confidence = data.page?.confidence ?? 0.95;
  const rows = bootstrapRows(data, normalFactor(confidence));
  if (rows.length === 0) return;
  const { replicas, failed } = data.bootstrap;
  const box = section(root, "Bootstrap", `The experiment repeated ${plain(replicas)} times on the fitted model` +
    `${failed ? ` (${plain(failed)} more did not converge)` : ""}: where the intervals differ, those of the covariance are too simple.`);
  box.insertAdjacentHTML("beforeend", table(["Figure", `${percent(confidence)} of the repetitions`, "By the covariance"], rows));
}

/** Value and standard deviation of a figure by the name that the bootstrap gives it. */
function figureOf(data, name) {
  const parameter = data.model?.parameters?.[name];
  if (parameter) return parameter;
  const loop = data.loop ?? {};
  if (isNumber(loop[name])) {
    const unit = /_(hz|deg|db)$/.exec(name)?.[0] ?? "";
    return { value: loop[name], std: loop[name.slice(0, name.length - unit.length) + "_std" + unit] };
  }
  const [, anti, number, what] = /^(anti)?resonance(?:_(\d+))?_(hz|damping_ratio)$/.exec(name) ?? [];
  const kind = anti ? "antiresonance" : "resonance";
  const r = list(data.resonances).filter((x) => x?.kind === kind)[(Number(number) || 1) - 1] ?? {};
  if (what === "hz") return { value: r.frequency_hz, std: r.std_hz };
  return { value: r.damping_ratio, std: r.damping_ratio_std };
}

function bootstrapRows(data, factor) {
  return list(data.bootstrap?.intervals).filter((i) => isNumber(i?.low) && isNumber(i?.high)).map((i) => {
    const told = figureOf(data, i.name);
    const unit = i.unit ? " " + prettyUnit(i.unit) : "";
    const range = (low, high) => `${significant(low, 5)} … ${significant(high, 5)}${unit}`;
    const known = isNumber(told.value) && told.std > 0;
    return [words(i.name.replace(/_(hz|deg|db)$/, "")), range(i.low, i.high),
      known ? range(told.value - told.std * factor, told.value + told.std * factor) : "–"];
  });
}

function elsewhereRows(v) {
  if (!v || typeof v !== "object") return [];
  const rows = [["Another recording", String(v.file ?? "")]];
  if (isNumber(v.simulation_fit_percent)) rows.push(["Fit there, simulated", `${significant(v.simulation_fit_percent, 3)} %`]);
  if (v.verdict) rows.push(["Verdict there", String(v.verdict)]);
  return rows;
}

/** Which structures were tried and how they did, and what else was left to the program. */
export function structuresAndChoices(root, data) {
  const trials = list(data.structures).filter((t) => t && typeof t === "object");
  const choices = list(data.choices).filter((c) => c && typeof c === "object");
  if (trials.length === 0 && choices.length === 0) return;
  const box = section(root, "What was chosen, and why");
  if (choices.length) {
    box.insertAdjacentHTML("beforeend", table(["What", "Chosen", "Because"],
      choices.map((c) => [words(c.what ?? ""), String(c.chosen ?? ""), String(c.because ?? "")])));
  }
  if (trials.length === 0) return;
  const best = Math.min(...trials.map((t) => t.information).filter(isNumber));
  const elsewhere = trials.some((t) => isNumber(t.independent_fit_percent));
  const fit = (x) => (isNumber(x) ? `${x.toFixed(2)} %` : "–");
  const rows = trials.map((t) => [
    `${t.chosen ? "✓ " : ""}${t.name ?? ""}`, isNumber(t.parameters) ? String(t.parameters) : "–",
    isNumber(t.information) ? (t.information - best).toFixed(1) : "–", fit(t.validation_fit_percent),
    ...(elsewhere ? [fit(t.independent_fit_percent)] : []), t.remark ?? "",
  ]);
  const head = ["Structure", "Parameters", "BIC above best", "Fit on hold-out data", ...(elsewhere ? ["Fit on the other recording"] : []), "Note"];
  box.insertAdjacentHTML("beforeend", "<h3>Structures side by side</h3>" + table(head, rows, elsewhere ? [1, 2, 3, 4] : [1, 2, 3]) +
    '<p class="explain">BIC: the Bayesian information criterion, smaller is better; a difference of 10 is decisive.</p>');
}

/** The order in which a reader expects names that JSON keeps sorted; unknown ones follow. */
const ORDER = [
  "driven_inertia", "middle_inertia", "load_inertia", "stiffness", "damping", "stiffness_2", "damping_2",
  "viscous_friction", "coulomb_friction", "offset", "delay",
  "file", "samples", "sample_rate_hz", "duration_s", "time", "reference", "excitation", "input", "output",
  "fit_percent", "cross_correlation_max", "of",
];

function ordered(object) {
  const rank = ([name]) => (ORDER.indexOf(name) + ORDER.length + 1) % (ORDER.length + 1);
  return Object.entries(object ?? {}).sort((a, b) => rank(a) - rank(b));
}

const VALIDATION = {
  of: ["Judged on", (v) => (v === "lines" ? "the excited lines" : v === "record" ? "the recording" : `the ${v}`)],
  fit_percent: ["Fit", (v) => `${significant(v, 3)} % (NRMSE)`],
  cross_correlation_max: ["Residual against input", (v, all) => isNumber(all.limit)
    ? `${significant(v, 2)}, limit ${significant(all.limit, 2)}: ${v <= all.limit ? "passed" : "the residual is correlated with the input"}`
    : significant(v, 2)],
};

function validationRows(validation, unit) {
  const all = validation ?? {};
  return ordered(all).filter(([name, v]) => (isNumber(v) || typeof v === "boolean" || typeof v === "string") && !(name === "limit" && "cross_correlation_max" in all))
    .map(([name, v]) => {
      const known = VALIDATION[name];
      if (known && (isNumber(v) || name === "of")) return [known[0], known[1](v, all)];
      return [words(name), isNumber(v) ? plain(v) + (name === "residual_rms" && unit ? ` ${prettyUnit(unit)}` : "") : String(v)];
    });
}

export function recordTable(root, data) {
  const record = data.record ?? {};
  const units = data.page?.units ?? {};
  const rows = [];
  for (const [name, value] of ordered(record)) {
    if (name === "signals" || value === null) continue;
    if (isNumber(value)) {
      const label = words(name.replace(/_(hz|s|percent)$/, ""));
      const unit = name.endsWith("_hz") ? " Hz" : name.endsWith("_s") ? " s" : name.endsWith("_percent") ? " %" : "";
      rows.push([label, (Number.isInteger(value) ? grouped(value) : plain(value, 5)) + unit]);
    } else if (typeof value === "string" || typeof value === "boolean") {
      rows.push([words(name), String(value)]);
    }
  }
  for (const [role, column] of ordered(record.signals)) {
    const unit = units[role] ? ` in ${prettyUnit(units[role])}` : "";
    if (typeof column === "string") rows.push([words(role) + " taken from", `column ${column}${unit}`]);
  }
  if (Array.isArray(record.reading) && record.reading.length > 0) rows.push(["Reader", record.reading.join("; ")]);
  if (data.method) rows.push(["Method", data.method]);
  if (data.approach) rows.push(["Approach", APPROACH[data.approach] ?? data.approach]);
  if (rows.length === 0) return;
  section(root, "Recording and method", "", "facts").insertAdjacentHTML("beforeend", table(null, rows));
}

export function transferFunction(root, data) {
  const tf = data.model?.transfer_function;
  const b = list(tf?.numerator);
  const a = list(tf?.denominator);
  if (b.length === 0 && a.length === 0) return;
  const box = document.createElement("section");
  const rows = Array.from({ length: Math.max(a.length, b.length) }, (_, k) => [
    k === 0 ? "1" : "z" + superscript(-k),
    isNumber(b[k]) ? significant(b[k], 10) : "–", isNumber(a[k]) ? significant(a[k], 10) : "–",
  ]);
  const time = isNumber(tf.sample_time_s) ? `, sample time ${plain(tf.sample_time_s, 6)} s` : "";
  box.innerHTML = `<details><summary>Transfer function of the model</summary><p class="explain">Coefficients in powers of z⁻¹${time}, ` +
    `known delay removed.</p>${table(["Power", "Numerator", "Denominator"], rows, [1, 2])}</details>`;
  root.append(box);
}

/** Who made this from what, and lines to sign on paper. */
export function provenance(root, data) {
  const p = data.provenance;
  if (!p || typeof p !== "object") return;
  const rows = [];
  if (p.version) rows.push(["Program", `resonid ${p.version}`]);
  if (p.date) rows.push(["Date", p.date]);
  if (p.command) rows.push(["Command", p.command]);
  for (const file of list(p.files)) rows.push([file.name ?? "", file.sha256 ? `SHA-256 ${file.sha256}` : "not a file"]);
  if (rows.length === 0) return;
  const box = section(root, "Provenance", "", "provenance sheet");
  box.insertAdjacentHTML("beforeend", table(null, rows));
  box.insertAdjacentHTML("beforeend", SIGN_OFF);
}

const SIGN_OFF = '<div class="sign-off print-only"><span>Machine, axis</span><span>Done by</span><span>Date</span><span>Signature</span></div>';

export function foot(root, data) {
  const box = document.createElement("footer");
  box.innerHTML = `<span class="soft small">${escapeHtml(data.schema ?? "")}</span>`;
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = data.page?.reduced ? "Download the data shown (JSON)" : "Download the result (JSON)";
  button.addEventListener("click", () => {
    const { page, ...result } = data;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([JSON.stringify(result, null, 1)], { type: "application/json" }));
    link.download = (String(data.record?.file ?? "result").split(/[\\/]/).pop().replace(/\.[^.]*$/, "") || "result") + ".json";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  });
  box.append(button);
  root.append(box);
}
