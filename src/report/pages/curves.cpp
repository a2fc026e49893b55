// SPDX-License-Identifier: MIT
#include "report/pages/curves.hpp"

#include <algorithm>
#include <cmath>

namespace resonid::report {

Curve thinned(const std::string& name, const std::vector<double>& x, double start_s, double rate_hz,
              Curve::Mark mark) {
  Curve curve{name, mark, {}, {}};
  constexpr std::size_t kHistogramBins = 1500;
  const std::size_t bins = std::min(kHistogramBins, x.size());
  for (std::size_t b = 0; b < bins; ++b) {
    const auto from = x.begin() + static_cast<std::ptrdiff_t>(b * x.size() / bins);
    const auto to = x.begin() + static_cast<std::ptrdiff_t>((b + 1) * x.size() / bins);
    auto [low, high] = std::minmax_element(from, to);
    if (high < low) std::swap(low, high);
    for (const auto at : {low, high}) {
      const double time = start_s + static_cast<double>(at - x.begin()) / rate_hz;
      if (!curve.x.empty() && time <= curve.x.back()) continue;
      curve.x.push_back(time);
      curve.y.push_back(*at);
    }
  }
  return curve;
}

Curve level_db(const std::string& name, const data::FrequencyResponse& g, Curve::Mark mark) {
  Curve curve{name, mark, g.frequency_hz, {}};
  for (const auto& value : g.value) curve.y.push_back(20.0 * std::log10(std::abs(value)));
  return curve;
}

}  // namespace resonid::report
