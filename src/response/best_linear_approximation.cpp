// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <map>
#include <resonid/response/best_linear_approximation.hpp>
#include <resonid/response/excitation_lines.hpp>
#include <resonid/response/periodic_averaging.hpp>

#include "response/signals.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;

/// A line with input and output referred to the reference signal, and its covariance.
LineEstimate referred(const LineEstimate& line, bool direct) {
  const Eigen::Index reference = direct ? 1 : 0;
  const Eigen::Vector3cd x(direct ? 0.0 : line.excitation, line.input, line.output);
  Eigen::Matrix3cd gradient = Eigen::Matrix3cd::Identity() / x(reference);
  gradient.col(reference) -= x / (x(reference) * x(reference));
  LineEstimate result = line;
  result.excitation = x(0) / x(reference);
  result.input = x(1) / x(reference);
  result.output = x(2) / x(reference);
  result.covariance = gradient * line.covariance * gradient.adjoint();
  return result;
}

Eigen::Vector3cd vector_of(const LineEstimate& line) { return {line.excitation, line.input, line.output}; }

/// Variance of the response (Y/U; without an input Y/Ru) that a covariance of the phasors means.
double response_variance(const LineEstimate& line, const Eigen::Matrix3cd& covariance, bool has_input) {
  const Complex base = has_input ? line.input : line.excitation;
  const Complex ratio = line.output / base;
  Eigen::RowVector3cd gradient(0.0, 0.0, 1.0 / base);
  gradient(has_input ? 1 : 0) = -ratio / base;
  return (gradient * covariance * gradient.adjoint()).value().real();
}

data::Record part_of(const data::Record& record, std::size_t first, std::size_t count) {
  data::Record part = record;
  for (auto* channel : {&part.input, &part.output, &part.excitation, &part.reference, &part.position})
    if (channel->present()) {
      const auto begin = channel->samples.begin() + static_cast<std::ptrdiff_t>(first);
      channel->samples = std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(count));
    }
  part.start_time_s += static_cast<double>(first) * record.sample_time_s();
  return part;
}

/// The lines that all records have.
void keep_common(std::vector<LineEstimates>& all) {
  std::map<double, std::size_t> holders;
  for (const auto& estimates : all)
    for (const auto& line : estimates.lines) ++holders[line.frequency_hz];
  for (auto& estimates : all)
    std::erase_if(estimates.lines,
                  [&](const LineEstimate& line) { return holders[line.frequency_hz] < all.size(); });
}

}  // namespace

expected<BestLinearApproximation, ConfigError> best_linear_approximation(
    std::span<const data::Record> records, const BestLinearConfig& config, Approach approach) {
  if (records.size() < 2)
    return refuse("records", "must be at least two realisations", static_cast<double>(records.size()));
  PeriodicConfig periodic;
  periodic.period_samples =
      config.period_samples > 0 ? config.period_samples : detect_period(records[0]).value_or(0);
  if (periodic.period_samples == 0)
    return refuse("period_samples", "is needed: the excitation shows no period");
  periodic.drop_periods = config.drop_periods;
  periodic.band_low_hz = config.band_low_hz;
  periodic.band_high_hz = config.band_high_hz;
  std::vector<LineEstimates> all;
  for (const auto& record : records) {
    if (record.sample_rate_hz != records[0].sample_rate_hz)
      return refuse("records", "must have one sample rate", record.sample_rate_hz);
    auto lines = periodic_lines(record, periodic, approach);
    if (!lines) return unexpected(lines.error());
    all.push_back(*std::move(lines));
  }
  keep_common(all);

  const bool direct = approach == Approach::direct;
  BestLinearApproximation result;
  result.realisations = records.size();
  result.lines = all[0];
  result.lines.has_excitation = result.lines.has_excitation && !direct;
  const auto count = static_cast<double>(all.size());
  for (std::size_t i = 0; i < all[0].lines.size(); ++i) {
    LineEstimate& line = result.lines.lines[i];
    Eigen::Vector3cd mean = Eigen::Vector3cd::Zero();
    Eigen::Matrix3cd noise = Eigen::Matrix3cd::Zero();
    for (auto& estimates : all) {
      estimates.lines[i] = referred(estimates.lines[i], direct);
      mean += vector_of(estimates.lines[i]) / count;
      noise += estimates.lines[i].covariance / (count * count);
    }
    Eigen::Matrix3cd scatter = Eigen::Matrix3cd::Zero();
    for (const auto& estimates : all) {
      const Eigen::Vector3cd difference = vector_of(estimates.lines[i]) - mean;
      scatter += difference * difference.adjoint() / (count * (count - 1.0));
    }
    line.excitation = mean(0);
    line.input = mean(1);
    line.output = mean(2);
    line.covariance = scatter;
    line.degrees_of_freedom = count - 1.0;
    const bool has_input = result.lines.has_input && approach != Approach::indirect;
    const double total = response_variance(line, scatter, has_input);
    const double by_noise = response_variance(line, noise, has_input);
    line.coherence = std::numeric_limits<double>::quiet_NaN();
    result.noise_std.push_back(std::sqrt(std::max(by_noise, 0.0)));
    result.distortion_std.push_back(std::sqrt(count * std::max(total - by_noise, 0.0)));
  }
  return result;
}

std::vector<data::Record> realisations_of(const data::Record& record, std::size_t period_samples) {
  std::vector<data::Record> parts;
  const auto& x = record.excitation.present() ? record.excitation.samples : record.input.samples;
  if (period_samples < 4) return parts;
  const std::size_t periods = x.size() / period_samples;
  std::size_t begin = 0;
  for (std::size_t p = 1; p <= periods; ++p) {
    double change = 0.0, power = 0.0;
    for (std::size_t n = 0; p < periods && n < period_samples; ++n) {
      const double now = x[p * period_samples + n];
      change += std::pow(now - x[(p - 1) * period_samples + n], 2);
      power += now * now;
    }
    if (p < periods && change <= 0.01 * power) continue;
    if (p - begin >= 3)  // a transient and two more
      parts.push_back(part_of(record, (begin + 1) * period_samples, (p - begin - 1) * period_samples));
    begin = p;
  }
  return parts;
}

}  // namespace resonid::response
