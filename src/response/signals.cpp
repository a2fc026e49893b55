// SPDX-License-Identifier: MIT
#include "response/signals.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

namespace resonid::response {

expected<Signals, Error> signals_of(const data::Record& record, Approach approach) {
  if (!(record.sample_rate_hz > 0.0) || !std::isfinite(record.sample_rate_hz))
    return refuse("sample_rate_hz", "must be > 0", record.sample_rate_hz);
  if (!record.output.present()) return refuse("output", "is needed");
  if (approach != Approach::indirect && !record.input.present())
    return refuse("input", "is needed by the direct and the joint approach");
  if (approach != Approach::direct && !record.excitation.present())
    return refuse("excitation", "is needed by the indirect and the joint approach");
  Signals signals;
  signals.samples = record.samples();
  signals.signal = {std::span<const double>(record.excitation.samples),
                    std::span<const double>(record.input.samples),
                    std::span<const double>(record.output.samples)};
  signals.reference = approach == Approach::direct ? 1 : 0;
  for (const auto& signal : signals.signal)
    if (!signal.empty() && signal.size() != signals.samples)
      return refuse("record", "its signals must have equally many samples",
                    static_cast<double>(signal.size()));
  return signals;
}

LineEstimates empty_estimates(const data::Record& record, const Signals& signals) {
  LineEstimates estimates;
  estimates.output_quantity = record.output_quantity;
  estimates.sample_time_s = record.sample_time_s();
  estimates.has_excitation = signals.has(0);
  estimates.has_input = signals.has(1);
  return estimates;
}

std::vector<double> detrended(std::span<const double> samples, int degree) {
  std::vector<double> values(samples.begin(), samples.end());
  const auto count = static_cast<double>(samples.size());
  const double centre = 0.5 * (count - 1.0);
  Eigen::Map<Eigen::ArrayXd> all(values.data(), static_cast<Eigen::Index>(values.size()));
  const double mean = values.empty() ? 0.0 : all.mean();
  if (degree == 0) {
    all -= mean;
    return values;
  }
  double slope = 0.0;
  if (samples.size() > 1) {
    double numerator = 0.0;
    for (std::size_t k = 0; k < samples.size(); ++k)
      numerator += (static_cast<double>(k) - centre) * (samples[k] - mean);
    slope = numerator / (count * (count * count - 1.0) / 12.0);
  }
  for (std::size_t k = 0; k < values.size(); ++k)
    values[k] -= mean + slope * (static_cast<double>(k) - centre);
  return values;
}

std::vector<double> without_drift(std::span<const double> samples, std::size_t period) {
  const std::size_t count = samples.size() / period;
  std::vector<double> means(count, 0.0);
  for (std::size_t k = 0; k < count * period; ++k)
    means[k / period] += samples[k] / static_cast<double>(period);
  double overall = 0.0;
  for (const double mean : means) overall += mean / static_cast<double>(count);
  double slope = 0.0;
  double square = 0.0;
  const double centre = 0.5 * static_cast<double>(count - 1);
  for (std::size_t p = 0; p < count; ++p) {
    const double x = static_cast<double>(p) - centre;
    slope += x * (means[p] - overall);
    square += x * x;
  }
  slope /= square * static_cast<double>(period);
  std::vector<double> values(samples.size());
  const double middle = 0.5 * static_cast<double>(count * period - 1);
  for (std::size_t k = 0; k < values.size(); ++k)
    values[k] = samples[k] - overall - slope * (static_cast<double>(k) - middle);
  return values;
}

std::optional<data::Record> differenced(const data::Record& record) {
  if (record.output_quantity != data::OutputQuantity::position || record.samples() < 2) return std::nullopt;
  data::Record difference = data::part_of(record, 1, record.samples() - 1);
  for (std::size_t k = 0; k < difference.samples(); ++k)
    difference.output.samples[k] = record.output.samples[k + 1] - record.output.samples[k];
  difference.output_quantity = data::OutputQuantity::velocity;
  return difference;
}

LineEstimates integrated(LineEstimates lines) {
  lines.output_quantity = data::OutputQuantity::position;
  for (auto& line : lines.lines) {
    const auto sum = 1.0 / (1.0 - std::polar(1.0, -kTwoPi * line.frequency_hz * lines.sample_time_s));
    line.output *= sum;
    line.covariance.row(2) *= sum;
    line.covariance.col(2) *= std::conj(sum);
  }
  return lines;
}

std::size_t pooling_reach(double own) {
  constexpr double kWanted = 12.0;
  constexpr std::size_t kReach = 4;
  return std::min(kReach, static_cast<std::size_t>(std::max(0.0, std::ceil(0.5 * (kWanted / own - 1.0)))));
}

int trend_degree(const data::Record& record, std::size_t signal) {
  return signal == 2 && record.output_quantity == data::OutputQuantity::position ? 1 : 0;
}

expected<double, Error> upper_band_edge(const data::Record& record, double low_hz, double high_hz) {
  const double nyquist = 0.5 * record.sample_rate_hz;
  if (!(low_hz >= 0.0)) return refuse("band_low_hz", "must be >= 0", low_hz);
  if (!(high_hz >= 0.0) || high_hz > nyquist)
    return refuse("band_high_hz", "must lie between 0 and half the sample rate", high_hz);
  const double upper = high_hz == 0.0 ? nyquist : high_hz;
  if (low_hz >= upper) return refuse("band_low_hz", "must lie below band_high_hz", low_hz);
  return upper;
}

}  // namespace resonid::response
