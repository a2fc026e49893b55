// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <identification/criteria.hpp>
#include <identification/identify/measure/orientation.hpp>
#include <tuple>
#include <vector>

namespace resonid::identification::detail {
namespace {

/// What the known lines of a stretch of a factor of 3 in frequency do.
struct Trend {
  double first_hz = 0.0, last_hz = 0.0;
  double slope = 0.0;  ///< d ln|G| / d ln f
  bool known = false;  ///< By three lines or more.
  bool leads = false;  ///< By about 90 degrees, most of them.
};

Trend trend_of(const data::FrequencyResponse& g, bool lowest) {
  constexpr double kReach = 3.0;
  std::vector<std::size_t> lines;
  for (std::size_t n = 0; n < g.lines() && !g.std.empty(); ++n) {
    const std::size_t i = lowest ? n : g.lines() - 1 - n;
    if (!(g.std[i] < kCriteria.orientation_line * std::abs(g.value[i]))) continue;
    if (lines.size() >= 3 &&
        std::abs(std::log(g.frequency_hz[i] / g.frequency_hz[lines.front()])) > std::log(kReach))
      break;
    lines.push_back(i);
  }
  Trend trend;
  trend.known = lines.size() >= 3;
  if (!trend.known) return trend;
  const double first_hz = g.frequency_hz[lines.front()];
  std::size_t leading = 0;
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const std::size_t i : lines) {
    const double phase = std::arg(g.value[i]);
    if (phase > 0.5 && phase < 2.8) ++leading;
    const double f = std::log(g.frequency_hz[i] / first_hz), size = std::log(std::abs(g.value[i]));
    x += f, y += size, xx += f * f, xy += f * size;
  }
  const double n = static_cast<double>(lines.size());
  trend.leads = 4 * leading > 3 * lines.size();
  trend.slope = (n * xy - x * y) / std::max(n * xx - x * x, 1e-300);
  std::tie(trend.first_hz, trend.last_hz) = std::minmax(first_hz, g.frequency_hz[lines.back()]);
  return trend;
}

}  // namespace

OrientationFound orientation_of(const data::FrequencyResponse& response) {
  // A free drive lags by 90 degrees at low frequencies, a mirrored one leads, and one with its columns
  // exchanged leads while it grows, at all frequencies; on a spring to ground it does so below the resonance.
  const auto low = trend_of(response, true);
  if (!low.known) return {};
  if (!low.leads) return {Orientation::drive, low.last_hz};
  if (!(low.slope > kCriteria.orientation_slope)) return {Orientation::mirrored, low.last_hz};
  const auto high = trend_of(response, false);
  if (high.known && high.first_hz > low.first_hz && !high.leads && high.slope < -kCriteria.orientation_slope)
    return {Orientation::grounded, low.last_hz, high.first_hz};
  return {Orientation::inverse, low.last_hz};
}

}  // namespace resonid::identification::detail
