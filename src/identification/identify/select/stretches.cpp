// SPDX-License-Identifier: MIT
#include <algorithm>
#include <identification/identify/select/stretches.hpp>

namespace resonid::identification::detail {

std::vector<data::Record> stretches_of(const data::Record& record, double low_hz, bool sweeps) {
  constexpr std::size_t kAll = 65'536, kFew = 8, kMany = 32;
  std::size_t count = kFew;
  if (sweeps) {
    const double two_periods = 2.0 * record.sample_rate_hz / std::max(low_hz, 1e-9);
    count = static_cast<std::size_t>(std::clamp(static_cast<double>(kAll) / two_periods,
                                                static_cast<double>(kFew), static_cast<double>(kMany)));
  }
  const std::size_t every = record.samples() / count;
  std::vector<data::Record> parts;
  for (std::size_t i = 0; i < count; ++i)
    parts.push_back(data::part_of(record, i * every, std::min(kAll / count, every)));
  return parts;
}

}  // namespace resonid::identification::detail
