// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/detail/realisations.hpp>

#include "response/signals.hpp"
#include "response/spectra/autocorrelation.hpp"
#include "response/spectra/fft.hpp"

namespace resonid::response {
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
  constexpr double kThroughout = 0.995;
  const auto& samples = data::exciting(record);
  const auto whole = repetition_of(samples);
  if (whole && whole->correlation >= kThroughout) return whole->lag;
  if (const auto period = detect_realisation_period(record)) return period;
  return whole ? std::optional(whole->lag) : std::nullopt;
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

bool two_level(const std::vector<double>& samples, double tolerance) {
  if (samples.empty()) return false;
  const auto extremes = std::minmax_element(samples.begin(), samples.end());
  const double low = *extremes.first, high = *extremes.second;
  const double near = tolerance * (high - low);
  if (!(near > 0.0)) return false;
  const auto at_an_end = std::count_if(samples.begin(), samples.end(),
                                       [&](double v) { return v - low < near || high - v < near; });
  constexpr double kNearlyAll = 0.98;
  return static_cast<double>(at_an_end) > kNearlyAll * static_cast<double>(samples.size());
}

}  // namespace resonid::response
