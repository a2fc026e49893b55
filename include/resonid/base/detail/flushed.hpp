// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>

namespace resonid {

/// x, or 0 where it is so near to 0 that it would soon be denormal (1e-31 in float, 1e-292 in double). States
/// that fade without end are passed through it: arithmetic with denormal numbers takes many times as long on
/// some machines, and would do so just when nothing happens.
template <class Real>
[[nodiscard]] inline Real flushed(Real x) noexcept {
  constexpr Real kLeast = std::numeric_limits<Real>::min() / std::numeric_limits<Real>::epsilon();
  return std::abs(x) < kLeast ? Real(0) : x;
}

/// The same for signals of which squares and products are formed: 1e-19 in float, 1e-154 in double.
template <class Real>
[[nodiscard]] inline Real flushed_signal(Real x) noexcept {
  constexpr Real kLeast = std::numeric_limits<Real>::digits == std::numeric_limits<float>::digits
                              ? Real(0x1p-63)
                              : Real(0x1p-511L);  // square root of min()
  return std::abs(x) < kLeast ? Real(0) : x;
}

}  // namespace resonid
