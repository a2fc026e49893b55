// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/shown_modes.hpp>
#include <resonid/diagnostics/detail/response_extrema.hpp>

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;
using diagnostics::Finding;
using diagnostics::Severity;

constexpr double kDeviations = 2.0;  // by which a line may be off without contradicting

std::vector<Complex> values_of(const Result& result, const std::vector<double>& hz) {
  return result.model ? result.model->drive.values(hz, true) : result.black_box->model.response(hz).value;
}

/// The model's response at the lines, smoothed as the measured one is.
data::FrequencyResponse curve_of(const Result& result, const data::FrequencyResponse& measured) {
  data::FrequencyResponse curve;
  curve.frequency_hz = measured.frequency_hz;
  const double width = measured.smoothing.width_hz;
  if (!(width > 0.0)) {
    curve.value = values_of(result, measured.frequency_hz);
    return curve;
  }
  std::vector<double> below, above;
  for (const double f : measured.frequency_hz) {
    below.push_back(std::max(f - width, 0.1 * f));
    above.push_back(f + width);
  }
  const auto low = values_of(result, below), high = values_of(result, above);
  for (std::size_t i = 0; i < low.size(); ++i) {
    const Complex slope = measured.smoothing.slope.empty() ? 0.0 : measured.smoothing.slope[i];
    const Complex a = std::exp(-width * slope), b = std::exp(width * slope);
    curve.value.push_back((a * low[i] + b * high[i]) / (a + b));
  }
  return curve;
}

/// Lines of the neighbourhood in which an extremum is the same one.
std::pair<std::size_t, std::size_t> around(const data::FrequencyResponse& g, double f) {
  const auto at = [&](double hz) {
    return static_cast<std::size_t>(std::lower_bound(g.frequency_hz.begin(), g.frequency_hz.end(), hz) -
                                    g.frequency_hz.begin());
  };
  return {at(f / (1.0 + kCriteria.same_mode)), at(f * (1.0 + kCriteria.same_mode))};
}

/// Largest or least of what the lines around f may be.
double bound_of(const data::FrequencyResponse& g, double f, bool minimum, double sign) {
  const auto [first, last] = around(g, f);
  double bound = minimum ? std::numeric_limits<double>::infinity() : 0.0;
  for (std::size_t i = first; i < last; ++i) {
    const double size = std::max(0.0, std::abs(g.value[i]) + sign * kDeviations * g.std[i]);
    bound = minimum ? std::min(bound, size) : std::max(bound, size);
  }
  return bound;
}

/// Deepest or highest value of the model around f.
double extreme_of(const Result& result, double f, bool minimum) {
  constexpr int kPoints = 64;
  std::vector<double> hz;
  for (int k = 0; k <= kPoints; ++k)
    hz.push_back(f * std::pow(1.0 + kCriteria.same_mode, 2.0 * k / kPoints - 1.0));
  double extreme = minimum ? std::numeric_limits<double>::infinity() : 0.0;
  for (const Complex value : values_of(result, hz))
    extreme = minimum ? std::min(extreme, std::abs(value)) : std::max(extreme, std::abs(value));
  return extreme;
}

bool lacks(const Result& result, const data::FrequencyResponse& g, const fit::ResponseMode& mode) {
  const double f = mode.mode.frequency_hz.value;
  const double model = extreme_of(result, f, mode.mode.anti);
  const double least = kCriteria.other_extremum;
  return mode.mode.anti ? model > least * bound_of(g, f, true, 1.0)
                        : least * model < bound_of(g, f, false, -1.0);
}

/// Known lines within the neighbourhood, and on either side of it.
bool known_around(const data::FrequencyResponse& g, double f) {
  constexpr double kReach = 1.6;
  const auto known = [&](double low, double high) {
    int count = 0;
    for (std::size_t i = 0; i < g.lines(); ++i)
      count += g.frequency_hz[i] >= low && g.frequency_hz[i] <= high &&
                       g.std[i] < kCriteria.usable_line * std::abs(g.value[i])
                   ? 1
                   : 0;
    return count;
  };
  const double side = 1.0 + kCriteria.same_mode;
  return known(f / side, f * side) >= 2 && known(f / kReach, f) >= 2 && known(f, f * kReach) >= 2;
}

