// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace resonid::response {

/// Output that no linear drive gives, over the output that it gives.
struct DistortionLevel {
  std::size_t lines = 0;     ///< Lines that tell; 0: none, the levels say nothing.
  double level = 0.0;        ///< rms per line over rms per excited line, noise taken off; 0 or more.
  double noise = 0.0;        ///< What noise alone gives there, in the same measure.
  bool significant = false;  ///< More than noise: F test, 0.1 %.
};

/// Whether a ratio of two mean squares of so many complex degrees of freedom exceeds the 0.1 % quantile of
/// F(2 above, 2 below), by the normal approximation of its cube root. Source: Wilson and Hilferty 1931,
/// Paulson 1942.
[[nodiscard]] bool exceeds_chance(double ratio, double degrees_above, double degrees_below);

}  // namespace resonid::response
