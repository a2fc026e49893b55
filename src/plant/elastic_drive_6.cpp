// SPDX-License-Identifier: MIT
#include "plant/elastic_drive.hpp"
#include "plant/elastic_drives.hpp"

namespace resonid::plant {

std::unique_ptr<Drive> elastic_drive_of_six(Machine machine, double sample_time_s, double early_fraction) {
  return machine.masses() == 5 ? make_elastic<5>(std::move(machine), sample_time_s, early_fraction)
                               : make_elastic<6>(std::move(machine), sample_time_s, early_fraction);
}

}  // namespace resonid::plant
