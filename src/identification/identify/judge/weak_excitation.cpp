// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/weak_excitation.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <string_view>
#include <vector>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;

constexpr std::string_view kId = "weak-excitation";

/// Errors that too little excitation has as a consequence, among other causes.
constexpr std::array<std::string_view, 14> kConsequences = {"incoherent",
                                                            "misfit",
                                                            "differs-over-frequency",
                                                            "response-shows-more",
                                                            "response-shows-less",
                                                            "uncertain-inertia",
                                                            "uncertain-resonance",
                                                            "unexplained-response",
                                                            "fails-on-held-back",
                                                            "explains-nothing",
                                                            "changes-within-recording",
                                                            "unphysical-damping",
                                                            "reversed",
                                                            "no-model"};

bool is_consequence(const Finding& f) {
  return f.severity == Severity::error &&
         std::find(kConsequences.begin(), kConsequences.end(), f.id) != kConsequences.end();
}

/// Lines of the response, not all of many, where most of the input's power is.
std::vector<double> excited_lines(const data::Record& record, const Measurement& m) {
  constexpr std::size_t kMost = 200;
  const auto [low_hz, high_hz] =
      response::excited_band_hz(record, m.plan.approach).value_or(std::pair(m.plan.low_hz, m.plan.high_hz));
  auto excited = m.response.band(low_hz, high_hz);
  if (excited.lines() < kCriteria.fewest_lines) excited = m.response;
  std::vector<double> hz;
  for (std::size_t i = 0; i < excited.lines(); i += 1 + excited.lines() / kMost)
    hz.push_back(excited.frequency_hz[i]);
  return hz;
}

const char* cure(const Measurement& m, const Options& options) {
  if (m.plan.approach == Approach::direct && !options.controller)
    return "Excite more strongly or longer there, and record the excitation (.excitation).";
  return "Excite more strongly or longer there.";
}

/// What the controller makes of the output's noise against everything that moves the input.
std::optional<Finding> inspect_input(const data::Record& record, const Measurement& m,
                                     const Options& options) {
  const auto found = m.evidence.feedback ? tl::expected<diagnostics::Feedback, Error>(*m.evidence.feedback)
                                         : diagnostics::find_feedback(record, options.delay_s);
  if (!found || !found->present()) return std::nullopt;
  const auto hz = excited_lines(record, m);
  std::vector<double> shares;
  for (const double f : hz) shares.push_back(found->noise_share(f));
  const double typical = median(shares);
  double low_hz = 0.0, high_hz = 0.0;  // between which parts are noise
  for (std::size_t i = 0; i < hz.size(); ++i) {
    if (!(shares[i] > kCriteria.input_by_noise_in_part)) continue;
    if (low_hz == 0.0) low_hz = hz[i];
    high_hz = hz[i];
  }
  auto sorted = shares;
  std::sort(sorted.begin(), sorted.end());
  const double in_part = sorted[sorted.size() * 9 / 10];
  // Averages over the input are biased by it, those over a recorded excitation are not.
  const bool biased = m.plan.approach == Approach::direct && in_part > kCriteria.input_by_noise_in_part;
  if (!(typical > kCriteria.input_by_noise) && !biased) return std::nullopt;
  constexpr double kNearlyAll = 0.99;
  const std::string where =
      typical > kNearlyAll ? fmt::format("from {:.3g} to {:.3g} Hz nearly all", hz.front(), hz.back())
      : typical > kCriteria.input_by_noise
          ? fmt::format("from {:.3g} to {:.3g} Hz typically {:.0f} %", hz.front(), hz.back(), 100.0 * typical)
          : fmt::format("in parts of {:.3g} ... {:.3g} Hz up to {:.0f} %", low_hz, high_hz,
                        100.0 * sorted.back());
  return Finding{std::string(kId), Severity::error, typical, kCriteria.input_by_noise,
                 fmt::format("The excitation is too weak for the noise: {} of the input's power is the "
                             "controller's answer to the noise of the output. {}",
                             where, cure(m, options))};
}

/// Lines of a response that hardly rise above what is not known of them.
std::optional<Finding> inspect_lines(const Measurement& m, const Options& options) {
  const auto& g = m.response;
  if (g.lines() < kCriteria.fewest_lines || g.std.size() != g.lines()) return std::nullopt;
  std::size_t usable = 0;
  for (std::size_t i = 0; i < g.lines(); ++i)
    usable += g.std[i] < kCriteria.usable_line * std::abs(g.value[i]) ? 1U : 0U;
  const double noise = 1.0 - static_cast<double>(usable) / static_cast<double>(g.lines());
  if (noise < 1.0 - kCriteria.lines_above_noise) return std::nullopt;
  return Finding{
      std::string(kId), Severity::error, noise, 1.0 - kCriteria.lines_above_noise,
      fmt::format("The excitation is too weak for the noise: {} of {} lines from {:.3g} to {:.3g} Hz rise "
                  "above twice their standard deviation. {}",
                  usable == 0 ? "none" : fmt::format("only {}", usable), g.lines(), g.frequency_hz.front(),
                  g.frequency_hz.back(), cure(m, options))};
}

}  // namespace

std::optional<Finding> inspect_excitation(const Experiment& experiment, const Measurement& m,
                                          const Options& options, const Result& result) {
  const bool modelled = result.model || result.black_box;
  const bool faulty =
      !modelled || std::any_of(result.findings.begin(), result.findings.end(), is_consequence);
  // A black box describes minus the inverse of a controller as well as a machine.
  const bool of_loop = result.black_box && !result.model && m.plan.approach == Approach::direct;
  if (!faulty && !of_loop) return std::nullopt;
  const auto told = [&](std::string_view id) {
    return std::any_of(result.findings.begin(), result.findings.end(),
                       [&](const Finding& f) { return f.severity == Severity::error && f.id == id; });
  };
  auto finding = inspect_input(experiment.record, m, options);
  if (finding && !faulty && !drowns_everything(*finding)) return std::nullopt;
  // A response without a model is told by its bias, where a model may still make something of the recording.
  const double hopeless = modelled ? kCriteria.input_by_noise : kCriteria.input_by_noise_alone;
  if (finding && told("feedback-bias") && *finding->value < hopeless) return std::nullopt;
  // Lines without coherence are told as such; a motion profile excites few lines, and is known by them.
  if (finding || !faulty || told("incoherent") || experiment.motion) return finding;
  return inspect_lines(m, options);
}

bool drowns_everything(const Finding& finding) {
  return finding.id == kId && finding.severity == Severity::error && finding.value && finding.threshold &&
         *finding.value >= *finding.threshold;
}

}  // namespace resonid::identification::detail
