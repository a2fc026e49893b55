// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>
#include <resonid/response/detection_lines.hpp>
#include <resonid/response/excitation_lines.hpp>
#include <resonid/response/periodic_averaging.hpp>

namespace resonid::response {
namespace {

using Complex = std::complex<double>;

struct Sum {
  double power = 0.0;  ///< of the means
  double noise = 0.0;  ///< variance of the means
  std::size_t lines = 0;
};

/// Whether power/noise exceeds the 0.1 % quantile of F(2 n, 2 n nu), by its cube root's normal approximation.
bool exceeds_noise(const Sum& sum, double degrees) {
  if (sum.lines == 0 || !(sum.power > 0.0)) return false;
  if (!(sum.noise > 0.0)) return true;
  constexpr double kQuantile = 3.09;
  const double a = 2.0 / (9.0 * 2.0 * static_cast<double>(sum.lines));
  const double b = a / degrees;
  const double x = std::cbrt(sum.power / sum.noise);
  return ((1.0 - b) * x - (1.0 - a)) / std::sqrt(b * x * x + a) > kQuantile;
}

DistortionLevel level_of(const Sum& sum, double excited, double degrees) {
  DistortionLevel level;
  level.lines = sum.lines;
  if (sum.lines == 0 || !(excited > 0.0)) return level;
  const auto count = static_cast<double>(sum.lines);
  level.level = std::sqrt(std::max(sum.power - sum.noise, 0.0) / count / excited);
  level.noise = std::sqrt(sum.noise / count / excited);
  // A linear drive is computed to about 1e-6 when there is no noise at all.
  level.significant = exceeds_noise(sum, degrees) && level.level > 1e-5;
  return level;
}

/// Response between two excited lines.
Complex between(const LineEstimate& a, const LineEstimate& b, double frequency_hz) {
  const Complex low = a.output / a.input;
  const Complex high = b.output / b.input;
  return low + (high - low) * (frequency_hz - a.frequency_hz) / (b.frequency_hz - a.frequency_hz);
}

}  // namespace

expected<DetectionLines, ConfigError> detection_lines(const data::Record& record,
                                                      const DetectionLinesConfig& config) {
  const Approach approach = record.excitation.present() && record.input.present() ? Approach::joint
                            : record.input.present()                              ? Approach::direct
                                                                                  : Approach::indirect;
  PeriodicConfig periodic;
  periodic.period_samples =
      config.period_samples > 0 ? config.period_samples : detect_period(record).value_or(0);
  periodic.drop_periods = config.drop_periods;
  const auto excited = periodic_lines(record, periodic, approach);
  if (!excited) return unexpected(excited.error());
  if (excited->lines.size() < 2)
    return refuse("excitation", "must have at least two lines", static_cast<double>(excited->lines.size()));

  const double base_hz = record.sample_rate_hz / static_cast<double>(periodic.period_samples);
  const auto multiple = [&](double f) { return std::lround(f / base_hz); };
  const bool odd_only = std::all_of(excited->lines.begin(), excited->lines.end(),
                                    [&](const LineEstimate& l) { return multiple(l.frequency_hz) % 2 == 1; });
  std::size_t next = 0;
  for (long k = multiple(excited->lines.front().frequency_hz);
       k <= multiple(excited->lines.back().frequency_hz); ++k)
    if (multiple(excited->lines[next].frequency_hz) == k)
      ++next;
    else
      periodic.lines_hz.push_back(static_cast<double>(k) * base_hz);
  if (periodic.lines_hz.empty()) return refuse("excitation", "leaves out no line of its band");
  const auto silent = periodic_lines(record, periodic, approach);
  if (!silent) return unexpected(silent.error());

  double power = 0.0;
  for (const auto& line : excited->lines)
    power += std::norm(line.output) / static_cast<double>(excited->lines.size());
  Sum even, odd;
  for (const auto& line : silent->lines) {
    const auto above = std::find_if(excited->lines.begin(), excited->lines.end(), [&](const LineEstimate& l) {
      return l.frequency_hz > line.frequency_hz;
    });
    if (above == excited->lines.end() || above == excited->lines.begin()) continue;
    const Complex g = excited->has_input ? between(*std::prev(above), *above, line.frequency_hz) : 0.0;
    const Eigen::RowVector3cd row(0.0, -g, 1.0);
    const bool is_even = multiple(line.frequency_hz) % 2 == 0;
    if (!is_even && !odd_only) continue;
    Sum& sum = is_even ? even : odd;
    sum.power += std::norm(line.output - g * line.input);
    sum.noise += (row * line.covariance * row.adjoint()).value().real();
    ++sum.lines;
  }
  const double degrees = excited->lines.front().degrees_of_freedom;
  return DetectionLines{level_of(even, power, degrees), level_of(odd, power, degrees), base_hz};
}

}  // namespace resonid::response
