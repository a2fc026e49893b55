// SPDX-License-Identifier: MIT
#include "plant/elastic_drive.hpp"
#include "plant/elastic_drives.hpp"

namespace resonid::plant {

std::unique_ptr<Drive> other_elastic_drive(Machine machine, double sample_time_s, double early_fraction) {
  static_assert(kMaxMasses == 6);
  constexpr std::array kMakers{elastic_drive_of<1>, elastic_drive_of<3>, elastic_drive_of<4>,
                               elastic_drive_of<5>, elastic_drive_of<6>};
  const std::size_t masses = machine.masses();
  return kMakers[masses == 1 ? 0 : masses - 2](std::move(machine), sample_time_s, early_fraction);
}

}  // namespace resonid::plant
