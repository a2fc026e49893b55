// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/response/detail/stepped_sine.hpp>

#include "linalg/decompositions.hpp"
#include "response/detect/sine_dwells.hpp"
#include "response/signals.hpp"
#include "response/spectra/side_noise.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;

/// Constant, slope and sine over a range of samples; columns as in Signals.
struct LineFit {
  Eigen::Vector3cd phasors = Eigen::Vector3cd::Zero();
  Eigen::MatrixX3d residual;  ///< [sample of the range, signal]
  std::vector<double> cosine,
      sine;                 ///< [sample of the range] of the line, phase 0 at the record's first sample
  double noise_gain = 0.0;  ///< E|error|^2 of a phasor for white noise of variance 1
};

LineFit fit_line(const Signals& signals, double cycles_per_sample, std::size_t first, std::size_t samples) {
  const auto count = static_cast<Eigen::Index>(samples);
  Eigen::MatrixX4d design(count, 4);
  Eigen::MatrixX3d measured = Eigen::MatrixX3d::Zero(count, 3);
  LineFit fit;
  for (Eigen::Index n = 0; n < count; ++n) {
    const std::size_t k = first + static_cast<std::size_t>(n);
    const double cycles = cycles_per_sample * static_cast<double>(k);
    const double phase_rad = kTwoPi * (cycles - std::floor(cycles));
    fit.cosine.push_back(std::cos(phase_rad));
    fit.sine.push_back(std::sin(phase_rad));
    design.row(n) << 1.0, 2.0 * static_cast<double>(n) / static_cast<double>(count) - 1.0, fit.cosine.back(),
        -fit.sine.back();
    for (std::size_t i = 0; i < 3; ++i)
      if (signals.has(i)) measured(n, static_cast<Eigen::Index>(i)) = signals.signal[i][k];
  }
  const linalg::RealLdlt solver(design.transpose() * design);
  const Eigen::Matrix<double, 4, 3> solution = solver.solve(design.transpose() * measured);
  fit.residual = measured - design * solution;
  fit.phasors = solution.row(2).transpose() + Complex(0.0, 1.0) * solution.row(3).transpose().cast<Complex>();
  const Eigen::Matrix4d inverse = solver.solve(Eigen::Matrix4d::Identity());
  fit.noise_gain = inverse(2, 2) + inverse(3, 3);
  return fit;
}

/// Phasors of the output in successive groups of whole periods that end with the range; oldest first.
struct Groups {
  std::size_t end = 0;
  double length = 0.0;  ///< In samples, not whole.
  std::vector<Complex> output;

  /// First sample of the group that has `left` groups from it to the end.
  [[nodiscard]] std::size_t start(std::size_t left) const {
    return end - static_cast<std::size_t>(std::lround(static_cast<double>(left) * length));
  }
};

Groups groups_of(const Signals& signals, double cycles_per_sample, std::size_t first, std::size_t end) {
  Groups groups;
  groups.end = end;
  groups.length = std::ceil(8.0 * cycles_per_sample) / cycles_per_sample;
  const auto count = static_cast<std::size_t>((static_cast<double>(end - first) + 0.5) / groups.length);
  if (count == 0) return groups;
  // Drift is taken out over the whole range, since one period cannot tell it from a sine.
  const std::size_t begin = groups.start(count);
  const LineFit whole = fit_line(signals, cycles_per_sample, begin, end - begin);
  for (std::size_t left = count; left > 0; --left) {
    const auto from = static_cast<Eigen::Index>(groups.start(left) - begin);
    const auto length = static_cast<Eigen::Index>(groups.start(left - 1) - begin) - from;
    Eigen::MatrixX3d design(length, 3);
    for (Eigen::Index n = 0; n < length; ++n) {
      const auto k = static_cast<std::size_t>(from + n);
      design.row(n) << 1.0, whole.cosine[k], -whole.sine[k];
    }
    const Eigen::Matrix3d gram = design.transpose() * design;
    const Eigen::Vector3d solution =
        linalg::RealLdlt(gram).solve(design.transpose() * whole.residual.col(2).segment(from, length));
    groups.output.push_back(whole.phasors(2) + Complex(solution(1), solution(2)));
  }
  return groups;
}

struct Spread {
  Complex mean;
  double square = 0.0;  ///< Sum of |deviation from the mean|^2
};

