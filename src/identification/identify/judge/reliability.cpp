// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <identification/criteria.hpp>
#include <identification/identify/judge/reliability.hpp>
#include <string_view>

namespace resonid::identification::detail {
namespace {

/// Errors of the model alone, and of the controller; all others are of the record, and nothing holds.
constexpr std::array<std::string_view, 21> kOfModel = {"no-model",
                                                       "misfit",
                                                       "explains-nothing",
                                                       "unphysical-damping",
                                                       "mode-above-nyquist",
                                                       "unstable-model",
                                                       "not-converged",
                                                       "response-shows-more",
                                                       "response-shows-less",
                                                       "differs-over-frequency",
                                                       "dry-friction",
                                                       "backlash",
                                                       "stiffening-coupling",
                                                       "torque-gain",
                                                       "uncertain-inertia",
                                                       "uncertain-resonance",
                                                       "spring-to-ground",
                                                       "unexplained-response",
                                                       "fails-on-held-back",
                                                       "second-output-scale",
                                                       "second-output-differs"};
constexpr std::string_view kOfController = "controller-differs";
/// Of the parameters alone: another model is as good, and has the same response.
constexpr std::string_view kOfParameters = "ground-side";

bool of_model(std::string_view id) {
  return std::find(kOfModel.begin(), kOfModel.end(), id) != kOfModel.end();
}

}  // namespace

Reliability reliability_of(const Result& result) {
  bool record = true, model = true, parameters = true, controller = true;
  for (const auto& f : result.findings) {
    if (f.severity != diagnostics::Severity::error) continue;
    if (f.id == kOfController)
      controller = false;
    else if (f.id == kOfParameters)
      parameters = false;
    else if (of_model(f.id))
      model = false;
    else
      record = false;
  }
  const auto& g = result.response;
  std::size_t known = 0;
  for (std::size_t i = 0; i < g.lines() && i < g.std.size(); ++i)
    if (g.std[i] < kCriteria.margin_line * std::abs(g.value[i])) ++known;
  constexpr std::size_t kFew = 3;
  Reliability r;
  r.response = record && known >= kFew;
  const bool by_model = record && model && (result.model.has_value() || result.black_box.has_value());
  r.parameters = by_model && parameters && result.model.has_value();
  r.resonances =
      !result.modes.empty() && (r.response || by_model) &&
      std::all_of(result.modes.begin(), result.modes.end(), [&](const data::Mode& m) {
        const auto& f = m.frequency_hz;
        return f.std < kCriteria.uncertain_resonance * f.value && (m.from_model ? by_model : r.response);
      });
  r.margins =
      controller && result.loop.has_value() && (result.loop->source == "model" ? by_model : r.response);
  return r;
}

}  // namespace resonid::identification::detail
