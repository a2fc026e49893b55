// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <resonid/base/expected.hpp>
#include <resonid/plant/experiment.hpp>
#include <string>
#include <vector>

#include "monitor/sources/source.hpp"

namespace resonid::monitor {

/// One simulated axis. Its columns are `ru`, `u`, `y` and `position`.
struct DemoMachine {
  std::string axis;
  plant::ExperimentConfig experiment;  ///< After run.duration_s it begins again, as after a repair.
  double excited_s = 0.0;              ///< Time with excitation, then `paused_s` without it, and so on.
  double paused_s = 0.0;               ///< 0: always excited.
};

struct DemoSettings {
  std::vector<DemoMachine> machines;
  double speed = 1.0;  ///< Simulated seconds per second; times that are told go as fast.
};

/// Machines that show what is to be seen: `belt`, which loses 20 % of its stiffness from the fourth minute
/// on, `shaft`, which is not excited now and then, `conveyor` with load steps and dry friction, and `servo`,
/// a positioning axis with encoder, limits and friction.
[[nodiscard]] std::vector<DemoMachine> demo_machines();

/// Simulated drives, in step with the clock as far as the processor is fast enough: where it is not, time
/// goes slower and status() says so.
///
/// Errors: no machines; an experiment that cannot be run, or of no length; speed not in 0.01 ... 1000; times
/// not >= 0.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_demo_source(DemoSettings settings, Axes& axes);

}  // namespace resonid::monitor
