// SPDX-License-Identifier: MIT
#include "response/spectra/analytic_signal.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "response/signals.hpp"
#include "response/spectra/fft.hpp"

namespace resonid::response {

std::vector<std::complex<double>> analytic_signal(std::span<const double> samples, double power_share) {
  std::size_t length = samples.size();
  while (fast_length(length) != length) ++length;
  auto padded = detrended(samples, 0);
  padded.resize(length, 0.0);
  auto spectrum = half_spectrum(padded);
  double total = 0.0;
  for (const auto& bin : spectrum) total += std::norm(bin);
  std::size_t last = 0;
  for (double sum = 0.0; last < spectrum.size() && sum < power_share * total; ++last)
    sum += std::norm(spectrum[last]);
  last += last / 3 + 2;
  for (std::size_t b = std::min(last, spectrum.size()); b < spectrum.size(); ++b) spectrum[b] = 0.0;
  spectrum.front() = 0.0;
  spectrum.back() = 0.0;  // has no quadrature
  const auto real = from_half_spectrum(spectrum, length);
  for (auto& bin : spectrum) bin *= std::complex<double>(0.0, -1.0);
  const auto imaginary = from_half_spectrum(spectrum, length);
  std::vector<std::complex<double>> values(samples.size());
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = {real[k], imaginary[k]};
  return values;
}

std::vector<double> unwrapped_phase(const std::vector<std::complex<double>>& values) {
  std::vector<double> phase(values.size());
  double turns = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const double angle = std::arg(values[k]);
    if (k > 0) turns -= std::round((angle + kTwoPi * turns - phase[k - 1]) / kTwoPi);
    phase[k] = angle + kTwoPi * turns;
  }
  return phase;
}

double shortest_decimal(double value, double tolerance) {
  double scale = 1.0;
  for (int digits = 0; digits <= 6; ++digits, scale *= 10.0) {
    const double rounded = std::round(value * scale) / scale;
    if (rounded != 0.0 && std::abs(rounded - value) <= tolerance) return rounded;
  }
  return value;
}

}  // namespace resonid::response
