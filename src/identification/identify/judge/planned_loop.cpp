// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/planned_loop.hpp>
#include <identification/tune/checks.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/online/supervision/loop_margins.hpp>

#include "design/between_lines.hpp"
#include "design/closed_loop.hpp"
#include "design/ends_of_lines.hpp"
#include "design/response_disks.hpp"
#include "design/same_crossing.hpp"

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
  if (loop.margins.gain_margin_hz)
    loop.gain_margin_std_db = gain_margin_std_db(loop.curve, *loop.margins.gain_margin_hz);
}

/// The errors of a model's crossings by its covariance, to first order; `loop_with`: the loop of another
/// model.
template <class Model, class LoopWith>
void take_model_errors(const Model& model, const LoopWith& loop_with, LoopResult& loop) {
  for (auto& crossing : loop.crossings)
    crossing.phase_margin_std_deg = model.standard_deviation_of([&](const Model& moved) {
      const auto other = loop_with(moved);
      const auto crossings = other ? crossings_of(other->curve) : std::vector<LoopCrossing>();
      const auto* same = design::same_crossing(crossings, loop.crossings, crossing);
      return same ? std::remainder(same->phase_margin_deg - crossing.phase_margin_deg, 360.0) : 0.0;
    });
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
  for (auto& crossing : loop.crossings)
    if (auto& std = crossing.phase_margin_std_deg)
      std = std::hypot(*std, 360.0 * crossing.frequency_hz * std_s);
}

/// Of every line, within which the machine is on all of them.
std::vector<double> radii_of_machine(const data::FrequencyResponse& loop,
                                     const data::TransferFunction& controller, double confidence) {
  const double each = 1.0 - (1.0 - confidence) / static_cast<double>(loop.lines());
  std::vector<double> radii;
  for (std::size_t i = 0; i < loop.lines(); ++i)
    radii.push_back(loop.std.empty() ? 0.0
                                     : data::confidence_radius(loop.std[i], each) /
                                           std::abs(controller.response(loop.frequency_hz[i])));
  return radii;
}

/// L at the lines and between them, by what the machine does there.
design::FilledLines filled_loop(const data::FrequencyResponse& loop, const data::TransferFunction& controller,
                                std::span<const double> radii, double known_delay_s) {
  std::vector<std::complex<double>> machine;
  for (std::size_t i = 0; i < loop.lines(); ++i)
    machine.push_back(loop.value[i] / controller.response(loop.frequency_hz[i]));
  auto filled = design::between_lines(loop.frequency_hz, machine, radii, known_delay_s);
  for (std::size_t i = 0; i < filled.values.size(); ++i)
    filled.values[i] *= controller.response(filled.frequencies_hz[i]);
  return filled;
}

/// The way of 1 + L from line to line.
struct WayAroundZero {
  double end_deg = 0.0;                          ///< arg(1 + L) at the last line, without jumps.
  double largest_turn_deg = 0.0, turn_hz = 0.0;  ///< Between neighbouring lines.
};
WayAroundZero way_around_zero(const design::FilledLines& loop, double begin_deg) {
  WayAroundZero way;
  way.end_deg = begin_deg;
  double turn = 0.0;
  for (std::size_t i = 1; i < loop.values.size(); ++i) {
    turn += std::arg((1.0 + loop.values[i]) / (1.0 + loop.values[i - 1])) * 180.0 / kPi;
    if (!loop.measured[i]) continue;
    way.end_deg += turn;
    if (std::abs(turn) > way.largest_turn_deg) {
      way.largest_turn_deg = std::abs(turn);
      way.turn_hz = loop.frequencies_hz[i];
    }
    turn = 0.0;
  }
  return way;
}

/// Whether the machine is an inertia at the first line: between an anti-resonance and its resonance a delay
/// may give it the phase of one, but its response rises.
bool begins_below_resonances(const data::FrequencyResponse& loop, const data::TransferFunction& controller) {
  constexpr double kNear = 1.2, kRise = 1.1;
  const double first_hz = loop.frequency_hz.front();
  if (!design::begins_as_inertia(loop.value.front() / controller.response(first_hz))) return false;
  const auto machine = [&](std::size_t i, double deviations) {
    const double std = loop.std.empty() ? 0.0 : loop.std[i];
    return (std::abs(loop.value[i]) + deviations * std) / std::abs(controller.response(loop.frequency_hz[i]));
  };
  for (std::size_t i = 1; i < loop.lines() && loop.frequency_hz[i] <= kNear * first_hz; ++i)
    if (machine(i, -1.0) > kRise * machine(0, 1.0)) return false;
  return true;
}

/// arg(1 + L) at the first line, on the turn that it reaches from below. There a machine that integrates its
/// torque and k integrators of the controller make -90 (1 + k) deg; nothing where the sign is another.
std::optional<double> begin_deg(const data::FrequencyResponse& loop, const data::TransferFunction& controller,
                                int integrators) {
  const double first_hz = loop.frequency_hz.front();
  const auto begin = design::angle_at_first_line(
      loop.value.front() / controller.response(first_hz), integrators, design::kStepsBelowFirstLine,
      [&](double part) { return controller.response(part * first_hz); });
  if (!begin) return std::nullopt;
  return *begin * 180.0 / kPi;
}

