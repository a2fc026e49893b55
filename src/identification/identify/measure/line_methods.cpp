// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/identify/measure/line_methods.hpp>
#include <identification/identify/measure/resolution.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/detail/local_rational.hpp>
#include <resonid/response/detail/stepped_sine.hpp>
#include <resonid/response/detail/swept_response.hpp>
#include <resonid/response/detail/tracked_lines.hpp>
#include <resonid/response/local_polynomial.hpp>
#include <resonid/response/periodic_averaging.hpp>
#include <resonid/response/welch.hpp>

namespace resonid::identification::detail {

expected<response::BestLinearApproximation, Error> best_linear_lines(const data::Record& record,
                                                                     const Plan& plan,
                                                                     const Options& options) {
  response::BestLinearConfig config;
  config.period_samples = plan.period_samples;
  config.drop_periods = std::max<std::size_t>(options.drop_periods, 1) - 1;  // one is off already
  config.lines_hz = plan.grid_hz;
  if (options.band_hz) {
    config.band_low_hz = plan.low_hz;
    config.band_high_hz = plan.high_hz;
  }
  return response::best_linear_approximation(realisations_in(record, plan.period_samples), config,
                                             plan.approach);
}

Lines periodic_lines(const data::Record& record, const Plan& plan, const Options& options) {
  response::PeriodicConfig config;
  config.period_samples = plan.period_samples;
  config.drop_periods = plan.transient_periods;
  config.lines_hz = plan.grid_hz;
  if (options.band_hz) {  // otherwise every excited line
    config.band_low_hz = plan.low_hz;
    config.band_high_hz = plan.high_hz;
  }
  return response::periodic_lines(record, config, plan.approach);
}

Lines welch_lines(const data::Record& record, const Plan& plan, const Options& options) {
  if (plan.period_samples == 0 && plan.segment_samples == 0) {
    auto resolved = resolved_welch_lines(record, plan, options);
    if (!resolved) return tl::unexpected(resolved.error());
    return std::move(resolved->lines);
  }
  response::WelchConfig config;
  config.segment_samples = plan.segment_samples;
  config.period_samples = plan.period_samples;
  config.band_low_hz = plan.low_hz;
  config.band_high_hz = plan.high_hz;
  return response::welch_lines(record, config, plan.approach);
}

Lines local_polynomial_lines(const data::Record& record, const Plan& plan) {
  response::LocalPolynomialConfig config;
  config.frequencies_hz = plan.grid_hz;
  config.band_low_hz = plan.low_hz;
  config.band_high_hz = plan.high_hz;
  return response::local_polynomial_lines(record, config, plan.approach);
}

Lines local_rational_lines(const data::Record& record, const Plan& plan) {
  response::LocalRationalConfig config;
  config.frequencies_hz = plan.grid_hz;
  config.band_low_hz = plan.low_hz;
  config.band_high_hz = plan.high_hz;
  return response::local_rational_lines(record, config, plan.approach);
}

Lines swept_lines(const data::Record& record, const Plan& plan, const Options& options, bool by_tracker) {
  response::SweptConfig config;
  config.chirp = *plan.sweep;
  config.frequencies_hz = plan.grid_hz;
  config.method = response::SweptMethod::local_cubic;
  if (by_tracker) {
    constexpr double kPoleRadius = 0.98;
    const auto& t = options.tracker;
    config.method = t.smoothing ? response::SweptMethod::forward_backward : response::SweptMethod::tracker;
    config.offset_state = t.offset;
    if (t.lambda)
      config.lambda = *t.lambda;
    else
      config.pole_radius = t.pole_radius.value_or(kPoleRadius);
  }
  return response::swept_lines(record, config, plan.approach);
}

namespace {

/// Frequencies for a line tracker: those given, else those that the excitation's period shows.
expected<std::vector<double>, Error> lines_to_track(const data::Record& record, const Plan& plan,
                                                    const Options& options) {
  if (!plan.grid_hz.empty()) return plan.grid_hz;
  if (plan.period_samples == 0) return refuse("lines_hz", "must be given: the excitation shows no period");
  const auto found = periodic_lines(record, plan, options);
  if (!found) return tl::unexpected(found.error());
  std::vector<double> lines;
  for (const auto& line : found->lines) lines.push_back(line.frequency_hz);
  constexpr std::size_t kMost = 256;
  if (lines.size() > kMost)
    return refuse("lines_hz", "must be given: the excitation has more than the 256 that can be tracked",
                  static_cast<double>(lines.size()));
  return lines;
}

}  // namespace

Lines tracked_lines(const data::Record& record, const Plan& plan, const Options& options,
                    response::LineMethod method) {
  auto lines = lines_to_track(record, plan, options);
  if (!lines) return tl::unexpected(lines.error());
  response::TrackedLinesConfig config;
  config.lines_hz = std::move(*lines);
  config.period_samples = plan.period_samples;
  config.method = method;
  config.lambda = options.tracker.lambda.value_or(0.0);
  config.pole_radius = options.tracker.pole_radius.value_or(0.0);
  return response::tracked_line_estimates(record, config, plan.approach);
}

Lines stepped_sine_lines(const data::Record& record, const Plan& plan, const Options& options) {
  response::SteppedSineConfig config;
  config.lines_hz = plan.grid_hz;
  auto lines = response::stepped_sine_lines(record, config, plan.approach);
  if (!lines || !options.band_hz) return lines;
  const auto outside = [&](double f) { return f < plan.low_hz || f > plan.high_hz; };
  std::erase_if(lines->lines, [&](const auto& line) { return outside(line.frequency_hz); });
  std::erase_if(lines->unsettled_hz, outside);
  return lines;
}

}  // namespace resonid::identification::detail
