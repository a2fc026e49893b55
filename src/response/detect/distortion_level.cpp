// SPDX-License-Identifier: MIT
#include <cmath>
#include <resonid/response/detail/distortion_level.hpp>

namespace resonid::response {

bool exceeds_chance(double ratio, double degrees_above, double degrees_below) {
  if (!(ratio > 0.0)) return false;
  constexpr double kQuantile = 3.09;
  const double a = 2.0 / (9.0 * 2.0 * degrees_above);
  const double b = 2.0 / (9.0 * 2.0 * degrees_below);
  const double x = std::cbrt(ratio);
  return ((1.0 - b) * x - (1.0 - a)) / std::sqrt(b * x * x + a) > kQuantile;
}

}  // namespace resonid::response
