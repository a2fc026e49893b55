// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <identification/track_plan.hpp>

namespace resonid::identification {
namespace {

struct Name {
  TrackMethod method;
  std::string_view name;
};
constexpr std::array kNames = {Name{TrackMethod::automatic, "auto"},
                               Name{TrackMethod::arx, "arx"},
                               Name{TrackMethod::output_error, "oe"},
                               Name{TrackMethod::closed_loop_output_error, "cloe"},
                               Name{TrackMethod::filtered_closed_loop_output_error, "f-cloe"},
                               Name{TrackMethod::instrumental_variables, "iv"},
                               Name{TrackMethod::physical, "physical"},
                               Name{TrackMethod::kalman, "kalman"},
                               Name{TrackMethod::sliding_dft, "sliding-dft"}};

}  // namespace

std::string_view name_of(TrackMethod method) {
  return std::find_if(kNames.begin(), kNames.end(), [&](const Name& n) { return n.method == method; })->name;
}

namespace detail {
namespace {

using Refused = tl::unexpected<Error>;

bool is_lines(TrackMethod m) { return m == TrackMethod::kalman || m == TrackMethod::sliding_dft; }
bool needs_controller(TrackMethod m) {
  return m == TrackMethod::closed_loop_output_error || m == TrackMethod::filtered_closed_loop_output_error ||
         m == TrackMethod::instrumental_variables;
}

/// What a method of parameters does with the loop; line trackers follow the option.
Approach approach_of(TrackMethod m) {
  if (m == TrackMethod::instrumental_variables) return Approach::joint;
  return needs_controller(m) ? Approach::indirect : Approach::direct;
}

bool has_two_masses(const std::optional<StartModel>& start) {
  return start && start->drive.structure == fit::Structure::two_mass;
}

/// The method that suits what is known and what is excited, and why. Estimators that may be locally unstable
/// (oe, cloe) are never chosen.
void choose(const data::Record& record, const TrackOptions& options, TrackPlan& plan) {
  const bool velocity = record.output_quantity != data::OutputQuantity::acceleration;
  const auto& m = plan.measurement;
  const bool lines = m.sweep || !m.grid_hz.empty() || m.period_samples > 0;
  if (plan.start && !plan.start->trusted && lines) {
    plan.method = TrackMethod::kalman;
    plan.reason = "the model that the record shows is not to be trusted itself, so lines are tracked";
    return;
  }
  if (velocity && has_two_masses(plan.start) && !(options.memory_s > 0.0)) {
    plan.method = TrackMethod::physical;
    plan.reason =
        plan.measurement.sweep
            ? "a two-mass model to begin with is known; the machine is taken to stay while the chirp runs"
            : "a two-mass model to begin with is known; stiffness drift and load torque are tracked with it";
    return;
  }
  if (velocity && plan.start && options.common.controller && record.excitation.present() &&
      !plan.measurement.sweep) {
    plan.method = TrackMethod::instrumental_variables;
    plan.reason =
        options.memory_s > 0.0
            ? "excitation and controller are known, and a memory is wanted"
            : "the model to begin with is not a two-mass one, but excitation and controller are known";
    return;
  }
  plan.method = TrackMethod::kalman;
  plan.reason = plan.measurement.sweep
                    ? "no two-mass model to begin with: the line of the chirp is followed"
                    : "nothing to begin with that other methods could use: lines are tracked";
}

/// What the start model found beyond its known delay counts as long as that known delay is the one told now:
/// with another one, the model comes from another loop.
double delay_of(const TrackOptions& options, const TrackPlan& plan) {
  const double told = options.common.delay_s;
  if (!plan.start) return told;
  const auto& drive = plan.start->drive;
  constexpr double kSame = 1e-9;
  if (told > 0.0 && std::abs(told - drive.known_delay_s) > kSame) return told;
  return drive.known_delay_s + (drive.estimated[fit::kDelay] ? drive.delay_s : 0.0);
}

std::optional<Error> contradiction(const data::Record& record, const TrackOptions& options, TrackMethod m) {
  const auto name = name_of(m);
  if (m == TrackMethod::physical && options.memory_s > 0.0)
    return Error{
        "memory_s",
        "physical forgets by the rate at which the stiffness may change, not by a memory: leave it out"};
  if (is_lines(m)) return std::nullopt;
  if (record.output_quantity == data::OutputQuantity::acceleration)
    return Error{"method", fmt::format("{} needs a velocity or a position, found an acceleration; kalman and "
                                       "sliding-dft take it",
                                       name)};
  if (options.common.approach && *options.common.approach != approach_of(m))
    return Error{"approach", fmt::format("{} is {}, found {}", name, name_of(approach_of(m)),
                                         name_of(*options.common.approach))};
  if (!needs_controller(m)) return std::nullopt;
  if (!record.excitation.present())
    return Error{"excitation", fmt::format("{} needs the excitation signal: give .excitation", name)};
  if (!options.common.controller)
    return Error{"controller", fmt::format("{} needs the controller: give .controller", name)};
  return std::nullopt;
}

}  // namespace

expected<TrackPlan, Error> make_track_plan(const data::Record& record, const TrackOptions& options) {
  Options common = options.common;
  common.method = Method::automatic;
  if (!is_lines(options.method) && options.method != TrackMethod::automatic) common.lines_hz.clear();
  auto measurement = make_plan(record, common);
  if (!measurement) return Refused(measurement.error());
  TrackPlan plan;
  plan.measurement = std::move(*measurement);
  plan.method = options.method;
  if (!is_lines(options.method)) plan.start = find_start(record, options, plan.measurement);
  if (plan.start && plan.start->drive.structure == fit::Structure::three_mass) {
    if (options.method != TrackMethod::automatic)
      return Refused(Error{"start",
                           "is a three-mass model; trackers of parameters follow a rigid or a two-mass "
                           "drive, trackers of lines need no model"});
    plan.start.reset();
  }
  if (options.method == TrackMethod::automatic) choose(record, options, plan);
  if (auto refusal = contradiction(record, options, plan.method)) return Refused(std::move(*refusal));
  if (is_lines(plan.method)) plan.start.reset();
  plan.approach = is_lines(plan.method) ? plan.measurement.approach : approach_of(plan.method);
  plan.delay_s = delay_of(options, plan);
  const auto& m = plan.measurement;
  if (options.method == TrackMethod::automatic && plan.method == TrackMethod::kalman && !m.sweep &&
      m.period_samples == 0 && m.grid_hz.empty())
    return Refused(
        Error{"method", fmt::format("auto found nothing to track in these {} samples: no model shows in "
                                    "them, and the excitation has no period; give .start, .lines_hz, or "
                                    "a longer record",
                                    record.samples())});
  return plan;
}

TrackerMade make_tracker(const data::Record& record, const TrackOptions& options, const TrackPlan& plan) {
  switch (plan.method) {
    case TrackMethod::kalman:
      if (plan.measurement.sweep) return make_chirp_tracker(record, options, plan);
      return make_line_tracker(record, options, plan);
    case TrackMethod::sliding_dft:
      return make_line_tracker(record, options, plan);
    case TrackMethod::physical:
      return make_physical_tracker(record, options, plan);
    default:
      return make_discrete_tracker(record, options, plan);
  }
}

}  // namespace detail
}  // namespace resonid::identification
