// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <resonid/base/constants.hpp>

namespace resonid::online {

/// An angle in units of 2^-64 turns. It wraps as angles do, so a phase that is advanced sample by sample
/// never loses precision: after 1e9 samples it is off by at most 3e-11 turns.
using Turns = std::uint64_t;

/// `cycles` modulo 1.
[[nodiscard]] inline Turns turns(double cycles) noexcept {
  const double fraction = cycles - std::floor(cycles);
  return fraction < 1.0 ? static_cast<Turns>(fraction * 0x1p64) : Turns{0};
}
[[nodiscard]] inline double radians(Turns angle) noexcept {
  return static_cast<double>(angle >> 11) * 0x1p-53 * kTwoPi;
}

}  // namespace resonid::online
