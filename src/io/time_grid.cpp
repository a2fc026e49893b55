// SPDX-License-Identifier: MIT
#include "io/time_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <resonid/base/detail/statistics.hpp>
#include <vector>

namespace resonid::io {
namespace {

/// Number of samples that are missing between the stamps i and i + 1.
double missing_after(std::span<const double> t, std::size_t i, double step) {
  const double interval = t[i + 1] - t[i];
  if (interval <= 1.5 * step) return 0.0;
  double span = interval;
  double steps = 1.0;
  for (const std::size_t j : {i - 1, i + 1}) {  // i - 1 wraps round for i = 0
    if (j >= t.size() - 1 || t[j + 1] - t[j] >= 0.75 * step) continue;
    span += t[j + 1] - t[j];
    steps += 1.0;
  }
  return std::max(0.0, std::round(span / step) - steps);
}

/// Position of every sample on the grid.
std::vector<double> grid_indices(std::span<const double> t, double step) {
  std::vector<double> k(t.size());
  for (std::size_t i = 0; i + 1 < t.size(); ++i) k[i + 1] = k[i] + 1.0 + missing_after(t, i, step);
  return k;
}

struct Line {
  double origin = 0.0;
  double slope = 0.0;
  double slope_std = 0.0;
};

Line least_squares(std::span<const double> t, const std::vector<double>& k) {
  const auto n = static_cast<double>(t.size());
  double mean_k = 0.0;
  double mean_t = 0.0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    mean_k += k[i] / n;
    mean_t += (t[i] - t[0]) / n;
  }
  double kk = 0.0;
  double kt = 0.0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    kk += (k[i] - mean_k) * (k[i] - mean_k);
    kt += (k[i] - mean_k) * (t[i] - t[0] - mean_t);
  }
  Line line;
  line.slope = kt / kk;
  line.origin = t[0] + mean_t - line.slope * mean_k;
  double rest = 0.0;
  for (std::size_t i = 0; i < t.size(); ++i) rest += std::pow(t[i] - line.origin - line.slope * k[i], 2);
  line.slope_std = std::sqrt(rest / n / kk);
  return line;
}

/// The value with the fewest digits (up to 6) within the tolerance, if there is one.
std::optional<double> rounded(double value, double tolerance) {
  for (int digits = 1; digits <= 6; ++digits) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.*e", digits - 1, value);
    const double candidate = std::strtod(text.data(), nullptr);
    if (std::abs(candidate - value) <= tolerance * std::abs(value)) return candidate;
  }
  return {};
}

/// Stamps are printed with few digits, so the slope is not exact: among the rates that agree with the stamps
/// (4 standard deviations) the one that is a short decimal, or whose interval is one, is what the recorder
/// was set to.
double nominal_rate(const Line& line) {
  const double tolerance = std::clamp(4.0 * line.slope_std / line.slope, 1e-9, 1e-5);
  if (const auto rate = rounded(1.0 / line.slope, tolerance)) return *rate;
  if (const auto interval = rounded(line.slope, tolerance)) return 1.0 / *interval;
  return 1.0 / line.slope;
}

}  // namespace

std::optional<std::size_t> first_not_rising(std::span<const double> t) {
  for (std::size_t i = 1; i < t.size(); ++i)
    if (!(t[i] > t[i - 1])) return i;
  return {};
}

double median_interval(std::span<const double> t) {
  std::vector<double> intervals(t.size() - 1);
  for (std::size_t i = 0; i < intervals.size(); ++i) intervals[i] = t[i + 1] - t[i];
  return median(std::move(intervals));
}

TimeGrid fit_time_grid(std::span<const double> t) {
  auto k = grid_indices(t, median_interval(t));
  Line line = least_squares(t, k);
  if (std::isfinite(line.slope)) {    // stamps of 1e308 s overflow
    k = grid_indices(t, line.slope);  // coarse stamps have a coarse median, which miscounts long gaps
    line = least_squares(t, k);
  }

  TimeGrid grid;
  grid.sample_rate_hz = nominal_rate(line);
  constexpr double kMostIndex =
      1e15;  // exact in double precision; stamps of 1e300 s leave out more than can be counted
  grid.missing = static_cast<std::size_t>(std::min(k.back(), kMostIndex)) + 1 - t.size();
  if (k.back() < kMostIndex)
    for (const double index : k) grid.index.push_back(static_cast<std::size_t>(index));
  data::Sampling& sampling = grid.sampling;
  sampling.measured = true;
  double squares = 0.0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double deviation = t[i] - line.origin - line.slope * k[i];
    squares += deviation * deviation;
    sampling.jitter_max_s = std::max(sampling.jitter_max_s, std::abs(deviation));
    if (i == 0 || k[i] - k[i - 1] < 1.5) continue;
    if (sampling.gaps++ == 0) sampling.first_gap_at_s = t[i - 1];
    sampling.largest_gap_s = std::max(sampling.largest_gap_s, t[i] - t[i - 1]);
  }
  sampling.jitter_rms_s = std::sqrt(squares / static_cast<double>(t.size()));
  return grid;
}

}  // namespace resonid::io
