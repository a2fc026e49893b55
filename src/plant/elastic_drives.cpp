// SPDX-License-Identifier: MIT
#include "plant/elastic_drives.hpp"

#include "plant/elastic_drive.hpp"

namespace resonid::plant {

std::unique_ptr<Drive> elastic_drive(Machine machine, double sample_time_s, double early_fraction) {
  return machine.masses() == 2 ? elastic_drive_of<2>(std::move(machine), sample_time_s, early_fraction)
                               : other_elastic_drive(std::move(machine), sample_time_s, early_fraction);
}

}  // namespace resonid::plant