/// What no line shows: a resonance above the last one may lift |L| to 1.
std::optional<std::string> may_rise_above(const data::FrequencyResponse& lines,
                                          const data::TransferFunction& controller,
                                          const design::ControllerByLines& outside,
                                          std::span<const double> radii) {
  std::vector<double> sizes;
  for (std::size_t i = 0; i < lines.lines(); ++i)
    sizes.push_back(std::abs(lines.value[i]) / std::abs(controller.response(lines.frequency_hz[i])));
  const auto end = design::machine_end(lines.frequency_hz, sizes, radii, controller.sample_time_s);
  if (!design::ends_too_large(end, outside.largest_beyond)) return std::nullopt;
  return end_of_lines_words(lines.frequency_hz.back(), end.size * outside.largest_beyond, end, outside.grows);
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
  loop.crossings.clear();
  loop.margins.crossovers.clear();
  loop.margins.worst_phase_margin_deg.reset();
  loop.margins.gain_margin_db.reset();
  loop.margins.gain_margin_hz.reset();
  loop.crossover_std_hz = loop.phase_margin_std_deg = loop.modulus_margin_std = loop.gain_margin_std_db = {};
}

}  // namespace

std::vector<LoopCrossing> crossings_of(const data::FrequencyResponse& loop) {
  std::vector<LoopCrossing> crossings;
  const bool known = loop.std.size() == loop.lines();
  for (std::size_t i = 1; i < loop.lines(); ++i) {
    // Upside down, 1/conj(L), a loop that rises through 1 falls there, with the same phase.
    const bool falling = std::abs(loop.value[i - 1]) >= 1.0;
    online::MarginScan<double> scan;
    for (const std::size_t k : {i - 1, i}) {
      const auto value = falling ? loop.value[k] : 1.0 / std::conj(loop.value[k]);
      const double std =
          known ? loop.std[k] * std::abs(value / loop.value[k]) : online::LoopMargins<double>::kAbsent;
      scan.step(loop.frequency_hz[k], value, std);
    }
    const auto& found = scan.margins();
    if (std::isnan(found.crossover_hz)) continue;
    crossings.push_back({{found.crossover_hz, found.phase_margin_deg}, falling});
    if (std::isfinite(found.phase_margin_std_deg))
      crossings.back().phase_margin_std_deg = found.phase_margin_std_deg;
  }
  return crossings;
}

