// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <optional>
#include <resonid/design/detail/bounds.hpp>
#include <resonid/fit/drive_model.hpp>
#include <string>
#include <vector>

#include "design/controller.hpp"
#include "design/global_search.hpp"
#include "design/largest_gain.hpp"

// State feedback with a Kalman filter that observes the load torque as well (docs/methods/tune.md 10).
namespace resonid::design {

/// Of squares in the sum that is made least, and variances per sample. Ratios alone matter: of the first
/// three to the torque's, of the next two to that of the measurement.
struct StateWeights {
  double load_speed = 1.0;   ///< (rad/s)^-2
  double twist = 0.0;        ///< Driven less load angle, rad^-2
  double motor_speed = 0.0;  ///< (rad/s)^-2
  double torque = 1.0;       ///< Nm^-2

  double load_torque_walk = 1.0;   ///< Variance of its steps, Nm^2
  double torque_noise = 1.0;       ///< Variance of torque beside the commanded one, Nm^2
  double measurement_noise = 1.0;  ///< (rad/s)^2
};

/// What a state of the machine is, and what it takes in its own unit.
struct FeedbackState {
  std::string name;            ///< "velocity of the driven side", "load torque"
  std::string unit;            ///< "rad/s", "rad", "Nm"
  double gain = 0.0;           ///< u = -gain times the state, summed over them.
  double observer_gain = 0.0;  ///< Of the state per rad/s by which the measurement differs from its estimate.
};

/// The states are those of fit::SampledStates that something follows from, delays included, and the load
/// torque last.
struct StateFeedback {
  Eigen::RowVectorXd gain;  ///< u = -gain x; the load torque's takes the speeds to 0 in the steady state.
  Eigen::VectorXd observer_gain;  ///< x(k|k) = x(k|k-1) + observer_gain (y - measured x(k|k-1))
  Eigen::RowVectorXd load_speed;  ///< By the states, rad/s: what no sensor sees.
  Eigen::RowVectorXd twist;     ///< By the states, rad; times the stiffness (of one spring) the shaft torque.
  ControllerStates controller;  ///< From velocity error to torque; its states are x(k|k-1).
  std::vector<FeedbackState> states;  ///< The same gains, of twists in rad.
};
/// Nothing where a Riccati equation has no solution that makes the loop stable.
[[nodiscard]] std::optional<StateFeedback> state_feedback(const fit::DriveModel& model,
                                                          const StateWeights& weights);

struct StateFeedbackDesign {
  StateWeights weights;
  StateFeedback feedback;
  double iae = 0.0, exceeded = 0.0;
  GlobalSearch::Point point = {};  ///< Where the next search, for further machines, may go on from.
};
/// Over the five ratios of the weights, by the first of the machines, judged on all of them. `from`: the
/// point of an earlier design, from which alone is gone on.
[[nodiscard]] std::optional<StateFeedbackDesign> search_state_feedback(
    Machines& machines, const Bounds& bounds, const GlobalSearch::Effort& effort = {50, 40, 1},
    const GlobalSearch::Point& from = {});

}  // namespace resonid::design
