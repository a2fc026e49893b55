// SPDX-License-Identifier: MIT
#include <algorithm>
#include <complex>
#include <identification/criteria.hpp>
#include <identification/identify/measure/thinned.hpp>

namespace resonid::identification::detail {

data::FrequencyResponse thinned(const data::FrequencyResponse& g) {
  constexpr std::size_t kLines = 2000;
  if (g.lines() <= kLines) return g;
  std::vector<std::size_t> usable;
  for (std::size_t k = 0; k < g.lines(); ++k)
    if (g.std[k] < kCriteria.usable_line * std::abs(g.value[k])) usable.push_back(k);
  if (usable.size() < 10) return g;
  data::FrequencyResponse few;
  const std::size_t count = std::min(kLines, usable.size());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = usable[i * usable.size() / count];
    few.frequency_hz.push_back(g.frequency_hz[k]);
    few.value.push_back(g.value[k]);
    few.std.push_back(g.std[k]);
  }
  return few;
}

}  // namespace resonid::identification::detail
