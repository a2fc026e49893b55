// SPDX-License-Identifier: MIT
#include <algorithm>
#include <identification/uncertainty.hpp>

namespace resonid::identification::detail {

std::vector<Resonance> resonances_of(const fit::DriveModel& drive) {
  if (drive.structure == fit::Structure::rigid) return {};
  const auto ratio = [&](double (*of)(const data::TwoMassParameters&)) {
    return fit::Estimate{of(drive.parameters), drive.standard_deviation_of([&](const fit::DriveModel& m) {
                           return of(m.parameters);
                         })};
  };
  const auto entry = [](bool anti, const fit::Estimate& frequency, const fit::Estimate& damping) {
    return Resonance{anti, frequency.value,           frequency.standard_deviation, damping.value,
                     true, damping.standard_deviation};
  };
  return {entry(true, drive.antiresonance(), ratio(data::antiresonance_damping_ratio)),
          entry(false, drive.resonance(), ratio(data::resonance_damping_ratio))};
}

}  // namespace resonid::identification::detail
