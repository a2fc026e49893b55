// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>
#include <resonid/response/detail/detection_lines.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/periodic_averaging.hpp>

namespace resonid::response {
namespace {

using Complex = std::complex<double>;

/// Over lines and records.
struct Sum {
  double power = 0.0;  ///< of the means
  double noise = 0.0;  ///< variance of the means
  std::size_t terms = 0;
};

struct Sums {
  Sum even, odd;
  double excited = 0.0;                       ///< Power per excited line.
  std::size_t even_lines = 0, odd_lines = 0;  ///< Of one record.
  double degrees = 0.0;                       ///< Of a line's noise.
  double base_hz = 0.0;
};

DistortionLevel level_of(const Sum& sum, std::size_t lines, double excited, double degrees) {
  DistortionLevel level;
  level.lines = lines;
  if (sum.terms == 0 || !(excited > 0.0)) return level;
  const auto count = static_cast<double>(sum.terms);
  level.level = std::sqrt(std::max(sum.power - sum.noise, 0.0) / count / excited);
  level.noise = std::sqrt(sum.noise / count / excited);
  // A linear drive is computed to about 1e-6 when there is no noise at all.
  constexpr double kComputed = 1e-5;
  level.significant = level.level > kComputed &&
                      (!(sum.noise > 0.0) || exceeds_chance(sum.power / sum.noise, count, count * degrees));
  return level;
}

/// Response between two excited lines.
Complex between(const LineEstimate& a, const LineEstimate& b, double frequency_hz) {
  const Complex low = a.output / a.input;
  const Complex high = b.output / b.input;
  return low + (high - low) * (frequency_hz - a.frequency_hz) / (b.frequency_hz - a.frequency_hz);
}

expected<Sums, Error> sums_of(const data::Record& record, const DetectionLinesConfig& config) {
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

  Sums sums;
  for (const auto& line : excited->lines)
    sums.excited += std::norm(line.output) / static_cast<double>(excited->lines.size());
  for (const auto& line : silent->lines) {
    const auto above = std::find_if(excited->lines.begin(), excited->lines.end(), [&](const LineEstimate& l) {
      return l.frequency_hz > line.frequency_hz;
    });
    if (above == excited->lines.end() || above == excited->lines.begin()) continue;
    const Complex g = excited->has_input ? between(*std::prev(above), *above, line.frequency_hz) : 0.0;
    const Eigen::RowVector3cd row(0.0, -g, 1.0);
    const bool is_even = multiple(line.frequency_hz) % 2 == 0;
    if (!is_even && !odd_only) continue;
    Sum& sum = is_even ? sums.even : sums.odd;
    sum.power += std::norm(line.output - g * line.input);
    sum.noise += (row * line.covariance * row.adjoint()).value().real();
    ++sum.terms;
    ++(is_even ? sums.even_lines : sums.odd_lines);
  }
  sums.degrees = excited->lines.front().degrees_of_freedom;
  sums.base_hz = base_hz;
  return sums;
}

void add(Sum& to, const Sum& sum) {
  to.power += sum.power;
  to.noise += sum.noise;
  to.terms += sum.terms;
}

}  // namespace

expected<DetectionLines, Error> detection_lines(const data::Record& record,
                                                const DetectionLinesConfig& config) {
  return detection_lines(std::span(&record, 1), config);
}

expected<DetectionLines, Error> detection_lines(std::span<const data::Record> records,
                                                const DetectionLinesConfig& config) {
  if (records.empty()) return refuse("records", "must be at least one", 0.0);
  Sums all;
  for (const auto& record : records) {
    const auto sums = sums_of(record, config);
    if (!sums) return unexpected(sums.error());
    add(all.even, sums->even);
    add(all.odd, sums->odd);
    all.excited += sums->excited / static_cast<double>(records.size());
    all.even_lines = std::max(all.even_lines, sums->even_lines);
    all.odd_lines = std::max(all.odd_lines, sums->odd_lines);
    all.degrees = sums->degrees;
    all.base_hz = sums->base_hz;
  }
  return DetectionLines{level_of(all.even, all.even_lines, all.excited, all.degrees),
                        level_of(all.odd, all.odd_lines, all.excited, all.degrees), all.base_hz};
}

}  // namespace resonid::response
