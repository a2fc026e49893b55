// SPDX-License-Identifier: MIT
#include <resonid/online/excitation/stepped_sine.hpp>

namespace resonid::online {

expected<void, Error> check(const SteppedSineConfig& c, std::size_t max_lines) noexcept {
  if (!(c.sample_rate_hz > 0.0)) return refuse("sample_rate_hz", "must be > 0", c.sample_rate_hz);
  if (c.frequency_hz.empty()) return refuse("lines_hz", "must hold at least one frequency");
  if (c.frequency_hz.size() > max_lines)
    return refuse("lines_hz", "holds more lines than there is room for",
                  static_cast<double>(c.frequency_hz.size()));
  for (const double f : c.frequency_hz)
    if (!(f > 0.0 && f < 0.5 * c.sample_rate_hz))
      return refuse("lines_hz", "must be > 0 and below half the sample rate", f);
  if (!(c.amplitude > 0.0)) return refuse("amplitude", "must be > 0", c.amplitude);
  if (!(c.settle_periods >= 0.0 && c.settle_periods <= 1e6))
    return refuse("settle_periods", "must be 0 ... 1e6", c.settle_periods);
  if (!(c.measure_periods >= 1.0 && c.measure_periods <= 1e6))
    return refuse("measure_periods", "must be 1 ... 1e6", c.measure_periods);
  for (const double f : c.frequency_hz)
    if (!((c.settle_periods + c.measure_periods) * c.sample_rate_hz / f <= 1e12))
      return refuse("lines_hz", "must be high enough for its periods to last at most 1e12 samples", f);
  return {};
}

}  // namespace resonid::online
