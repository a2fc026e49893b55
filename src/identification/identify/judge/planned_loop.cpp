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
#include "design/ends_of_lines.hpp"

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
};
WayAroundZero way_around_zero(const data::FrequencyResponse& loop, double begin_deg) {
  WayAroundZero way;
  way.end_deg = begin_deg;
  for (std::size_t i = 1; i < loop.lines(); ++i) {
    const double turn = std::arg((1.0 + loop.value[i]) / (1.0 + loop.value[i - 1])) * 180.0 / kPi;
    way.end_deg += turn;
    if (std::abs(turn) > way.largest_turn_deg) {
      way.largest_turn_deg = std::abs(turn);
      way.turn_hz = loop.frequency_hz[i];
    }
  }
  return way;
}

/// arg(1 + L) at the first line, on the turn that it reaches from below. There a machine that integrates its
/// torque and k integrators of the controller make -90 (1 + k) deg; nothing where the sign is another.
std::optional<double> begin_deg(const data::FrequencyResponse& loop,
                                const data::TransferFunction& controller) {
  constexpr double kDecades = 2.0, kSameSign = 120.0;
  const double first_hz = loop.frequency_hz.front(), lowest_hz = first_hz * std::pow(10.0, -kDecades);
  const auto machine = loop.value.front() / controller.response(first_hz);
  const auto below = controller.response(lowest_hz);
  const double integrators = std::log2(std::abs(controller.response(0.5 * lowest_hz) / below));
  const double turn_deg = -90.0 * (1.0 + integrators);
  const double away_deg = std::remainder(std::arg(below) * 180.0 / kPi - 90.0 - turn_deg, 360.0);
  if (!(std::abs(away_deg) < kSameSign)) return std::nullopt;
  return design::angle_at_first_line(machine, kDecades, turn_deg * kPi / 180.0,
                                     [&](double part) { return controller.response(part * first_hz); }) *
         180.0 / kPi;
}

/// What no line shows: a resonance above the last one may lift |L| to 1. Nothing lies above half of the rate.
std::optional<std::string> may_rise_above(const data::FrequencyResponse& lines, double at_end,
                                          double sample_time_s) {
  constexpr double kToHalfTheRate = 0.95;
  const double last_hz = lines.frequency_hz.back();
  const bool whole = last_hz * sample_time_s >= 0.5 * kToHalfTheRate;
  if (const double most = whole ? 1.0 : design::kLargestLoopAtEnd; !(at_end < most))
    return fmt::format(
        "with its error |L| is still {:.2g} at the last that is known, {:.3g} Hz, where it must be below "
        "{:g} "
        "for nothing above to lift it to 1; excite higher frequencies too",
        at_end, last_hz, most);
  const double rise =
      design::rise_at_end(lines.frequency_hz, [&](std::size_t i) { return std::abs(lines.value[i]); });
  if (whole || !design::ends_on_flank(at_end, rise)) return std::nullopt;
  return fmt::format(
      "|L| rises to {:.2g} (with its error {:.2g}) at the last that is known, {:.3g} Hz: a resonance is "
      "near, "
      "which may lift it to 1; excite higher frequencies too",
      std::abs(lines.value.back()), at_end, last_hz);
}

Finding not_judged(const std::string& why) {
  return {"planned-not-judged",
          Severity::warning,
          {},
          {},
          "The lines do not tell whether the loop is stable with the planned controller: " + why +
              ". Its margins are not known."};
}

/// The margins are those of the lines alone, which a loop of unknown stability need not have.
void withdraw_margins(LoopResult& loop) {
  loop.margins.crossovers.clear();
  loop.margins.worst_phase_margin_deg.reset();
  loop.margins.gain_margin_db.reset();
  loop.margins.gain_margin_hz.reset();
  loop.crossover_std_hz = loop.phase_margin_std_deg = loop.modulus_margin_std = loop.gain_margin_std_db = {};
}

}  // namespace

std::optional<Finding> judge_by_lines(const LoopResult& loop, const data::TransferFunction& controller,
                                      double confidence) {
  constexpr double kMostTurnDeg = 90.0, kClear = 0.5;
  const auto lines = lines_away_from(lines_away_from(loop.curve, 0.0, kCriteria.margin_line), -1.0, kClear);
  if (lines.lines() < 2) return not_judged("none of them is known well enough");
  const double first_hz = lines.frequency_hz.front(), last_hz = lines.frequency_hz.back();
  const double last_size = std::abs(lines.value.back());
  if (std::abs(lines.value.front()) < 1.0)
    return not_judged(
        fmt::format("|L| is below 1 already at the first that is known, {:.3g} Hz; excite lower "
                    "frequencies too",
                    first_hz));
  if (!design::begins_as_inertia(lines.value.front() / controller.response(first_hz)))
    return not_judged(fmt::format(
        "at the first that is known, {:.3g} Hz, the machine is no inertia: the line lies above an "
        "anti-resonance, or the sign is wrong; excite lower frequencies too",
        first_hz));
  const auto begin = begin_deg(lines, controller);
  if (!begin) return not_judged("the controller's gain has the wrong sign");
  const auto way = way_around_zero(lines, *begin);
  if (way.largest_turn_deg > kMostTurnDeg)
    return not_judged(
        fmt::format("at {:.3g} Hz 1 + L turns by {:.0f} deg from one to the next; record longer, "
                    "which makes them denser",
                    way.turn_hz, way.largest_turn_deg));
  const bool falls = last_size < 1.0;
  const auto turns = std::lround(way.end_deg / 360.0);
  if (falls && turns < 0)
    return Finding{
        "planned-unstable",
        Severity::warning,
        {},
        {},
        fmt::format("With the planned controller the loop is unstable: by the {}, L goes around -1. "
                    "Do not run it.",
                    loop.source == "model" ? "model" : "measured response")};
  // Less may come back: a cascade below its corners begins at -270 deg, and an anti-resonance leads by 180.
  if (!falls && way.end_deg <= -360.0)
    return Finding{
        "planned-unstable", Severity::warning, last_size, 1.0,
        fmt::format("With the planned controller the loop is unstable: at the last line that is known, "
                    "{:.3g} Hz, |L| is still {:.3g} and has gone around -1. Do not run it.",
                    last_hz, last_size)};
  if (!falls)
    return not_judged(
        fmt::format("|L| is still {:.3g} at the last that is known, {:.3g} Hz; excite higher "
                    "frequencies too",
                    last_size, last_hz));
  if (turns > 0) return not_judged("1 + L turns the other way than that of a machine that lags");
  const double each = 1.0 - (1.0 - confidence) / static_cast<double>(lines.lines());
  const double error =
      lines.std.size() == lines.lines() ? data::confidence_radius(lines.std.back(), each) : 0.0;
  if (const auto why = may_rise_above(lines, last_size + error, controller.sample_time_s))
    return not_judged(*why);
  return std::nullopt;
}

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
    if (!result.planned_loop) return;
    auto& loop = *result.planned_loop;
    if (auto finding = judge_by_lines(loop, *planned.controller, options.confidence)) {
      if (finding->id == "planned-not-judged") withdraw_margins(loop);
      result.findings.push_back(std::move(*finding));
    }
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
