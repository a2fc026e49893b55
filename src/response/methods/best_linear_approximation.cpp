// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <resonid/response/best_linear_approximation.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
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

/// The lines that all records have.
void keep_common(std::vector<LineEstimates>& all) {
  std::map<double, std::size_t> holders;
  for (const auto& estimates : all)
    for (const auto& line : estimates.lines) ++holders[line.frequency_hz];
  for (auto& estimates : all)
    std::erase_if(estimates.lines,
                  [&](const LineEstimate& line) { return holders[line.frequency_hz] < all.size(); });
}

/// A line's scatter with that of its neighbours, in which the power of the reference plays no part.
void pool_scatter(BestLinearApproximation& result, const std::vector<double>& reference_power) {
  auto& lines = result.lines.lines;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double own = lines[i].degrees_of_freedom;
    const std::size_t reach = pooling_reach(own);
    const std::size_t first = i > reach ? i - reach : 0;
    const std::size_t last = std::min(i + reach, lines.size() - 1);
    Eigen::Matrix3cd sum = Eigen::Matrix3cd::Zero();
    for (std::size_t k = first; k <= last; ++k) sum += reference_power[k] * result.scatter[k];
    const auto count = static_cast<double>(last - first + 1);
    lines[i].covariance = sum / (count * reference_power[i]);
    lines[i].degrees_of_freedom = own * count;
  }
}

/// Sums over the lines of what the level is made of.
struct Level {
  double output = 0.0, distortion = 0.0, noise = 0.0;  ///< powers at the output
  double ratio = 0.0;                                  ///< scatter over noise
  std::size_t lines = 0;

  void add(double input_power, double response_power, double scatter, double by_noise, double degrees) {
    output += input_power * response_power;
    distortion += input_power * (scatter - by_noise);
    noise += input_power * by_noise;
    ratio += scatter / by_noise * (degrees - 1.0) / degrees;  // E{1/chi^2}
    ++lines;
  }
  /// `degrees`: of the noise of one line, neighbours not counted.
  [[nodiscard]] DistortionLevel of(std::size_t realisations, double degrees) const {
    DistortionLevel level;
    level.lines = lines;
    if (lines == 0 || !(output > 0.0)) return level;
    const auto m = static_cast<double>(realisations);
    const auto n = static_cast<double>(lines);
    level.level = std::sqrt(m * std::max(distortion, 0.0) / output);
    level.noise = std::sqrt(m * noise / output);
    constexpr double kComputed = 1e-5;  // a linear drive without noise
    level.significant =
        level.level > kComputed && (!(noise > 0.0) || exceeds_chance(ratio / n, n * (m - 1.0), n * degrees));
    return level;
  }
};

}  // namespace

double distortion_variance(double scatter, double noise, std::size_t realisations) {
  return static_cast<double>(realisations) * std::max(scatter - noise, 0.0);
}

expected<BestLinearApproximation, Error> best_linear_approximation(std::span<const data::Record> records,
                                                                   const BestLinearConfig& config,
                                                                   Approach approach) {
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
  periodic.lines_hz = config.lines_hz;
  if (no_realisations(records, periodic.period_samples))
    return refuse("records", "must be excited with one amplitude spectrum and different phases");
  std::vector<LineEstimates> all;
  double noise_degrees = 0.0;
  for (const auto& record : records) {
    if (record.sample_rate_hz != records[0].sample_rate_hz)
      return refuse("records", "must have one sample rate", record.sample_rate_hz);
    auto lines = periodic_lines(record, periodic, approach);
    if (!lines) return unexpected(lines.error());
    noise_degrees +=
        static_cast<double>(record.samples() / periodic.period_samples - config.drop_periods) - 1.0;
    all.push_back(*std::move(lines));
  }
  keep_common(all);

  const bool direct = approach == Approach::direct;
  BestLinearApproximation result;
  result.realisations = records.size();
  result.lines = all[0];
  result.lines.has_excitation = result.lines.has_excitation && !direct;
  const auto count = static_cast<double>(all.size());
  const bool has_input = result.lines.has_input && approach != Approach::indirect;
  std::vector<double> reference_power;
  Level level;
  for (std::size_t i = 0; i < all[0].lines.size(); ++i) {
    LineEstimate& line = result.lines.lines[i];
    Eigen::Vector3cd mean = Eigen::Vector3cd::Zero();
    Eigen::Matrix3cd noise = Eigen::Matrix3cd::Zero();
    double power = 0.0, degrees = 0.0;
    for (auto& estimates : all) {
      const LineEstimate& measured = estimates.lines[i];
      power += std::norm(direct ? measured.input : measured.excitation) / count;
      degrees += measured.degrees_of_freedom;
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
    line.degrees_of_freedom = count - 1.0;
    line.coherence = std::numeric_limits<double>::quiet_NaN();
    const double total = response_variance(line, scatter, has_input);
    const double by_noise = std::max(response_variance(line, noise, has_input), 0.0);
    const double input_power = power * std::norm(has_input ? line.input : line.excitation);
    const double response_power =
        std::norm(line.output) / std::norm(has_input ? line.input : line.excitation);
    level.add(input_power, response_power, total, by_noise, degrees);
    result.noise.push_back(noise);
    result.scatter.push_back(scatter);
    result.noise_std.push_back(std::sqrt(by_noise));
    result.distortion_std.push_back(std::sqrt(distortion_variance(total, by_noise, all.size())));
    reference_power.push_back(power);
  }
  pool_scatter(result, reference_power);
  result.level = level.of(all.size(), noise_degrees);
  return result;
}

}  // namespace resonid::response