Spread spread(std::span<const Complex> values) {
  Spread result;
  for (const Complex z : values) result.mean += z / static_cast<double>(values.size());
  for (const Complex z : values) result.square += std::norm(z - result.mean);
  return result;
}

/// Limit that the ratio of two complex variances with 1 and `degrees` degrees of freedom passes with the
/// probability `tail`: F(2, 2 nu).
double ratio_limit(double degrees, double tail) { return degrees * (std::pow(tail, -1.0 / degrees) - 1.0); }

/// How many groups, counted from the end, lie within the scatter of the last third.
std::size_t settled_groups(const std::vector<Complex>& output) {
  const std::size_t count = output.size();
  const std::size_t tail = std::max<std::size_t>(3, (count + 2) / 3);
  if (count <= tail) return count;
  const Spread last = spread(std::span(output).last(tail));
  const auto degrees = static_cast<double>(tail - 1);
  const double variance = last.square / degrees * (1.0 + 1.0 / static_cast<double>(tail));
  const double limit = std::max(ratio_limit(degrees, 1e-3) * variance, 1e-12 * std::norm(last.mean));
  std::size_t kept = tail;
  while (kept < count && std::norm(output[count - kept - 1] - last.mean) <= limit) ++kept;
  return kept;
}

/// Whether phasors go one way rather than scatter: most of their variance lies between the halves, and what
/// follows one another is closer than chance would have it (ratio of von Neumann 1941, mean 2, here of
/// complex values, 0.1 %).
bool drifts(std::span<const Complex> output) {
  const auto count = static_cast<double>(output.size());
  const std::size_t half = output.size() / 2;
  if (half < 2) return false;
  const double variance = spread(output).square / count;
  double steps = 0.0;
  for (std::size_t i = 1; i < output.size(); ++i)
    steps += std::norm(output[i] - output[i - 1]) / (count - 1.0);
  const double deviation = std::sqrt(2.0 * (count - 2.0) / (count * count - 1.0));
  return std::norm(spread(output.last(half)).mean - spread(output.first(half)).mean) > 2.0 * variance &&
         steps < (2.0 - 3.0 * deviation) * variance;
}

/// Whether the output still changes by more than `settled`: it drifts, or its phasors in the first half
/// scatter clearly more, about where they end, than those in the second.
bool still_moving(std::span<const Complex> output, double settled) {
  const std::size_t half = output.size() / 2;
  if (half < 2) return false;
  const Spread late = spread(output.last(half));
  const auto degrees = static_cast<double>(half - 1);
  double early = 0.0;
  for (const Complex z : output.first(half)) early += std::norm(z - late.mean) / static_cast<double>(half);
  if (early < settled * settled * std::norm(late.mean)) return false;
  return drifts(output) ||
         early > ratio_limit(degrees, 0.01) * late.square / degrees * (1.0 + 1.0 / static_cast<double>(half));
}

/// The estimate from one dwell; nothing when it never settles.
std::optional<LineEstimate> line_of(const Signals& signals, double rate_hz, const SineDwell& dwell,
                                    const SteppedSineConfig& config) {
  const double cycles_per_sample = dwell.frequency_hz / rate_hz;
  const auto skipped =
      static_cast<std::size_t>(std::ceil(config.settling_share * static_cast<double>(dwell.samples)));
  const Groups groups = groups_of(signals, cycles_per_sample, dwell.first + skipped, dwell.end());
  const std::size_t kept = settled_groups(groups.output);
  if (static_cast<double>(kept) * groups.length * cycles_per_sample < 1.9 ||
      still_moving(std::span(groups.output).last(kept), config.settled))
    return std::nullopt;
  const std::size_t first = groups.start(kept);
  const LineFit fit = fit_line(signals, cycles_per_sample, first, groups.end - first);
  const double bin_hz = rate_hz / static_cast<double>(groups.end - first);
  const SideNoise noise =
      noise_beside({fit.cosine, fit.sine}, 1.0 / rate_hz, dwell.frequency_hz, fit.residual,
                   Eigen::VectorXd::Ones(fit.residual.rows()), 1.5 * bin_hz, 4.5 * bin_hz);
  LineEstimate line;
  line.frequency_hz = dwell.frequency_hz;
  line.excitation = fit.phasors(0);
  line.input = fit.phasors(1);
  line.output = fit.phasors(2);
  line.covariance = fit.noise_gain * noise.density;
  line.degrees_of_freedom = noise.averages;
  return line;
}