/// As that of a crossover, with the parts of ln|L| and arg L exchanged: the crossing of -180 deg moves with
/// the errors of arg L, and |L| with the crossing.
std::optional<double> gain_margin_std_db(const data::FrequencyResponse& loop, double at_hz) {
  if (loop.std.size() != loop.lines()) return std::nullopt;
  const auto above = std::upper_bound(loop.frequency_hz.begin(), loop.frequency_hz.end(), at_hz);
  if (above == loop.frequency_hz.begin() || above == loop.frequency_hz.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(above - loop.frequency_hz.begin());
  const double low_hz = loop.frequency_hz[i - 1], high_hz = loop.frequency_hz[i];
  const auto variance = [&](std::size_t k) { return 0.5 * std::norm(loop.std[k] / loop.value[k]); };
  const auto mixed = [&](double part) {
    return (1.0 - part) * (1.0 - part) * variance(i - 1) + part * part * variance(i);
  };
  const auto ratio = loop.value[i] / loop.value[i - 1];
  const double octaves = std::log(high_hz / low_hz);
  const double moves_hz =
      (high_hz - low_hz) / std::arg(ratio) * std::sqrt(mixed((at_hz - low_hz) / (high_hz - low_hz)));
  const double along = std::log(std::abs(ratio)) / octaves * moves_hz / at_hz;
  const double std_db =
      20.0 / std::log(10.0) * std::sqrt(mixed(std::log(at_hz / low_hz) / octaves) + along * along);
  return std::isfinite(std_db) ? std::optional<double>(std_db) : std::nullopt;
}

std::optional<Finding> inspect_planned_margins(const LoopResult& loop) {
  constexpr double kSure = 2.0;  // standard deviations
  const auto& m = loop.margins;
  if (const auto std = loop.modulus_margin_std; std && m.modulus_margin - kSure * *std <= 0.0)
    return Finding{
        "planned-may-be-unstable", Severity::warning, m.modulus_margin, kSure * *std,
        fmt::format("With the planned controller the loop may be unstable: its smallest distance to "
                    "-1 (modulus margin) is {:.2g} at {:.3g} Hz, known to no better than {:.2g}. Do "
                    "not run it; lower its gain, or measure more precisely around that frequency.",
                    m.modulus_margin, m.modulus_margin_hz, kSure * *std)};
  const auto worst = m.worst_phase_margin_deg;
  const bool lags = worst && std::abs(*worst) < kCriteria.phase_margin_deg;
  if (!lags && !(m.modulus_margin < kCriteria.modulus_margin)) return std::nullopt;
  const auto phase = lags ? fmt::format(
                                "the smallest phase margin is {:.1f} deg, where {:.0f} deg or more is "
                                "usual; ",
                                std::abs(*worst), kCriteria.phase_margin_deg)
                          : std::string();
  return Finding{"planned-small-margins", Severity::warning, lags ? std::abs(*worst) : m.modulus_margin,
                 lags ? kCriteria.phase_margin_deg : kCriteria.modulus_margin,
                 fmt::format("With the planned controller the loop is close to oscillating: {}the smallest "
                             "distance to -1 (modulus margin) is {:.2f} at {:.3g} Hz, where {:g} or more is "
                             "usual. Lower its gain.",
                             phase, m.modulus_margin, m.modulus_margin_hz, kCriteria.modulus_margin)};
}

std::optional<Finding> judge_by_lines(const LoopResult& loop, const data::TransferFunction& controller,
                                      double confidence, double known_delay_s) {
  constexpr double kMostTurnDeg = 90.0, kClear = 0.5;
  const auto lines = lines_away_from(lines_away_from(loop.curve, 0.0, kCriteria.margin_line), -1.0, kClear);
  if (lines.lines() < 2)
    return not_judged("the loop is known well enough at none of them, or its controller is 0 there");
  const auto outside = design::controller_by_lines(controller, lines.frequency_hz);
  if (!outside) return not_judged("the planned controller " + outside.error().requirement.str());
  const double first_hz = lines.frequency_hz.front(), last_hz = lines.frequency_hz.back();
  const double last_size = std::abs(lines.value.back());
  if (std::abs(lines.value.front()) < 1.0)
    return not_judged(
        fmt::format("|L| is below 1 already at the first that is known, {:.3g} Hz; excite lower "
                    "frequencies too",
                    first_hz));
  if (!begins_below_resonances(lines, controller))
    return not_judged(fmt::format(
        "at the first that is known, {:.3g} Hz, the machine is no inertia: the line lies above an "
        "anti-resonance, or the sign is wrong; excite lower frequencies too",
        first_hz));
  const auto begin = begin_deg(lines, controller, outside->integrators);
  if (!begin) return not_judged("the controller's gain has the wrong sign");
  const auto radii = radii_of_machine(lines, controller, confidence);
  const auto way = way_around_zero(filled_loop(lines, controller, radii, known_delay_s), *begin);
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
  if (const auto why = may_rise_above(lines, controller, *outside, radii)) return not_judged(*why);
  return std::nullopt;
}

namespace {

/// Its stability by the closed loop's poles, where a drive model was identified, else by its lines.
std::optional<Finding> judge_stability(const Measurement& m, const Options& planned, const PlantModel& model,
                                       const std::optional<LoopResult>& loop) {
  const auto* drive = std::get_if<fit::DriveModel>(&model);
  if (drive == nullptr)
    return loop ? judge_by_lines(*loop, *planned.controller, planned.confidence, planned.delay_s)
                : std::nullopt;
  fit::DriveModel real = *drive;
  real.known_delay_s =
      planned.delay_s + 0.5 * static_cast<double>(m.plan.hold.samples - 1) * real.sample_time_s;
  const double radius = design::closed_loop(fit::sampled_states(real), design::states_of(*planned.controller))
                            .spectral_radius();
  if (radius < design::kStableRadius) return std::nullopt;
  return Finding{
      "planned-unstable", Severity::warning, radius, 1.0,
      "With the planned controller the loop is unstable on the identified machine. Do not run it."};
}

}  // namespace

void judge_planned_loop(const Measurement& m, const Options& options, const PlantModel& model,
                        Result& result) {
  Options planned = options;
  planned.controller = options.planned_controller->sampled(1.0 / result.record.sample_rate_hz);
  const auto loop_with = [&](const PlantModel& machine) {
    return loop_of(m.plan, planned, m.lines, result.response, machine);
  };
  result.planned_loop = loop_with(model);
  auto finding = judge_stability(m, planned, model, result.planned_loop);
  if (result.planned_loop) {
    auto& loop = *result.planned_loop;
    const auto take_errors_of = [&](const auto& machine) {
      take_model_errors(
          machine, [&](const auto& moved) { return loop_with(plain(PlantModel(moved))); }, loop);
    };
    if (loop.source == "response") read_from_known_lines(loop);
    loop.crossings = crossings_of(loop.curve);
    if (const auto* box = std::get_if<fit::BlackBoxModel>(&model)) take_errors_of(*box);
    if (const auto* drive = std::get_if<fit::DriveModel>(&model)) {
      take_errors_of(*drive);
      if (!has_delay_std(result)) include_delay_error(assumed_delay_std(result), loop);
    }
    if (!finding) finding = inspect_planned_margins(loop);
    static_cast<void>(keep_to_band(m.plan, false, loop));
    if (loop.source == "model")
      for (auto& crossing : loop.crossings)
        if (crossing.frequency_hz > kCriteria.beyond_band * m.plan.high_hz)
          crossing.phase_margin_std_deg.reset();
    if (finding && finding->id == "planned-not-judged") withdraw_margins(loop);
  }
  if (finding) result.findings.push_back(std::move(*finding));
}

}  // namespace resonid::identification::detail
