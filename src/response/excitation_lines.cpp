// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/response/excitation_lines.hpp>

#include "response/fft.hpp"
#include "response/signals.hpp"

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

double excited_power_threshold(std::vector<double> powers) {
  if (powers.empty()) return 0.0;
  std::sort(powers.begin(), powers.end());
  const double floor = 1e-4 * powers.back();
  double threshold = floor;
  double widest = 9.0;
  for (std::size_t i = powers.size(); i-- > 1 && powers[i] > floor;) {
    const double below = std::max(powers[i - 1], floor);
    if (powers[i] < widest * below) continue;
    widest = powers[i] / below;
    threshold = std::sqrt(powers[i] * below);
  }
  return threshold;
}

std::optional<std::size_t> detect_period(const data::Record& record) {
  const auto& samples = record.excitation.present() ? record.excitation.samples : record.input.samples;
  if (samples.size() < 16) return std::nullopt;
  const auto correlation = normalised_autocorrelation(samples);
  const auto is_peak = [&](std::size_t lag) {
    return correlation[lag] > correlation[lag - 1] &&
           (lag + 1 >= correlation.size() || correlation[lag] >= correlation[lag + 1]);
  };
  double highest = 0.0;
  for (std::size_t lag = 4; lag < correlation.size(); ++lag)
    if (is_peak(lag)) highest = std::max(highest, correlation[lag]);
  if (highest < 0.9) return std::nullopt;
  for (std::size_t lag = 4; lag < correlation.size(); ++lag)
    if (is_peak(lag) && correlation[lag] >= 0.995 * highest) return lag;
  return std::nullopt;
}

std::optional<std::pair<double, double>> excited_band_hz(const data::Record& record, Approach approach,
                                                         double share) {
  const auto signals = signals_of(record, approach);
  if (!signals || signals->samples < 32) return std::nullopt;
  const std::size_t length = fast_length(signals->samples);
  const auto spectrum = half_spectrum(detrended(signals->signal[signals->reference].first(length), 0));
  std::vector<double> sum(spectrum.size() + 1, 0.0);
  for (std::size_t b = 0; b < spectrum.size(); ++b) sum[b + 1] = sum[b] + std::norm(spectrum[b]);
  const std::size_t half = std::max<std::size_t>(2, length / 1000);
  const auto density = [&](std::size_t b) {
    const std::size_t low = b > half ? b - half : 0;
    const std::size_t high = std::min(b + half + 1, spectrum.size());
    return (sum[high] - sum[low]) / static_cast<double>(high - low);
  };
  double densest = 0.0;
  for (std::size_t b = 1; b < spectrum.size(); ++b) densest = std::max(densest, density(b));
  if (!(densest > 0.0)) return std::nullopt;
  std::size_t first = 0;
  std::size_t last = 0;
  for (std::size_t b = 1; b < spectrum.size(); ++b) {
    if (density(b) < share * densest) continue;
    if (first == 0) first = b;
    last = b;
  }
  const double spacing_hz = record.sample_rate_hz / static_cast<double>(length);
  return std::pair{static_cast<double>(first) * spacing_hz, static_cast<double>(last) * spacing_hz};
}

}  // namespace resonid::response