/// One dwell per frequency: the longest; ascending.
std::vector<SineDwell> distinct(std::vector<SineDwell> dwells) {
  std::sort(dwells.begin(), dwells.end(),
            [](const SineDwell& a, const SineDwell& b) { return a.frequency_hz < b.frequency_hz; });
  std::vector<SineDwell> kept;
  for (const SineDwell& dwell : dwells) {
    if (kept.empty() || dwell.frequency_hz - kept.back().frequency_hz > 1e-3 * dwell.frequency_hz)
      kept.push_back(dwell);
    else if (dwell.samples > kept.back().samples)
      kept.back() = dwell;
  }
  return kept;
}

/// The dwells of the given lines, with the frequencies as given.
expected<std::vector<SineDwell>, Error> matched(const std::vector<SineDwell>& dwells,
                                                std::vector<double> lines_hz, double rate_hz) {
  std::sort(lines_hz.begin(), lines_hz.end());
  lines_hz.erase(std::unique(lines_hz.begin(), lines_hz.end()), lines_hz.end());
  std::vector<SineDwell> found;
  for (const double f : lines_hz) {
    if (!(f > 0.0) || f >= 0.5 * rate_hz)
      return refuse("lines_hz", "must lie between 0 and half the sample rate", f);
    const SineDwell* best = nullptr;
    for (const SineDwell& dwell : dwells) {
      if (std::abs(dwell.frequency_hz - f) > 0.1 * rate_hz / static_cast<double>(dwell.samples)) continue;
      if (best == nullptr || dwell.samples > best->samples) best = &dwell;
    }
    if (best == nullptr) return refuse("lines_hz", "holds a frequency that was not excited by itself", f);
    found.push_back(*best);
    found.back().frequency_hz = f;
  }
  return found;
}

}  // namespace

std::vector<double> detect_stepped_sine(const data::Record& record) {
  const auto x = data::exciting(record);
  const auto dwells = sine_dwells(x, record.sample_rate_hz, 0.999);
  std::size_t active = x.size();
  while (active > 0 && x[active - 1] == x.back()) --active;
  std::size_t covered = 0;
  for (const SineDwell& dwell : dwells) covered += dwell.samples;
  std::vector<double> lines_hz;
  if (10 * covered < 9 * active) return lines_hz;
  for (const SineDwell& dwell : distinct(dwells)) lines_hz.push_back(dwell.frequency_hz);
  if (lines_hz.size() < 3) lines_hz.clear();
  return lines_hz;
}

expected<LineEstimates, Error> stepped_sine_lines(const data::Record& record, const SteppedSineConfig& config,
                                                  Approach approach) {
  const auto signals = signals_of(record, approach);
  if (!signals) return unexpected(signals.error());
  if (!(config.settling_share >= 0.0 && config.settling_share <= 0.9))
    return refuse("settling_share", "must lie in 0 ... 0.9", config.settling_share);
  if (!(config.settled >= 0.0 && config.settled <= 1.0))
    return refuse("settled", "must lie in 0 ... 1", config.settled);
  const bool given = !config.lines_hz.empty();
  auto dwells = sine_dwells(data::exciting(record), record.sample_rate_hz, given ? 0.5 : 0.8);
  if (given) {
    auto found = matched(dwells, config.lines_hz, record.sample_rate_hz);
    if (!found) return unexpected(found.error());
    dwells = std::move(*found);
  } else {
    dwells = distinct(std::move(dwells));
    if (dwells.empty()) return refuse("record", "its excitation holds no sine for three periods or more");
  }
  LineEstimates estimates = empty_estimates(record, *signals);
  for (const SineDwell& dwell : dwells) {
    if (const auto line = line_of(*signals, record.sample_rate_hz, dwell, config))
      estimates.lines.push_back(*line);
    else
      estimates.unsettled_hz.push_back(dwell.frequency_hz);
  }
  return estimates;
}

expected<data::FrequencyResponse, Error> stepped_sine(const data::Record& record,
                                                      const SteppedSineConfig& config,
                                                      const ResponseOptions& options) {
  return stepped_sine_lines(record, config, options.approach).and_then([&](const LineEstimates& lines) {
    return plant_response(lines, options);
  });
}

}  // namespace resonid::response
