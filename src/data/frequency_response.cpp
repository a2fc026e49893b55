// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/data/frequency_response.hpp>

namespace resonid::data {

double LineCorrelation::at(double distance) const {
  const auto above = std::lower_bound(distance_hz.begin(), distance_hz.end(), distance);
  if (above == distance_hz.end()) return distance > 0.0 ? 0.0 : 1.0;
  const auto i = static_cast<std::size_t>(above - distance_hz.begin());
  if (i == 0) return value.front();
  const double t = (distance - distance_hz[i - 1]) / (distance_hz[i] - distance_hz[i - 1]);
  return (1.0 - t) * value[i - 1] + t * value[i];
}

std::complex<double> FrequencyResponse::at(double frequency) const {
  if (frequency_hz.empty()) return {};
  const auto above = std::lower_bound(frequency_hz.begin(), frequency_hz.end(), frequency);
  if (above == frequency_hz.begin()) return value.front();
  if (above == frequency_hz.end()) return value.back();
  const auto i = static_cast<std::size_t>(above - frequency_hz.begin());
  const double t = (frequency - frequency_hz[i - 1]) / (frequency_hz[i] - frequency_hz[i - 1]);
  return (1.0 - t) * value[i - 1] + t * value[i];
}

FrequencyResponse FrequencyResponse::band(double low_hz, double high_hz) const {
  FrequencyResponse part;
  part.correlation = correlation;
  part.smoothing.width_hz = smoothing.width_hz;
  for (std::size_t i = 0; i < lines(); ++i) {
    if (frequency_hz[i] < low_hz || frequency_hz[i] > high_hz) continue;
    part.frequency_hz.push_back(frequency_hz[i]);
    part.value.push_back(value[i]);
    if (!std.empty()) part.std.push_back(std[i]);
    if (!coherence.empty()) part.coherence.push_back(coherence[i]);
    if (!smoothing.slope.empty()) part.smoothing.slope.push_back(smoothing.slope[i]);
  }
  for (const double f : unsettled_hz)
    if (f >= low_hz && f <= high_hz) part.unsettled_hz.push_back(f);
  return part;
}

double confidence_radius(double std, double confidence) {
  return std * std::sqrt(-std::log(1.0 - confidence));
}

}  // namespace resonid::data
