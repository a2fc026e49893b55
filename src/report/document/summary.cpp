// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/identification/result.hpp>
#include <resonid/report/json.hpp>

#include "report/document/result_lists.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
namespace {

using identification::Result;

std::string resonance_text(const data::Mode& r, double z) {
  return fmt::format("{} Hz", with_error(r.frequency_hz.value,
                                         std::isfinite(r.frequency_hz.std) ? z * r.frequency_hz.std : 0.0));
}

bool of_response(const Result& result) {
  return std::any_of(result.modes.begin(), result.modes.end(),
                     [](const data::Mode& m) { return !m.from_model; });
}

/// Those that come from the measured response.
std::string modes_sentence(const Result& result, double z, bool of_model = false) {
  std::string text;
  for (const auto& r : result.modes)
    if (r.from_model == of_model)
      text += fmt::format("{}{} {} at {}", text.empty() ? "" : ", ", r.anti ? "an" : "a", r.name(),
                          resonance_text(r, z));
  return fmt::format("The {} has {}.", of_model ? "model" : "measured response", text);
}

/// Errors by which a model is not this machine's.
bool explains_little(std::string_view id) {
  return id == "misfit" || id == "uncertain-inertia" || id == "response-shows-more" ||
         id == "response-shows-less";
}

/// Whether the lines are noise.
bool of_noise(const Result& result) {
  return std::any_of(result.findings.begin(), result.findings.end(), [](const diagnostics::Finding& f) {
    return f.severity == diagnostics::Severity::error && (f.id == "weak-excitation" || f.id == "incoherent");
  });
}

std::string structure_sentence(const Result& result) {
  if (result.black_box && !result.model) {
    const auto& delay = result.black_box->further_delay;
    const double z = two_sided_quantile(result.confidence);
    auto text = fmt::format(
        "A black-box model of order {}{} describes the recording: fit of the simulated output {:.1f} % "
        "(NRMSE). It "
        "has no drive structure, so it gives no inertias and no stiffness.",
        result.black_box->model.transfer_function.denominator.size() - 1,
        delay ? fmt::format(" with an additional delay of {} ms",
                            with_error(1e3 * delay->value, 1e3 * z * delay->std))
              : "",
        result.black_box->fit_percent);
    if (of_response(result)) text += " " + modes_sentence(result, z);
    if (std::any_of(result.modes.begin(), result.modes.end(),
                    [](const data::Mode& m) { return m.from_model; }))
      text += " " + modes_sentence(result, z, true);
    return text;
  }
  const double z = two_sided_quantile(result.confidence);
  if (!result.model) {
    if (result.modes.empty() && of_noise(result)) return "The recording shows no response of the machine.";
    if (result.modes.empty()) return "The measured response shows no resonance.";
    return modes_sentence(result, z);
  }
  const auto& drive = result.model->drive;
  for (const auto& f : result.findings)
    if (f.severity == diagnostics::Severity::error && explains_little(f.id))
      return "No drive model fits this recording; what follows is only the closest one." +
             (of_response(result) ? " " + modes_sentence(result, z) : "");
  if (drive.structure == fit::Structure::rigid && !result.modes.empty())
    return fmt::format("A rigid {} is the closest drive model. {}",
                       result.units.physical ? "inertia" : "mass", modes_sentence(result, z));
  if (drive.structure == fit::Structure::rigid)
    return fmt::format("The drive behaves as one rigid {}; no resonance shows in {:.3g} ... {:.3g} Hz.",
                       result.units.physical ? "inertia" : "mass", result.response.frequency_hz.front(),
                       result.response.frequency_hz.back());
  std::string text = fmt::format("The recording shows a {}-inertia ({}) drive: ",
                                 drive.structure == fit::Structure::two_mass ? "two" : "three",
                                 fit::name_of(drive.structure));
  bool first = true;
  for (const auto& r : result.modes) {
    text += fmt::format("{}{} {}", first ? "" : ", ", r.name(), resonance_text(r, z));
    first = false;
  }
  return text + fmt::format(" (undamped, {:.0f} % confidence intervals).", 100.0 * result.confidence);
}

/// At the crossover; where all crossings are known, the least of them.
std::string phase_margin_text(const identification::LoopResult& loop, double z) {
  const auto bar = [&](const std::optional<double>& std) {
    return z > 0.0 && std ? fmt::format(" +- {:.2g}", z * *std) : std::string();
  };
  const auto least =
      std::min_element(loop.crossings.begin(), loop.crossings.end(), [](const auto& a, const auto& b) {
        return std::abs(a.phase_margin_deg) < std::abs(b.phase_margin_deg);
      });
  if (loop.crossings.size() < 2)
    return fmt::format("phase margin {:.1f}{} deg", *loop.margins.phase_margin_deg(),
                       bar(loop.phase_margin_std_deg));
  return fmt::format("smallest phase margin {:.1f}{} deg at {:.3g} Hz (of {} crossings of |L| = 1)",
                     least->phase_margin_deg, bar(least->phase_margin_std_deg), least->frequency_hz,
                     loop.crossings.size());
}

/// With bars where they are asked for and known: those of the loop that ran stand in the table of the page.
std::string loop_sentence(const char* which, const identification::LoopResult& loop, double z) {
  const auto& m = loop.margins;
  const auto bar = [&](const std::optional<double>& std) {
    return z > 0.0 && std ? fmt::format(" +- {:.2g}", z * *std) : std::string();
  };
  std::string text = which;
  if (m.crossover_hz())
    text += fmt::format("crossover {:.3g}{} Hz, {}, ", *m.crossover_hz(), bar(loop.crossover_std_hz),
                        phase_margin_text(loop, z));
  if (m.gain_margin_db)
    text += fmt::format("gain margin {:.1f}{} dB, ", *m.gain_margin_db, bar(loop.gain_margin_std_db));
  text += fmt::format("minimum distance to -1 (modulus margin) {:.2f}{} at {:.3g} Hz", m.modulus_margin,
                      bar(loop.modulus_margin_std), m.modulus_margin_hz);
  if (m.modulus_margin > 0.0) text += fmt::format(", Ms {:.2f}", 1.0 / m.modulus_margin);
  return text + ".";
}

std::string parameter_lines(const Result& result, double z) {
  const auto& drive = result.model->drive;
  std::string text;
  const auto put = [&](const std::string& label, const data::Estimate& e, const std::string& unit) {
    constexpr double kDetermined = 1.0;  // standard deviation over value of what is a figure at all
    constexpr double kSecond = 1e3;      // a time may be none to within a few samples, not to within a second
    if (e.std > kDetermined * std::abs(e.value) && std::abs(e.value) > 0.0 &&
        (unit != "ms" || e.std > kSecond)) {
      text += fmt::format("  {:<18} not determined\n", label);
      return;
    }
    text += fmt::format("  {:<18} {} {}\n", label, with_error(e.value, z * e.std), unit_words(unit));
  };
  const auto& u = result.units;
  const bool linear = u.inertia == "kg";
  const auto inertia = [&](const char* side) {
    return fmt::format("{} {}", side, !u.physical ? "coefficient" : linear ? "mass" : "inertia");
  };
  put(inertia("motor"), drive.estimate(fit::kDrivenInertia), u.inertia);
  if (drive.structure != fit::Structure::rigid) {
    put(inertia("load"), drive.estimate(fit::kLoadInertia), u.inertia);
    put("stiffness", drive.estimate(fit::kStiffness), u.stiffness);
    put("damping", drive.estimate(fit::kDamping), u.damping);
    if (result.radius_m) {
      const double square = *result.radius_m * *result.radius_m;
      const auto stiffness = drive.estimate(fit::kStiffness);
      put("belt stiffness", {stiffness.value / square, stiffness.std / square}, "N/m");
    }
    if (drive.structure == fit::Structure::three_mass) {
      put(inertia("middle"), drive.estimate(fit::kMiddleInertia), u.inertia);
      put("stiffness 2", drive.estimate(fit::kStiffness2), u.stiffness);
      put("damping 2", drive.estimate(fit::kDamping2), u.damping);
    }
  }
  if (drive.estimated[fit::kViscousFriction])
    put("viscous friction", drive.estimate(fit::kViscousFriction), u.damping);
  const auto further = [&](const char* label, fit::Parameter p, const std::string& unit) {
    if (drive.estimated[static_cast<std::size_t>(p)]) put(label, drive.estimate(p), unit);
  };
  further("friction of the load", fit::kLoadViscousFriction, u.damping);
  further("spring to ground", fit::kMotorGroundStiffness, u.stiffness);
  further("load to ground", fit::kLoadGroundStiffness, u.stiffness);
  const auto lag = [&](const char* label, fit::Parameter p) {
    if (!drive.estimated[static_cast<std::size_t>(p)]) return;
    const auto time = drive.estimate(p);
    put(label, {1e3 * time.value, 1e3 * time.std}, "ms");
  };
  lag("torque lag", fit::kTorqueLag);
  lag("output filter", fit::kOutputFilter);
  const auto friction = [&](const char* label, const std::optional<data::Estimate>& e,
                            const std::string& unit) {
    if (e) put(label, *e, unit);
  };
  const auto& more = result.model->further_friction;
  friction("dry friction", result.model->coulomb_friction, u.torque);
  friction("breakaway friction", more.breakaway, u.torque);
  friction("Stribeck velocity", more.stribeck_velocity, u.velocity);
  friction("dry friction of the load", more.load_coulomb, u.torque);
  if (drive.estimated[fit::kDelay]) {
    auto delay = drive.estimate(fit::kDelay);
    put("additional delay", {1e3 * delay.value, 1e3 * delay.std}, "ms");
  }
  if (result.model->offset && std::abs(result.model->offset->value) > z * result.model->offset->std)
    put("input offset", *result.model->offset, u.torque);
  return text;
}

/// "12 % of the output, more than noise explains"
std::string level_text(const response::DistortionLevel& l) {
  return l.significant ? fmt::format("{:.2g} % of the output", 100.0 * l.level)
                       : fmt::format("none beyond the noise ({:.2g} %)", 100.0 * l.noise);
}

std::string distortion_sentence(const identification::Distortion& d) {
  std::string text = "Non-linear distortion: ";
  const char* comma = "";
  if (d.realisations > 0) {
    text += fmt::format("by {} realisations {}", d.realisations, level_text(d.scatter));
    comma = "; ";
  }
  for (const auto* level : {&d.even, &d.odd}) {
    if (level->lines == 0) continue;
    text += fmt::format("{}at {} {} lines without excitation {}", comma, level->lines,
                        level == &d.even ? "even" : "odd", level_text(*level));
    comma = "; ";
  }
  return text + ".";
}

/// How the error bars of the planned loop count a delay that was not fitted.
std::string planned_delay_text(const Result& result) {
  const auto& loop = *result.planned_loop;
  if (!result.model || loop.source != "model" || !loop.phase_margin_std_deg) return {};
  const auto& drive = result.model->drive;
  if (drive.estimated[fit::kDelay] && drive.covariance(fit::kDelay, fit::kDelay) > 0.0) return {};
  return fmt::format(
      " The delay counts in its error bars with a standard deviation of a quarter of a sample, {:.3g} ms, as "
      "in tune.",
      1e3 * 0.25 * drive.sample_time_s);
}

std::string planned_sentence(const Result& result) {
  const auto is_told = [&](const char* id) {
    return std::any_of(result.findings.begin(), result.findings.end(),
                       [&](const auto& f) { return f.id == id; });
  };
  if (is_told("planned-not-judged"))
    return "With the planned controller: whether the loop is stable, and its margins, are not known.";
  const char* words = is_told("planned-unstable")          ? "With the planned controller, UNSTABLE: "
                      : is_told("planned-may-be-unstable") ? "With the planned controller, MAY BE UNSTABLE: "
                                                           : "With the planned controller: ";
  return loop_sentence(words, *result.planned_loop, two_sided_quantile(result.confidence)) +
         planned_delay_text(result);
}

std::string reliable_text(const Result& result) {
  const auto& r = result.reliable;
  std::vector<const char*> holds, not_held;
  const auto put = [&](bool given, bool reliable, const char* name) {
    if (reliable)
      holds.push_back(name);
    else if (given)
      not_held.push_back(name);
  };
  put(true, r.response, "the measured response");
  put(!result.modes.empty(), r.resonances, "the resonances");
  put(result.model.has_value(), r.parameters, "the parameters");
  put(result.loop.has_value(), r.margins, "the margins");
  if (holds.empty()) return {};
  auto text = fmt::format("The result as a whole is not reliable; reliable by themselves: {}",
                          fmt::join(holds, ", "));
  if (!not_held.empty()) text += fmt::format("; not: {}", fmt::join(not_held, ", "));
  return text + ".";
}

}  // namespace

