// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <resonid/online/excitation/detail/splitmix64.hpp>

namespace resonid::plant {

/// Gaussian white noise of a given standard deviation. The same seed gives the same sequence with every
/// compiler and standard library (std::normal_distribution does not). Marsaglia's polar method on SplitMix64.
class WhiteNoise {
 public:
  WhiteNoise(std::uint64_t seed, double std) noexcept : uniform_(seed), standard_deviation_(std) {}

  double step() noexcept {
    if (has_spare_) {
      has_spare_ = false;
      return standard_deviation_ * spare_;
    }
    double a = 0.0;
    double b = 0.0;
    double s = 0.0;
    do {
      a = 2.0 * uniform_.uniform() - 1.0;
      b = 2.0 * uniform_.uniform() - 1.0;
      s = a * a + b * b;
    } while (s >= 1.0 || s == 0.0);
    const double scale = std::sqrt(-2.0 * std::log(s) / s);
    spare_ = b * scale;
    has_spare_ = true;
    return standard_deviation_ * a * scale;
  }

 private:
  online::SplitMix64 uniform_;
  double standard_deviation_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace resonid::plant
