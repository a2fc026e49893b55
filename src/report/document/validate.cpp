// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/report/detail/validate.hpp>

#include "report/document/words.hpp"

namespace resonid::report {
namespace {

using diagnostics::ResidualCorrelation;
using identification::ModelValidation;

/// In which bands most of the residual lies, and whether the input explains any of it.
std::string residual_sentence(const ModelValidation& v) {
  const auto most = std::max_element(v.bands.begin(), v.bands.end(), [](const auto& a, const auto& b) {
    return a.residual_share < b.residual_share;
  });
  std::string text;
  if (most != v.bands.end())
    text = fmt::format(
        "{:.0f} % of the residual's power lies in {:.4g} ... {:.4g} Hz, where the residual has {:.3g} % of "
        "the output's power. ",
        100.0 * most->residual_share, most->low_hz, most->high_hz, 100.0 * most->residual_over_output);
  if (v.dependence.lags > 0)
    text += v.dependence.probability < 0.01
                ? fmt::format(
                      "The past of the {} explains {:.1f} % of the whitened residual beyond chance "
                      "(probability {:.1g}).",
                      v.dependence.on, 100.0 * v.dependence.share, v.dependence.probability)
                : fmt::format(
                      "The residual does not depend on the {} beyond chance and the model's own uncertainty "
                      "(probability {:.2g}).",
                      v.dependence.on, v.dependence.probability);
  return text;
}

std::string correlation_sentence(const ModelValidation& v) {
  const auto& t = v.residual_test;
  std::string text;
  const auto put = [&](const ResidualCorrelation& c, const char* with) {
    if (c.value.empty()) return;
    text += fmt::format("{}{:.3f} with the {}", text.empty() ? "" : ", ", c.largest, with);
  };
  put(t.with_simulated, "simulated output");
  put(t.with_input, "input");
  put(t.with_excitation, "excitation");
  return fmt::format(
      "Residual: {:.4g} {} rms, {:.1f} dB below the simulated output. Largest correlation over lags 1 ... "
      "{}: {} (limits {:.3f} per lag at 3 %, {:.2f} practical).",
      t.rms, v.units.velocity, t.snr_db, t.judged_lags, text, t.limit, diagnostics::kPracticalCorrelation);
}

}  // namespace

std::vector<std::string> sentences(const ModelValidation& v) {
  std::vector<std::string> list;
  list.push_back(fmt::format(
      "{} on this recording: {}.", v.candidate.source,
      v.verdict == identification::Verdict::accepted ? "accepted"
      : v.verdict == identification::Verdict::doubtful && v.fitted_here && !v.candidate.trusted
          ? "doubtful, as its own result is not trusted"
      : v.verdict == identification::Verdict::doubtful ? "doubtful, the drive has dynamics that it lacks"
                                                       : "rejected"));
  list.push_back(
      fmt::format("Fit (NRMSE): simulated from the {} alone {:.1f} %; predicted one step ahead from past "
                  "outputs {:.1f} %.",
                  v.approach == "indirect" ? "excitation (closed-loop predictor)" : "input",
                  v.simulation_fit_percent, v.prediction_fit_percent));
  if (v.judged)
    list.push_back(
        fmt::format("Judged within {:.3g} ... {:.3g} Hz, {}: the fit there is {:.1f} % (NRMSE), "
                    "with a residual of {:.3g} {} rms. What lies outside is shown, not judged.",
                    v.judged->low_hz, v.judged->high_hz,
                    v.judged->of_model ? "the band in which the model was identified"
                                       : "where this recording excites the drive",
                    v.judged->fit_percent, v.judged->residual_rms, v.units.velocity));
  if (v.fitted_here)
    list.push_back(
        "This is the recording that the model was fitted to: what its parameters have used up counts as "
        "explained. It shows whether the structure suffices, not whether the model holds elsewhere.");
  if (v.fit_in_band_percent)
    list.push_back(fmt::format("Fit within {:g} ... {:g} Hz: {:.1f} %.", v.fit_band_hz->first,
                               v.fit_band_hz->second, *v.fit_in_band_percent));
  if (v.judged_from_hz && v.judged_fit_percent)
    list.push_back(fmt::format(
        "Most of the residual lies below {:.3g} Hz, where nothing excites the drive; above, the fit is "
        "{:.1f} %, and that is judged.",
        *v.judged_from_hz, *v.judged_fit_percent));
  list.push_back(correlation_sentence(v));
  if (const auto residual = residual_sentence(v); !residual.empty()) list.push_back(residual);
  if (v.gap && !v.gap->distance.empty()) {
    const auto i = v.gap->largest();
    list.push_back(fmt::format(
        "Model and measured response differ by {:.1f} % beyond the noise (rms over the lines), by at "
        "most {:.3f} in chordal distance (at {:.4g} Hz; pointwise, no v-gap).",
        100.0 * v.response_error.value_or(0.0), v.gap->distance[i], v.gap->frequency_hz[i]));
  }
  if (v.offset && std::abs(v.offset->value) > 2.0 * v.offset->std)
    list.push_back(
        fmt::format("A constant torque of {} {} was estimated with the initial state; nothing else was.",
                    with_error(v.offset->value, 1.96 * v.offset->std), v.units.torque));
  return list;
}

std::string summary_text(const ModelValidation& v) {
  std::string text =
      fmt::format("{}: {} samples at {:g} Hz, {} approach\n{}\n", v.record.file, v.record.samples,
                  v.record.sample_rate_hz, v.approach, reading_text(v.record.reading));
  for (const auto& s : sentences(v)) text += wrapped(s, "", "  ") + "\n";
  text += findings_text(v.findings);
  std::string verdict(name_of(v.verdict));
  verdict[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(verdict[0])));
  return text +
         fmt::format("\n{}.{}\n", verdict,
                     v.trusted ? "" : " NOT trusted: the result is not reliable; see the errors above.");
}

}  // namespace resonid::report
