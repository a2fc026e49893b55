// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <resonid/plant/experiment.hpp>

namespace resonid::identification {

/// The identified machine as an experiment: its model with dry friction, lags, delay and torque limit.
[[nodiscard]] plant::ExperimentConfig experiment_of(const Result& result, const TuneOptions& options);

/// Runs the proposed controller, and the running one, on the drive of an experiment: a reference step, a step
/// of the load's torque, and the motion of the experiment where it has one; without noise and excitation.
/// What the loop does there stands beside what was promised. A drive on which the loop is unstable is a
/// finding; anything else that the experiment does not allow is refused.
[[nodiscard]] expected<void, Error> simulate_on(Tuning& tuning, const plant::ExperimentConfig& experiment);

/// The same on the identified machine; a model that cannot be simulated is a finding.
void simulate_on_model(Tuning& tuning, const Result& result);

}  // namespace resonid::identification
