// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/planned_loop.hpp>
#include <identification/tune/checks.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/online/supervision/loop_margins.hpp>

#include "design/closed_loop.hpp"

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;

/// Lines at which noise does not hide on which side of `centre` the loop passes.
data::FrequencyResponse lines_away_from(const data::FrequencyResponse& loop, double centre, double most) {
  if (loop.std.size() != loop.lines()) return loop;
  data::FrequencyResponse clear;
  for (std::size_t i = 0; i < loop.lines(); ++i) {
    if (!(loop.std[i] < most * std::abs(loop.value[i] - centre))) continue;
    clear.frequency_hz.push_back(loop.frequency_hz[i]);
    clear.value.push_back(loop.value[i]);
    clear.std.push_back(loop.std[i]);
  }
  return clear;
}

/// Margins of the lines that are known, with the errors that those of the lines make.
void read_from_known_lines(LoopResult& loop) {
  auto known = lines_away_from(loop.curve, 0.0, kCriteria.margin_line);
  constexpr std::size_t kLeast = 2, kShare = 4;
  if (known.lines() < std::max(kLeast, loop.curve.lines() / kShare)) return;
  loop.curve = std::move(known);
  loop.margins = diagnostics::loop_margins(loop.curve);
  if (loop.curve.std.size() != loop.curve.lines()) return;
  online::MarginScan<double> scan;
  for (std::size_t i = 0; i < loop.curve.lines(); ++i)
    scan.step(loop.curve.frequency_hz[i], loop.curve.value[i], loop.curve.std[i]);
  const auto& found = scan.margins();
  const auto take = [](double std, std::optional<double>& into) {
    if (std::isfinite(std)) into = std;
  };
  take(found.crossover_std_hz, loop.crossover_std_hz);
  take(found.phase_margin_std_deg, loop.phase_margin_std_deg);
  take(found.modulus_margin_std, loop.modulus_margin_std);
}

/// What the delay's standard deviation adds to those of the margins: it turns L, and leaves |L| as it is.
void include_delay_error(double std_s, LoopResult& loop) {
  constexpr double kSmall = 0.1;  // of the standard deviation: margins are far from linear beyond it
  const auto later = [&](double by_s) {
    auto curve = loop.curve;
    for (std::size_t i = 0; i < curve.lines(); ++i)
      curve.value[i] *= std::polar(1.0, -kTwoPi * curve.frequency_hz[i] * by_s);
    return diagnostics::loop_margins(curve);
  };
  const auto more = later(kSmall * std_s), less = later(-kSmall * std_s);
  const auto add = [&](double change, std::optional<double>& std) {
    if (std) std = std::hypot(*std, change / (2.0 * kSmall));
  };
  if (more.phase_margin_deg() && less.phase_margin_deg())
    add(std::remainder(*more.phase_margin_deg() - *less.phase_margin_deg(), 360.0),
        loop.phase_margin_std_deg);
  if (more.gain_margin_db && less.gain_margin_db)
    add(*more.gain_margin_db - *less.gain_margin_db, loop.gain_margin_std_db);
  add(more.modulus_margin - less.modulus_margin, loop.modulus_margin_std);
}

/// The way of 1 + L from line to line.
struct WayAroundZero {
  double end_deg = 0.0;                          ///< arg(1 + L) at the last line, without jumps.
  double largest_turn_deg = 0.0, turn_hz = 0.0;  ///< Between neighbouring lines.
  double first_size = 0.0, last_size = 0.0;      ///< |L| at the first and the last line.
  double first_hz = 0.0, last_hz = 0.0;
};
WayAroundZero way_around_zero(const data::FrequencyResponse& loop) {
  // A drive that integrates, under a P, PI or position loop, makes L begin at -90 ... -270 degrees.
  constexpr double kUsual = -150.0;
  WayAroundZero way;
  const auto degrees = [](std::complex<double> z) { return std::arg(z) * 180.0 / kPi; };
  auto last = 1.0 + loop.value.front();
  way.end_deg = degrees(last) - 360.0 * std::round((degrees(last) - kUsual) / 360.0);
  for (std::size_t i = 1; i < loop.lines(); ++i) {
    const auto here = 1.0 + loop.value[i];
    const double turn = degrees(here / last);
    way.end_deg += turn;
    if (std::abs(turn) > way.largest_turn_deg) {
      way.largest_turn_deg = std::abs(turn);
      way.turn_hz = loop.frequency_hz[i];
    }
    last = here;
  }
  way.first_hz = loop.frequency_hz.front();
  way.last_hz = loop.frequency_hz.back();
  way.first_size = std::abs(loop.value.front());
  way.last_size = std::abs(loop.value.back());
  return way;
}

