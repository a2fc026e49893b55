// SPDX-License-Identifier: MIT
#include <algorithm>
#include <resonid/base/constants.hpp>
#include <resonid/data/detail/output_hold.hpp>

namespace resonid::data {

std::vector<bool> OutputHold::stale(std::size_t count) const {
  std::vector<bool> old;
  if (samples <= 1) return old;
  for (std::size_t k = 0; k < count; ++k) old.push_back(!is_new(k));
  return old;
}

std::complex<double> OutputHold::response(double frequency_hz, double sample_time_s) const {
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < samples; ++i)
    sum += std::polar(1.0, -kTwoPi * frequency_hz * static_cast<double>(i) * sample_time_s);
  return sum / static_cast<double>(samples);
}

OutputHold output_hold(std::span<const double> output) {
  constexpr std::size_t kLongest = 64, kFewest = 16;  // new values
  constexpr double kNearlyEvery = 0.8;                // two values may be the same by chance or rounding
  constexpr double kElsewhere = 1e-3;                 // of the samples
  std::vector<std::size_t> changes;
  for (std::size_t k = 1; k < output.size(); ++k)
    if (output[k] != output[k - 1]) changes.push_back(k);
  if (2 * changes.size() > output.size() + output.size() / 8) return {};
  for (std::size_t n = 2; n <= kLongest && n * kFewest <= output.size(); ++n) {
    std::vector<std::size_t> at(n, 0);
    for (const std::size_t k : changes) ++at[k % n];
    const auto most = std::max_element(at.begin(), at.end());
    const auto elsewhere = static_cast<double>(changes.size() - *most);
    if (static_cast<double>(*most * n) > kNearlyEvery * static_cast<double>(output.size()) &&
        elsewhere <= kElsewhere * static_cast<double>(output.size()))
      return {n, static_cast<std::size_t>(most - at.begin())};
  }
  return {};
}

}  // namespace resonid::data
