// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/response/detail/power_spectrum.hpp>
#include <resonid/response/welch.hpp>

#include "response/signals.hpp"
#include "response/spectra/fft.hpp"

namespace resonid::response {

double PowerSpectrum::between(double low_hz, double high_hz) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < power.size(); ++i)
    if (frequency_hz[i] >= low_hz && frequency_hz[i] < high_hz) sum += power[i];
  return sum;
}

PowerSpectrum power_spectrum(std::span<const double> signal, double sample_rate_hz) {
  PowerSpectrum spectrum;
  const std::size_t length = std::min(signal.size(), default_segment(signal.size(), sample_rate_hz));
  if (length < 2) return spectrum;
  const double n = static_cast<double>(length);
  double window_power = 0.0;
  std::vector<double> window(length);
  for (std::size_t k = 0; k < length; ++k) {
    window[k] = 0.5 - 0.5 * std::cos(kTwoPi * static_cast<double>(k) / n);
    window_power += window[k] * window[k];
  }
  const std::size_t lines = length / 2 + 1;
  spectrum.power.assign(lines, 0.0);
  for (std::size_t i = 0; i < lines; ++i)
    spectrum.frequency_hz.push_back(static_cast<double>(i) * sample_rate_hz / n);
  const auto centred = detrended(signal, 0);
  std::size_t segments = 0;
  for (std::size_t first = 0; first + length <= signal.size(); first += length / 2, ++segments) {
    std::vector<double> part(centred.begin() + static_cast<std::ptrdiff_t>(first),
                             centred.begin() + static_cast<std::ptrdiff_t>(first + length));
    for (std::size_t k = 0; k < length; ++k) part[k] *= window[k];
    const auto values = half_spectrum(part);
    for (std::size_t i = 0; i < lines; ++i) {
      const bool alone = i == 0 || 2 * i == length;  // without a conjugate line
      spectrum.power[i] += (alone ? 1.0 : 2.0) * std::norm(values[i]) / (n * window_power);
    }
  }
  for (double& p : spectrum.power) p /= static_cast<double>(segments);
  return spectrum;
}

}  // namespace resonid::response
