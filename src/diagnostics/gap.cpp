// SPDX-License-Identifier: MIT
#include <cmath>
#include <resonid/diagnostics/gap.hpp>

namespace resonid::diagnostics {

double chordal_distance(std::complex<double> first, std::complex<double> second) {
  // Two divisions, not one by a product: large responses must not overflow.
  return std::abs(first - second) / std::hypot(1.0, std::abs(first)) / std::hypot(1.0, std::abs(second));
}

}  // namespace resonid::diagnostics
