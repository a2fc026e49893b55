// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/measure/distortion.hpp>
#include <limits>
#include <resonid/response/detail/detection_lines.hpp>

namespace resonid::identification::detail {
namespace {

/// Standard deviation of the reported response for other covariances of its lines; 0 where it has none.
std::vector<double> deviations(response::LineEstimates lines, const std::vector<Eigen::Matrix3cd>& covariance,
                               const response::ResponseOptions& options,
                               const data::FrequencyResponse& reported) {
  for (std::size_t i = 0; i < lines.lines.size(); ++i) {
    lines.lines[i].covariance = covariance[i];
    lines.lines[i].degrees_of_freedom = std::numeric_limits<double>::infinity();
  }
  std::vector<double> std(reported.lines(), 0.0);
  const auto g = response::plant_response(lines, options);
  if (!g) return std;
  for (std::size_t i = 0, k = 0; i < std.size() && k < g->lines(); ++k) {
    while (i < std.size() && reported.frequency_hz[i] < g->frequency_hz[k]) ++i;
    if (i < std.size() && reported.frequency_hz[i] == g->frequency_hz[k]) std[i] = g->std[k];
  }
  return std;
}

// Below a thousandth the distortion is of no consequence to a loop.

bool shows(const response::DistortionLevel& l) {
  return l.significant && l.level > kCriteria.relevant_distortion;
}

std::string per_cent(double level) { return fmt::format("{:.2g} %", 100.0 * level); }

}  // namespace

Distortion distortion_of(const response::BestLinearApproximation& measured,
                         const response::ResponseOptions& options, const data::FrequencyResponse& response) {
  Distortion d;
  d.realisations = measured.realisations;
  d.scatter = measured.level;
  d.noise_std = deviations(measured.lines, measured.noise, options, response);
  const auto scatter = deviations(measured.lines, measured.scatter, options, response);
  for (std::size_t i = 0; i < scatter.size(); ++i)
    d.distortion_std.push_back(std::sqrt(response::distortion_variance(
        scatter[i] * scatter[i], d.noise_std[i] * d.noise_std[i], measured.realisations)));
  return d;
}

void add_detection_lines(std::span<const data::Record> realisations, std::size_t period_samples,
                         std::optional<Distortion>& distortion) {
  const auto silent = response::detection_lines(realisations, {period_samples, 0});
  if (!silent || silent->even.lines + silent->odd.lines == 0) return;
  if (!distortion) distortion.emplace();
  distortion->even = silent->even;
  distortion->odd = silent->odd;
}

std::optional<Distortion> find_distortion(const data::Record& record, const Plan& plan,
                                          const Options& options, const Measured& measured,
                                          const data::FrequencyResponse& response) {
  std::optional<Distortion> distortion;
  if (measured.best_linear) {
    distortion =
        distortion_of(*measured.best_linear, {plan.approach, options.controller, options.delay_s}, response);
    add_detection_lines(realisations_in(record, plan.period_samples), plan.period_samples, distortion);
  } else if (plan.method == Method::periodic) {
    add_detection_lines(std::span(&record, 1), plan.period_samples, distortion);
  }
  return distortion;
}

bool exceeds_noise(const std::optional<Distortion>& d) {
  return d && d->scatter.significant && d->scatter.level > d->scatter.noise;
}

std::vector<diagnostics::Finding> inspect_distortion(const Distortion& d) {
  const bool scatters = shows(d.scatter);
  const bool even = shows(d.even);
  const bool odd = shows(d.odd);
  if (!scatters && !even && !odd) return {};
  std::string text;
  if (scatters)
    text = fmt::format(
        "The responses to different realisations of the excitation differ by {} of the output, more than "
        "noise accounts for.",
        per_cent(d.scatter.level));
  const double silent = std::max(even ? d.even.level : 0.0, odd ? d.odd.level : 0.0);
  if (even || odd) {
    const char* kind = even && odd ? "even and odd" : even ? "even" : "odd";
    const char* cause = odd ? "friction, saturation or a stiffening spring" : "an offset or one-sided limits";
    text += fmt::format(
        "{}The drive responds at lines that are not excited, with {} of the output at the excited lines ({} "
        "multiples: {}).",
        text.empty() ? "" : " ", per_cent(silent), kind, cause);
  }
  text +=
      scatters
          ? " The drive is nonlinear: the response is valid for excitations of this amplitude, and "
            "its error bars include the distortion. Excite as strongly as the machine is used."
          : " The response is valid for excitations of this amplitude: excite as strongly as the machine is "
            "used.";
  const double level = scatters ? d.scatter.level : silent;
  return {{"non-linear-distortion",
           level > kCriteria.warned_distortion ? diagnostics::Severity::warning : diagnostics::Severity::info,
           level, kCriteria.relevant_distortion, std::move(text)}};
}

}  // namespace resonid::identification::detail
