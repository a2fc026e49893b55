// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <identification/track/follower.hpp>
#include <vector>

namespace resonid::monitoring {

/// What is known of an axis' response at one instant, ascending in frequency.
struct ResponseCurve {
  std::vector<double> frequency_hz;
  std::vector<std::complex<double>> plant;  ///< For velocity, without the known delay.
  std::vector<double> std;                  ///< std^2 = E|error|^2; empty: not known.
  std::vector<std::complex<double>> loop;   ///< L = C G exp(-j w Td); empty without a controller.
  std::vector<double> loop_std;             ///< Likewise.
};

/// At the lines where the method has lines, else at `points` frequencies evenly spaced by ratio, from a
/// thousandth of the sample rate to nearly half of it. Empty while nothing is known.
[[nodiscard]] ResponseCurve response_curve(const identification::detail::Follower& follower,
                                           std::size_t points = 160);

}  // namespace resonid::monitoring
