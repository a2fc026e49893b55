// SPDX-License-Identifier: MIT
#include "io/missing_samples.hpp"

#include <algorithm>

namespace resonid::io {
namespace {

/// Lagrange's polynomial through the points [from, to), at x.
double through(std::span<const double> values, std::span<const std::size_t> at, std::size_t from,
               std::size_t to, double x) {
  double sum = 0.0;
  for (std::size_t i = from; i < to; ++i) {
    double weight = 1.0;
    for (std::size_t j = from; j < to; ++j)
      if (j != i)
        weight *=
            (x - static_cast<double>(at[j])) / (static_cast<double>(at[i]) - static_cast<double>(at[j]));
    sum += weight * values[i];
  }
  return sum;
}

}  // namespace

std::vector<double> interpolated(std::span<const double> values, std::span<const std::size_t> at,
                                 std::size_t samples) {
  std::vector<double> all(samples, 0.0);
  std::size_t next = 0;  // of the values, the first that is not before the sample
  for (std::size_t k = 0; k < samples; ++k) {
    while (next < at.size() && at[next] < k) ++next;
    if (next < at.size() && at[next] == k) {
      all[k] = values[next];
      continue;
    }
    if (next == 0 || next == at.size()) {
      all[k] = values[next == 0 ? 0 : next - 1];
      continue;
    }
    const std::size_t reach = std::min<std::size_t>({2, next, at.size() - next});
    all[k] = through(values, at, next - reach, next + reach, static_cast<double>(k));
  }
  return all;
}

std::size_t longest_run(std::span<const std::size_t> ascending) {
  std::size_t longest = 0, run = 0;
  for (std::size_t i = 0; i < ascending.size(); ++i) {
    run = i > 0 && ascending[i] == ascending[i - 1] + 1 ? run + 1 : 1;
    longest = std::max(longest, run);
  }
  return longest;
}

}  // namespace resonid::io
