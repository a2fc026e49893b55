// SPDX-License-Identifier: MIT
#include "plant/bent_drive.hpp"
#include "plant/elastic_drives.hpp"

namespace resonid::plant {

std::unique_ptr<Drive> bent_drive(Machine machine, double sample_time_s, double early_fraction) {
  if (machine.config().torque_lag_s > 0.0)
    return std::make_unique<BentDrive<true>>(std::move(machine), sample_time_s, early_fraction);
  return std::make_unique<BentDrive<false>>(std::move(machine), sample_time_s, early_fraction);
}

}  // namespace resonid::plant
