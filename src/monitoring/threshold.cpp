// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <monitoring/threshold.hpp>

namespace resonid::monitoring {

expected<double, Error> detector_interval_s(double installation_s, std::size_t detectors) noexcept {
  if (!(installation_s > 0.0) || !std::isfinite(installation_s))
    return refuse("false_alarm_interval_s", "must be > 0", installation_s);
  if (detectors == 0) return refuse("detectors", "must be at least one", 0.0);
  return installation_s * static_cast<double>(detectors);
}

double installation_interval_s(std::span<const Detectors> detectors) noexcept {
  double rate = 0.0;
  for (const Detectors& d : detectors)
    if (d.count > 0) rate += static_cast<double>(d.count) / d.false_alarm_interval_s;
  return rate > 0.0 ? 1.0 / rate : std::numeric_limits<double>::infinity();
}

}  // namespace resonid::monitoring
