// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace resonid::response {

/// Bins 0 ... N/2 of the discrete Fourier transform of N real samples, unscaled. Fast for any length,
/// fastest for small prime factors. The only place that knows the transform's library.
[[nodiscard]] std::vector<std::complex<double>> half_spectrum(std::span<const double> samples);

/// half_spectrum of two signals of one length at once, which takes two thirds of the time.
[[nodiscard]] std::array<std::vector<std::complex<double>>, 2> half_spectra(std::span<const double> first,
                                                                            std::span<const double> second);

/// Inverse of half_spectrum for `samples` samples.
[[nodiscard]] std::vector<double> from_half_spectrum(const std::vector<std::complex<double>>& spectrum,
                                                     std::size_t samples);

/// Greatest length <= `samples` whose prime factors are all at most 31: few samples are lost, and the
/// transform stays fast.
[[nodiscard]] std::size_t fast_length(std::size_t samples);

}  // namespace resonid::response