bool contradicted(const data::FrequencyResponse& g, const data::FrequencyResponse& curve,
                  const diagnostics::ResponseExtremum& of_model) {
  const double f = of_model.frequency_hz;
  if (!known_around(g, f)) return false;
  data::FrequencyResponse exact = curve;
  exact.std.assign(curve.lines(), 0.0);
  const double model = bound_of(exact, f, of_model.minimum, 0.0);
  const double least = kCriteria.other_extremum;
  return of_model.minimum ? bound_of(g, f, true, -1.0) > least * model
                          : least * bound_of(g, f, false, 1.0) < model;
}

std::string name_of(bool anti, double f) {
  return fmt::format("{} at {:.4g} Hz", anti ? "anti-resonance" : "resonance", f);
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += fmt::format("{}{}", i == 0 ? "" : i + 1 == names.size() ? " and " : ", ", names[i]);
  return text;
}

Finding shows_more(const std::vector<fit::ResponseMode>& lacking, bool drive) {
  std::vector<std::string> names;
  double highest = 0.0;
  for (const auto& m : lacking) {
    names.push_back(
        fmt::format("an {} ({:.0f} dB)", name_of(m.mode.anti, m.mode.frequency_hz.value), m.prominence_db));
    if (!m.mode.anti) names.back().erase(1, 1);
    highest = std::max(highest, m.prominence_db);
  }
  return {
      "response-shows-more", Severity::error, highest, kCriteria.striking_mode_db,
      fmt::format("The measured response shows {} that the model does not have: {}. What is given for the "
                  "resonances comes from the response.",
                  joined(names),
                  drive ? "the drive has more masses than this structure, or the fit missed them; try .model "
                          "three-mass or "
                          "black-box"
                        : "take a higher .order")};
}

Finding shows_less(const diagnostics::ResponseExtremum& e) {
  return {"response-shows-less", Severity::error, e.prominence_db, kCriteria.striking_mode_db,
          fmt::format("The model has {} {} ({:.0f} dB) where the measured response shows none, though its "
                      "lines are known there: the model is over-fitted. Take a model of fewer masses "
                      "(.model, .order), or a narrower .band_hz.",
                      e.minimum ? "an" : "a", name_of(e.minimum, e.frequency_hz), e.prominence_db)};
}

/// Whether findings say already that the model is not the machine.
bool model_holds(const Result& result) {
  return std::none_of(result.findings.begin(), result.findings.end(), [](const Finding& f) {
    return f.severity == Severity::error &&
           (f.id == "misfit" || f.id == "explains-nothing" || f.id == "unphysical-damping" ||
            f.id == "mode-above-nyquist" || f.id == "differs-over-frequency" || f.id == "dry-friction" ||
            f.id == "unstable-model" || f.id == "response-shows-less");
  });
}

void take(std::vector<data::Mode> modes, std::string because, Result& result) {
  result.modes.insert(result.modes.end(), modes.begin(), modes.end());
  std::sort(result.modes.begin(), result.modes.end(), [](const data::Mode& a, const data::Mode& b) {
    return a.frequency_hz.value < b.frequency_hz.value;
  });
  result.choices.push_back({"resonances", "of the measured response", std::move(because)});
}

}  // namespace

std::vector<data::Mode> modes_of(const std::vector<fit::ResponseMode>& shown) {
  std::vector<data::Mode> modes;
  for (const auto& m : shown) modes.push_back(m.mode);
  return modes;
}

void hold_against_response(const data::FrequencyResponse& response,
                           const std::vector<fit::ResponseMode>& shown, Result& result) {
  if (!result.model && !result.black_box) {
    if (!shown.empty()) take(modes_of(shown), "there is no model; each by a local rational fit", result);
    return;
  }
  std::vector<fit::ResponseMode> lacking;
  for (const auto& mode : shown)
    if (mode.prominence_db >= kCriteria.striking_mode_db && lacks(result, response, mode))
      lacking.push_back(mode);
  if (!lacking.empty()) result.findings.push_back(shows_more(lacking, result.model.has_value()));
  if (response.std.size() == response.lines()) {
    const auto curve = curve_of(result, response);
    for (const auto& e : diagnostics::response_extrema(curve, kCriteria.striking_mode_db))
      if (contradicted(response, curve, e)) {
        result.findings.push_back(shows_less(e));
        break;
      }
  }
  if (shown.empty()) return;
  if (!model_holds(result)) {
    result.modes.clear();
    take(modes_of(shown), "the model does not fit; each by a local rational fit", result);
  } else if (!lacking.empty()) {
    take(modes_of(lacking), "those that the model lacks, each by a local rational fit", result);
  }
}

}  // namespace resonid::identification::detail
