// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/identification/tune.hpp>
#include <span>
#include <string>
#include <vector>

#include "design/cascade.hpp"
#include "design/closed_loop.hpp"
#include "design/controller.hpp"
#include "design/machine.hpp"
#include "design/pid.hpp"
#include "design/rst.hpp"
#include "design/state_feedback.hpp"

namespace resonid::identification {

/// A controller with what its figures need beside its loop.
struct Law {
  design::LinearController linear;  ///< From velocity error to torque.
  TunedController what = {};        ///< Structure, name, gains; figures are put in later.
};

[[nodiscard]] Law law_of(const design::FilteredPi& controller, double sample_time_s);
[[nodiscard]] Law law_of(const design::Cascade& cascade, double sample_time_s);
[[nodiscard]] Law law_of(const design::Pid& pid, double sample_time_s);
[[nodiscard]] Law law_of(const design::Rst& rst, double sample_time_s);
[[nodiscard]] Law law_of(const design::StateFeedback& feedback, double sample_time_s);
/// Of any transfer function; a PI is known as one, and a P.
[[nodiscard]] Law law_of(const data::TransferFunction& controller);

/// A given cascade, C (1 + kv q); nothing where C is no PI.
[[nodiscard]] std::optional<Law> law_of(const data::TransferFunction& controller, double position_gain);

/// Of a controller that has been described.
[[nodiscard]] Law law_of(const TunedController& controller);

/// The torque that takes a machine along a reference, and how late it measures.
[[nodiscard]] TunedFeedForward feed_forward_of(const fit::DriveModel& machine, double coulomb);

/// Whether a controller has a pole at 1: by its gains, where it has them; else by its coefficients.
[[nodiscard]] bool integrates(const TunedController& controller);

/// Gives a PI, PID, RST or state feedback a set-point weight: a PID's derivative takes the velocity alone, of
/// the latter two T is b R + (1 - b) R(1).
void set_weight(Law& law, double weight);

/// Gives a law another way of the reference: of a PI a set-point weight.
void set_reference(Law& law, const std::vector<double>& numerator);

/// Sends the reference of a law with a T of its own through a lag of the first order, which is 1 at
/// standstill, as short as keeps the torque of a step of 1 below `most` on every machine: as a factor of S
/// and R, so that T keeps its degree. As it was where the torque is small enough, or no lag is long enough.
void limit_reference_torque(Law& law, std::span<const design::Machine> machines, double most);

/// The loop with the reference as the law takes it: set-point weight, T of an RST.
[[nodiscard]] design::ClosedLoop loop_of(const design::Machine& machine, const Law& law);

/// What steps do, sample by sample.
struct StepResponses {
  /// Velocity of the load after a step of the velocity reference by 1, of a cascade the position of the load
  /// after a step of the position reference by 1; the torque meanwhile.
  std::vector<double> load_by_reference, torque_by_reference;
  /// The same after a torque step of 1 on the load, against it.
  std::vector<double> load_by_torque;
  /// Whether they show what comes until the loop has settled; else what depends on the end is not known.
  bool whole = true;
};
[[nodiscard]] StepResponses step_responses(const design::Machine& machine, const Law& law,
                                           std::size_t samples);

/// What a step of the velocity reference by 1 does.
struct ReferenceStep {
  double overshoot = 0.0;    ///< Of the load, part of the step.
  double peak_torque = 0.0;  ///< Per unit of the step.
};
[[nodiscard]] ReferenceStep reference_step_of(const design::Machine& machine, const Law& law);
/// The largest set-point weight, up to `most`, that keeps overshoot and torque of the reference step. Of the
/// overshoot a tenth is left as room (docs/methods/tune.md 17.5).
[[nodiscard]] double largest_weight(const design::Machine& machine, const Law& law,
                                    const TuneOptions& options, double most = 1.0);

}  // namespace resonid::identification
