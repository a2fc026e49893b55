// SPDX-License-Identifier: MIT
#include "response/spectra/autocorrelation.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "response/signals.hpp"
#include "response/spectra/fft.hpp"

namespace resonid::response {
namespace {

/// r(l) = sum x(k) x(k+l) / sqrt(energy of both overlapping parts), l = 0 ... N/2.
std::vector<double> normalised_autocorrelation(std::span<const double> samples) {
  const std::size_t count = samples.size();
  std::vector<double> padded = detrended(samples, 0);
  std::vector<double> energy(count + 1, 0.0);
  for (std::size_t k = 0; k < count; ++k) energy[k + 1] = energy[k] + padded[k] * padded[k];
  std::size_t length = 1;
  while (length < 2 * count) length *= 2;
  padded.resize(length, 0.0);
  auto spectrum = half_spectrum(padded);
  for (auto& bin : spectrum) bin = std::norm(bin);
  const auto correlation = from_half_spectrum(spectrum, length);
  std::vector<double> normalised(count / 2 + 1, 0.0);
  for (std::size_t lag = 0; lag < normalised.size(); ++lag) {
    const double scale = std::sqrt(energy[count - lag] * (energy[count] - energy[lag]));
    if (scale > 0.0) normalised[lag] = correlation[lag] / scale;
  }
  return normalised;
}

}  // namespace

std::optional<Repetition> repetition_of(std::span<const double> samples) {
  if (samples.size() < 16) return std::nullopt;
  const auto correlation = normalised_autocorrelation(samples);
  const auto is_peak = [&](std::size_t lag) {
    return correlation[lag] > correlation[lag - 1] &&
           (lag + 1 >= correlation.size() || correlation[lag] >= correlation[lag + 1]);
  };
  // Over a period the correlation of a signal without mean is none on average: a peak that no valley precedes
  // is noise on a slow signal.
  constexpr double kValley = 0.5;
  const auto valley =
      std::find_if(correlation.begin(), correlation.end(), [](double r) { return r < kValley; });
  const auto first = std::max<std::size_t>(4, static_cast<std::size_t>(valley - correlation.begin()));
  double highest = 0.0;
  for (std::size_t lag = first; lag < correlation.size(); ++lag)
    if (is_peak(lag)) highest = std::max(highest, correlation[lag]);
  if (highest < 0.9) return std::nullopt;
  for (std::size_t lag = first; lag < correlation.size(); ++lag)
    if (is_peak(lag) && correlation[lag] >= 0.995 * highest) return Repetition{lag, highest};
  return std::nullopt;
}

}  // namespace resonid::response