std::vector<std::string> sentences(const Result& result) {
  std::vector<std::string> list = {structure_sentence(result)};
  if (result.distortion) list.push_back(distortion_sentence(*result.distortion));
  if (result.loop) list.push_back(loop_sentence("Loop: ", *result.loop, 0.0));
  if (result.planned_loop) list.push_back(planned_sentence(result));
  if (result.validation) {
    const auto& v = *result.validation;
    std::string text =
        fmt::format("Fit of the {} {:.0f} % (NRMSE)",
                    v.of_record ? "simulated output" : "model to the measured response", v.fit_percent);
    if (v.cross_correlation_max && v.limit)
      text += *v.cross_correlation_max < *v.limit
                  ? "; the residual is not correlated with the input: it is noise"
                  : "; the residual is correlated with the input";
    list.push_back(text + ".");
  }
  if (const auto& second = result.second_output; second && result.model)
    list.push_back(second->fitted ? fmt::format("The model is that of both outputs, {} and {}.",
                                                result.record.output, second->signal)
                                  : fmt::format("The model is that of {} alone.", result.record.output));
  if (result.independent) {
    const auto& v = *result.independent;
    list.push_back(fmt::format("On {}, to which it was not fitted, the model's fit is {:.1f} % (NRMSE): {}.",
                               v.file, v.simulation_fit_percent, v.verdict));
  }
  if (auto parts = reliable_text(result); !result.trusted && !parts.empty()) list.push_back(std::move(parts));
  return list;
}

