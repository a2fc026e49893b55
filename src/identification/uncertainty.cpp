// SPDX-License-Identifier: MIT
#include <algorithm>
#include <identification/uncertainty.hpp>

namespace resonid::identification::detail {

std::vector<Resonance> resonances_of(const fit::DriveModel& drive) {
  std::vector<Resonance> found;
  for (const auto& mode : drive.modes())
    found.push_back({mode.anti, mode.frequency_hz.value, mode.frequency_hz.standard_deviation,
                     mode.damping_ratio.value, true, mode.damping_ratio.standard_deviation});
  return found;
}

}  // namespace resonid::identification::detail
