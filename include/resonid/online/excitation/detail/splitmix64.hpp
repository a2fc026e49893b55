// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace resonid::online {

/// Small deterministic random generator: the same seed gives the same numbers with every compiler and
/// standard library. Source: Steele, Lea and Flood 2014.
class SplitMix64 {
 public:
  /// `drawn`: goes on as after so many numbers.
  explicit constexpr SplitMix64(std::uint64_t seed, std::uint64_t drawn = 0) noexcept
      : state_(seed + drawn * kStep) {}

  constexpr std::uint64_t next() noexcept {
    state_ += kStep;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }
  /// Uniform in [0, 1), a multiple of 2^-53.
  constexpr double uniform() noexcept { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  static constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15U;
  std::uint64_t state_;
};

}  // namespace resonid::online
