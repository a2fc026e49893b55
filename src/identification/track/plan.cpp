// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <identification/track/plan.hpp>

namespace resonid::identification::detail {
namespace {

using Refused = tl::unexpected<Error>;

bool needs_controller(TrackMethod m) {
  switch (m) {
    case TrackMethod::closed_loop_output_error:
    case TrackMethod::filtered_closed_loop_output_error:
    case TrackMethod::damped_closed_loop_output_error:
    case TrackMethod::instrumental_variables:
      return true;
    default:
      return false;
  }
}

/// By recursive least squares, whose forgetting can be chosen.
bool is_recursion(TrackMethod m) {
  return m == TrackMethod::arx || m == TrackMethod::output_error || m == TrackMethod::prediction_error ||
         (needs_controller(m) && m != TrackMethod::instrumental_variables);
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
void choose(const data::Record& stretch, const TrackOptions& options, TrackPlan& plan) {
  const bool velocity = stretch.output_quantity != data::OutputQuantity::acceleration;
  const auto& m = plan.measurement;
  const bool lines = m.sweep || !m.grid_hz.empty() || m.period_samples > 0;
  if (plan.start && !plan.start->trusted && lines) {
    plan.method = TrackMethod::kalman;
    plan.reason = "the model identified from the recording is itself not reliable, so lines are tracked";
    return;
  }
  if (velocity && has_two_masses(plan.start) && !(options.memory_s > 0.0)) {
    plan.method = TrackMethod::physical;
    plan.reason =
        plan.measurement.sweep
            ? "a two-mass initial model is known; the machine is assumed constant during the chirp"
            : "a two-mass initial model is known; stiffness drift and load torque are tracked with it";
    return;
  }
  if (velocity && plan.start && options.common.controller && stretch.excitation.present() &&
      !plan.measurement.sweep) {
    plan.method = TrackMethod::instrumental_variables;
    plan.reason = options.memory_s > 0.0
                      ? "excitation and controller are known, and a memory was requested"
                      : "the initial model is not a two-mass one, but excitation and controller are known";
    return;
  }
  plan.method = TrackMethod::kalman;
  plan.reason = plan.measurement.sweep ? "no two-mass initial model: the line of the chirp is tracked"
                                       : "no initial model that other methods could use: lines are tracked";
}

/// What the initial model found beyond its known delay counts as long as that known delay is the one told
/// now: with another one, the model comes from another loop.
double delay_of(const TrackOptions& options, const TrackPlan& plan) {
  const double told = options.common.delay_s;
  if (!plan.start) return told;
  const auto& drive = plan.start->drive;
  constexpr double kSame = 1e-9;
  if (told > 0.0 && std::abs(told - drive.known_delay_s) > kSame) return told;
  return drive.known_delay_s + (drive.estimated[fit::kDelay] ? drive.delay_s : 0.0);
}

}  // namespace

std::optional<Error> contradiction(const data::Record& record, const TrackOptions& options, TrackMethod m) {
  const auto name = name_of(m);
  if (options.forgetting != online::Forgetting::constant && !is_recursion(m))
    return Error{"forgetting",
                 fmt::format("is a choice of arx, oe, rpem, cloe, f-cloe and d-cloe, found {}", name)};
  if (options.extrapolate && m != TrackMethod::instrumental_variables)
    return Error{"extrapolate", fmt::format("is for iv, found {}", name)};
  const bool knows_friction =
      m == TrackMethod::arx || m == TrackMethod::instrumental_variables || m == TrackMethod::physical;
  if (estimates_dry_friction(options) && !knows_friction && options.method != TrackMethod::automatic)
    return Error{"friction", fmt::format("dry is estimated by arx, iv and physical, found {}", name)};
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

namespace {

/// Whether there is what trackers of lines need. One line alone may be the beginning of a sweep, or the first
/// of stepped sines.
bool shows_lines(const data::Record& stretch, const TrackPlan& plan, bool final) {
  const auto& m = plan.measurement;
  if (m.sweep || !m.grid_hz.empty()) return true;
  return m.period_samples > 0 && (final || excited_lines_hz(stretch, plan, {}).size() > 1);
}

}  // namespace

expected<std::optional<TrackPlan>, Error> make_track_plan(const data::Record& stretch,
                                                          const TrackOptions& options, bool final) {
  Options common = options.common;
  common.method = Method::automatic;
  if (!is_lines(options.method) && options.method != TrackMethod::automatic) common.lines_hz.clear();
  auto measurement = make_plan(stretch, common);
  if (!measurement) return Refused(measurement.error());
  TrackPlan plan;
  plan.learned_samples = stretch.samples();
  plan.measurement = std::move(*measurement);
  plan.method = options.method;
  auto& sweep = plan.measurement.sweep;
  if (sweep && !common.chirp && !options.whole_record) {
    sweep = running_sweep(stretch, *sweep);
    if (!sweep) plan.measurement.grid_hz = common.lines_hz;
  }
  const bool automatic = options.method == TrackMethod::automatic;
  if (!is_lines(options.method)) plan.start = find_start(stretch, options, plan.measurement, final);
  if (plan.start && plan.start->drive.structure == fit::Structure::three_mass) {
    if (!automatic)
      return Refused(Error{"start",
                           "is a three-mass model; trackers of parameters follow a rigid or a two-mass "
                           "drive, trackers of lines need no model"});
    plan.start.reset();
  }
  if (automatic) choose(stretch, options, plan);
  if (auto refusal = contradiction(stretch, options, plan.method)) return Refused(std::move(*refusal));
  if (is_lines(plan.method)) plan.start.reset();
  plan.approach = is_lines(plan.method) ? plan.measurement.approach : approach_of(plan.method);
  plan.delay_s = delay_of(options, plan);
  // A chirp passes a resonance once, and perhaps late: its line is followed from where its law is known.
  const bool waits = automatic && !final && !sweep;
  if (is_lines(plan.method) ? waits || !shows_lines(stretch, plan, final) : !plan.start) return std::nullopt;
  return plan;
}

}  // namespace resonid::identification::detail