std::string summary_text(const Result& result) {
  const double z = two_sided_quantile(result.confidence);
  const auto& r = result.record;
  std::string text = fmt::format("{}: {} samples at {:g} Hz\n", r.file, r.samples, r.sample_rate_hz);
  text += fmt::format("  input {}, output {}", r.input, r.output);
  if (!r.excitation.empty()) text += fmt::format(", excitation {}", r.excitation);
  if (result.second_output) text += fmt::format(", second output {}", result.second_output->signal);
  text += "\n" + reading_text(r.reading);
  text += fmt::format("  response by {}, {} approach, {} lines {:.3g} ... {:.3g} Hz\n\n", result.method,
                      result.approach, result.response.lines(), result.response.frequency_hz.front(),
                      result.response.frequency_hz.back());
  for (const auto& sentence : sentences(result)) text += wrapped(sentence, "", "") + "\n";
  if (result.model)
    text += fmt::format("\nParameters, {:.0f} % confidence intervals\n", 100.0 * result.confidence) +
            parameter_lines(result, z);
  text += bootstrap_text(result) + structures_text(result) + choices_text(result);
  text += findings_text(result.findings);
  text +=
      result.trusted ? "\nTrusted.\n" : "\nNOT trusted: the result is not reliable; see the errors above.\n";
  return text;
}

}  // namespace resonid::report
