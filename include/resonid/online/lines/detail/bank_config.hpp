// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/online/lines/detail/gain_rule.hpp>
#include <span>

namespace resonid::online {

struct KalmanBankConfig {
  double sample_rate_hz = 0.0;             ///< Rate at which step() is called, > 0.
  std::span<const double> frequency_hz{};  ///< Lines in (0, sample_rate_hz/2), no two equal.
  bool offset = true;                      ///< One shared state for a constant part of the signal.
  GainRule gain = GainRule::fixed;
  double lambda = 100.0;      ///< Fixed gain: larger is quieter and slower; > -(lines + offset)/2.
  double pole_radius = 0.98;  ///< Placed poles: in (0, 1); nearer to 1 is quieter and slower.
};

/// Refuses what no bank can be made of; `max_lines` is what it has room for.
[[nodiscard]] inline std::optional<Error> check(const KalmanBankConfig& c, std::size_t max_lines) noexcept {
  const std::span<const double> f = c.frequency_hz;
  if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
    return Error{"sample_rate_hz", "must be > 0", c.sample_rate_hz};
  if (f.empty()) return Error{"frequency_hz", "needs at least one line", 0.0};
  if (f.size() > max_lines)
    return Error{"frequency_hz", "has more lines than the bank was built for", static_cast<double>(f.size())};
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (!(f[i] > 0.0 && f[i] < 0.5 * c.sample_rate_hz))
      return Error{"frequency_hz", "must be > 0 and below half the sample rate", f[i]};
    for (std::size_t j = 0; j < i; ++j)
      if (f[i] == f[j]) return Error{"frequency_hz", "must not hold a line twice", f[i]};
  }
  const double states = static_cast<double>(f.size()) + (c.offset ? 1.0 : 0.0);
  if (c.gain == GainRule::fixed && !(c.lambda > -0.5 * states && std::isfinite(c.lambda)))
    return Error{"lambda", "must be above minus half the number of lines and offset", c.lambda};
  if (c.gain == GainRule::placed_poles && !(c.pole_radius > 0.0 && c.pole_radius < 1.0))
    return Error{"pole_radius", "must lie between 0 and 1", c.pole_radius};
  return std::nullopt;
}

template <std::size_t MaxLines>
BankGain<MaxLines> bank_gain(std::span<const double> angle_rad, const KalmanBankConfig& c) {
  return c.gain == GainRule::fixed ? fixed_gain<MaxLines>(angle_rad, c.offset, c.lambda)
                                   : placed_gain<MaxLines>(angle_rad, c.offset, c.pole_radius);
}

}  // namespace resonid::online
