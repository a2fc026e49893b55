// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <span>
#include <vector>

namespace resonid::response {

/// x + j H{x} (H: Hilbert transform) of samples without their mean, by Fourier transform. Frequencies beyond
/// 1.3 times the one below which `power_share` of the power lies are taken for noise and left out. Wrong for
/// about a cycle at either end.
[[nodiscard]] std::vector<std::complex<double>> analytic_signal(std::span<const double> samples,
                                                                double power_share);

/// Argument without jumps of 2 pi.
[[nodiscard]] std::vector<double> unwrapped_phase(const std::vector<std::complex<double>>& values);

/// The shortest decimal number within `tolerance` of a value: 34.9999998 that was meant to be 35.
[[nodiscard]] double shortest_decimal(double value, double tolerance);

}  // namespace resonid::response
