// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <identification/measurement.hpp>
#include <resonid/base/detail/median.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/detail/local_rational.hpp>
#include <resonid/response/detail/stepped_sine.hpp>
#include <resonid/response/detail/swept_response.hpp>
#include <resonid/response/detail/tracked_lines.hpp>
#include <resonid/response/local_polynomial.hpp>
#include <resonid/response/periodic_averaging.hpp>
#include <resonid/response/welch.hpp>

namespace resonid::identification::detail {
namespace {

using Refused = tl::unexpected<Error>;
using Lines = expected<response::LineEstimates, Error>;

Refused refused(std::string option, std::string message) {
  return Refused(Error{std::move(option), std::move(message)});
}

Refused refused(const Error& error, const char* option) {
  std::string message = fmt::format("{} {}", error.field.view(), error.requirement.view());
  if (std::isfinite(error.value)) message += fmt::format(" (found {:.6g})", error.value);
  return refused(option, std::move(message));
}

expected<response::BestLinearApproximation, Error> best_linear(const data::Record& record, const Plan& plan,
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

Lines periodic(const data::Record& record, const Plan& plan, const Options& options) {
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

/// Typical standard deviation of the lines, relative to their values.
double uncertainty(const response::LineEstimates& lines, const Plan& plan, const Options& options) {
  const auto g = response::plant_response(lines, {plan.approach, options.controller, options.delay_s});
  if (!g || g->lines() == 0) return 0.0;
  std::vector<double> relative;
  for (std::size_t i = 0; i < g->lines(); ++i)
    relative.push_back(g->standard_deviation[i] / std::abs(g->value[i]));
  return median(std::move(relative));
}

/// Lines that drown in noise say less than fewer, broader ones: the segment is halved while they do.
Lines welch(const data::Record& record, const Plan& plan, const Options& options) {
  response::WelchConfig config;
  config.period_samples = plan.period_samples;
  config.band_low_hz = plan.low_hz;
  config.band_high_hz = plan.high_hz;
  auto lines = response::welch_lines(record, config, plan.approach);
  if (plan.period_samples != 0) return lines;
  constexpr double kUsable = 0.15;
  constexpr std::size_t kShortest = 512;
  std::size_t segment = response::default_segment(record.samples(), record.sample_rate_hz);
  while (lines && segment >= 2 * kShortest && uncertainty(*lines, plan, options) > kUsable) {
    config.segment_samples = segment /= 2;
    lines = response::welch_lines(record, config, plan.approach);
  }
  return lines;
}

Lines local_polynomial(const data::Record& record, const Plan& plan) {
  response::LocalPolynomialConfig config;
  config.frequencies_hz = plan.grid_hz;
  config.band_low_hz = plan.low_hz;
  config.band_high_hz = plan.high_hz;
  return response::local_polynomial_lines(record, config, plan.approach);
}

Lines local_rational(const data::Record& record, const Plan& plan) {
  response::LocalRationalConfig config;
  config.frequencies_hz = plan.grid_hz;
  config.band_low_hz = plan.low_hz;
  config.band_high_hz = plan.high_hz;
  return response::local_rational_lines(record, config, plan.approach);
}

Lines swept(const data::Record& record, const Plan& plan, const Options& options) {
  response::SweptConfig config;
  config.chirp = *plan.sweep;
  config.frequencies_hz = plan.grid_hz;
  config.method = response::SweptMethod::local_cubic;
  if (plan.method == Method::kalman) {
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

/// Frequencies for a line tracker: those given, else those that the excitation's period shows.
expected<std::vector<double>, Error> lines_to_track(const data::Record& record, const Plan& plan,
                                                    const Options& options) {
  if (!plan.grid_hz.empty()) return plan.grid_hz;
  if (plan.period_samples == 0) return refuse("lines", "must be given: the excitation shows no period");
  const auto found = periodic(record, plan, options);
  if (!found) return tl::unexpected(found.error());
  std::vector<double> lines;
  for (const auto& line : found->lines) lines.push_back(line.frequency_hz);
  constexpr std::size_t kMost = 256;
  if (lines.size() > kMost)
    return refuse("lines", "must be given: the excitation holds more than the 256 that can be followed",
                  static_cast<double>(lines.size()));
  return lines;
}

response::LineMethod line_method(Method method) {
  switch (method) {
    case Method::sliding_dft:
      return response::LineMethod::sliding_dft;
    case Method::least_squares:
      return response::LineMethod::least_squares;
    default:
      return response::LineMethod::kalman;
  }
}

Lines tracked(const data::Record& record, const Plan& plan, const Options& options) {
  auto lines = lines_to_track(record, plan, options);
  if (!lines) return tl::unexpected(lines.error());
  response::TrackedLinesConfig config;
  config.lines_hz = std::move(*lines);
  config.period_samples = plan.period_samples;
  config.method = line_method(plan.method);
  config.lambda = options.tracker.lambda.value_or(0.0);
  config.pole_radius = options.tracker.pole_radius.value_or(0.0);
  return response::tracked_line_estimates(record, config, plan.approach);
}

Lines stepped(const data::Record& record, const Plan& plan, const Options& options) {
  response::SteppedSineConfig config;
  config.lines_hz = plan.grid_hz;
  auto lines = response::stepped_sine_lines(record, config, plan.approach);
  if (!lines || !options.band_hz) return lines;
  const auto outside = [&](double f) { return f < plan.low_hz || f > plan.high_hz; };
  std::erase_if(lines->lines, [&](const auto& line) { return outside(line.frequency_hz); });
  std::erase_if(lines->unsettled_hz, outside);
  return lines;
}

/// All lines at once over the whole record, or one after another.
Lines least_squares(const data::Record& record, const Plan& plan, const Options& options) {
  return plan.excitation == ExcitationType::stepped_sine ? stepped(record, plan, options)
                                                         : tracked(record, plan, options);
}

Lines run(const data::Record& record, const Plan& plan, const Options& options) {
  switch (plan.method) {
    case Method::periodic:
      return periodic(record, plan, options);
    case Method::welch:
      return welch(record, plan, options);
    case Method::kalman:
      return plan.sweep ? swept(record, plan, options) : tracked(record, plan, options);
    case Method::sliding_dft:
      return tracked(record, plan, options);
    case Method::local_cubic:
      return swept(record, plan, options);
    case Method::least_squares:
      return least_squares(record, plan, options);
    case Method::local_rational:
      return local_rational(record, plan);
    default:
      return local_polynomial(record, plan);
  }
}

/// The option of the command line that a field of a method's configuration comes from.
const char* option_of(std::string_view field) {
  struct Pair {
    std::string_view field;
    const char* option;
  };
  constexpr std::array kPairs = {Pair{"lines", "lines"},
                                 Pair{"lines_hz", "lines"},
                                 Pair{"frequencies_hz", "lines"},
                                 Pair{"period_samples", "period-samples"},
                                 Pair{"window_samples", "period-samples"},
                                 Pair{"drop_periods", "period-samples"},
                                 Pair{"duration_s", "chirp"},
                                 Pair{"lambda", "lambda"},
                                 Pair{"pole_radius", "pole-radius"}};
  for (const auto& pair : kPairs)
    if (pair.field == field) return pair.option;
  return "method";
}

}  // namespace

expected<Measured, Error> measure(const data::Record& record, const Plan& plan, const Options& options) {
  Measured measured;
  if (plan.method == Method::best_linear) {
    auto found = best_linear(record, plan, options);
    if (!found) return refused(found.error(), option_of(found.error().field));
    measured.lines = found->lines;
    measured.best_linear = std::move(*found);
  } else {
    auto found = run(record, plan, options);
    if (!found) return refused(found.error(), option_of(found.error().field));
    measured.lines = std::move(*found);
  }
  const auto* lines = &measured.lines;
  if (lines->lines.empty() && !lines->unsettled_hz.empty())
    return refused("method",
                   fmt::format("{}: none of the {} lines settled within the record's {:g} s; record longer "
                               "or track fewer lines",
                               name_of(plan.method), lines->unsettled_hz.size(), record.duration_s()));
  if (lines->lines.empty()) {
    const auto [low, high] =
        std::minmax_element(data::exciting(record).begin(), data::exciting(record).end());
    if (*low == *high)
      return refused(
          record.excitation.present() ? "excitation" : "input",
          fmt::format("does not move (always {:g}): without excitation there is no response", *low));
    return refused("band",
                   fmt::format("{:.4g} ... {:.4g} Hz holds no line that {} could measure in {} samples",
                               plan.low_hz, plan.high_hz, name_of(plan.method), record.samples()));
  }
  return measured;
}

}  // namespace resonid::identification::detail