Finding not_judged(const std::string& why) {
  return {"planned-not-judged",
          Severity::info,
          {},
          {},
          "The lines do not tell whether the loop is stable with the planned controller: " + why + "."};
}

/// By the argument principle, for a machine that integrates its torque below the first line and is stable by
/// itself otherwise: 1 + L must end on the turn on which it began.
std::optional<Finding> judge_by_lines(const LoopResult& loop) {
  constexpr double kMostTurnDeg = 90.0, kClear = 0.5;
  const auto lines = lines_away_from(lines_away_from(loop.curve, 0.0, kCriteria.margin_line), -1.0, kClear);
  if (lines.lines() < 2) return not_judged("none of them is known well enough");
  const auto way = way_around_zero(lines);
  if (way.first_size < 1.0)
    return not_judged(
        fmt::format("|L| is below 1 already at the first that is known, {:.3g} Hz; excite lower "
                    "frequencies too",
                    way.first_hz));
  if (way.largest_turn_deg > kMostTurnDeg)
    return not_judged(
        fmt::format("at {:.3g} Hz 1 + L turns by {:.0f} deg from one to the next; record longer, "
                    "which makes them denser",
                    way.turn_hz, way.largest_turn_deg));
  if (way.last_size < 1.0) {
    if (std::lround(way.end_deg / 360.0) == 0) return std::nullopt;
    return Finding{
        "planned-unstable",
        Severity::warning,
        {},
        {},
        fmt::format("With the planned controller the loop is unstable: by the {}, L goes around -1. "
                    "Do not run it.",
                    loop.source == "model" ? "model" : "measured response")};
  }
  // What lags by half a turn where it is still above 1 would have to come back before it falls below.
  if (way.end_deg <= -180.0)
    return Finding{
        "planned-unstable", Severity::warning, way.last_size, 1.0,
        fmt::format("With the planned controller the loop is unstable: at the last line that is known, "
                    "{:.3g} Hz, |L| is still {:.3g} and lags by more than 180 deg. Do not run it.",
                    way.last_hz, way.last_size)};
  return not_judged(
      fmt::format("|L| is still {:.3g} at the last that is known, {:.3g} Hz; excite higher "
                  "frequencies too",
                  way.last_size, way.last_hz));
}

}  // namespace

void judge_planned_loop(const Measurement& m, const Options& options, const PlantModel& model,
                        Result& result) {
  Options planned = options;
  planned.controller = options.planned_controller->sampled(1.0 / result.record.sample_rate_hz);
  result.planned_loop = loop_of(m.plan, planned, m.lines, result.response, model);
  const auto* drive = std::get_if<fit::DriveModel>(&model);
  if (result.planned_loop) {
    auto& loop = *result.planned_loop;
    if (loop.source == "response") read_from_known_lines(loop);
    if (drive != nullptr && !has_delay_std(result)) include_delay_error(assumed_delay_std(result), loop);
    static_cast<void>(keep_to_band(m.plan, false, loop));
  }
  if (drive == nullptr) {
    if (result.planned_loop)
      if (auto finding = judge_by_lines(*result.planned_loop)) result.findings.push_back(std::move(*finding));
    return;
  }
  fit::DriveModel real = *drive;
  real.known_delay_s =
      options.delay_s + 0.5 * static_cast<double>(m.plan.hold.samples - 1) * real.sample_time_s;
  const double radius = design::closed_loop(fit::sampled_states(real), design::states_of(*planned.controller))
                            .spectral_radius();
  if (radius >= 1.0)
    result.findings.push_back(
        {"planned-unstable", Severity::warning, radius, 1.0,
         "With the planned controller the loop is unstable on the identified machine. Do not run it."});
}

}  // namespace resonid::identification::detail
