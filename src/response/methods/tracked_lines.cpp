// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <resonid/response/detail/tracked_lines.hpp>

#include "linalg/decompositions.hpp"
#include "response/signals.hpp"
#include "response/spectra/side_noise.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;
constexpr std::size_t kMostLines = 256;

/// The part of the record in use, detrended; empty when a signal is absent.
struct Problem {
  std::array<std::vector<double>, 3> values;
  std::vector<double> lines_hz;  ///< ascending
  std::size_t samples = 0;
  double rate_hz = 0.0;
};

void put(LineEstimate& line, const Eigen::Vector3cd& phasors) {
  line.excitation = phasors(0);
  line.input = phasors(1);
  line.output = phasors(2);
}

/// Mean and scatter of blocks [signal, block].
void put_blocks(LineEstimate& line, const Eigen::Matrix3Xcd& blocks) {
  const auto count = static_cast<double>(blocks.cols());
  const Eigen::Vector3cd mean = blocks.rowwise().mean();
  const Eigen::Matrix3Xcd scatter = blocks.colwise() - mean;
  put(line, mean);
  line.covariance = scatter * scatter.adjoint() / (count * (count - 1.0));
  line.degrees_of_freedom = count - 1.0;
}

/// Noise beside a line over the samples from `first` on, through a Hann window since other lines may stand
/// near: from two bins of the range on, where neither the line's fit nor the window's main lobe reach.
SideNoise line_noise(const Problem& problem, const Eigen::MatrixX3d& residual, std::size_t first,
                     double frequency_hz) {
  const std::size_t count = problem.samples - first;
  const double ts = 1.0 / problem.rate_hz;
  std::vector<double> cosine(count), sine(count);
  Eigen::VectorXd window(static_cast<Eigen::Index>(count));
  for (std::size_t n = 0; n < count; ++n) {
    const double phase_rad = kTwoPi * frequency_hz * static_cast<double>(n) * ts;
    cosine[n] = std::cos(phase_rad);
    sine[n] = std::sin(phase_rad);
    window(static_cast<Eigen::Index>(n)) =
        0.5 - 0.5 * std::cos(kTwoPi * static_cast<double>(n) / static_cast<double>(count));
  }
  const double bin_hz = problem.rate_hz / static_cast<double>(count);
  return noise_beside({cosine, sine}, ts, frequency_hz, residual.bottomRows(static_cast<Eigen::Index>(count)),
                      window, 2.5 * bin_hz, 8.5 * bin_hz);
}

template <std::size_t MaxLines>
using Bank = online::KalmanBank<double, MaxLines>;

online::KalmanBankConfig bank_config(const Problem& problem, const TrackedLinesConfig& config) {
  online::KalmanBankConfig c;
  c.sample_rate_hz = problem.rate_hz;
  c.frequency_hz = problem.lines_hz;
  if (config.lambda > 0.0) {
    c.lambda = config.lambda;
    return c;
  }
  c.gain = online::GainRule::placed_poles;
  double distance_hz = problem.lines_hz.front();  // the offset state is a line at 0 Hz
  for (std::size_t i = 1; i < problem.lines_hz.size(); ++i)
    distance_hz = std::min(distance_hz, problem.lines_hz[i] - problem.lines_hz[i - 1]);
  c.pole_radius = config.pole_radius > 0.0
                      ? config.pole_radius
                      : std::clamp(1.0 - 1.5 * distance_hz / problem.rate_hz, 0.5, 0.9999);
  return c;
}

/// Amplitudes [line, sample] of the three signals; empty for an absent one.
using Amplitudes = std::array<Eigen::MatrixXcd, 3>;

template <std::size_t MaxLines>
Amplitudes run_bank(const Problem& problem, Bank<MaxLines>& bank) {
  Amplitudes amplitudes;
  for (std::size_t s = 0; s < 3; ++s) {
    if (problem.values[s].empty()) continue;
    amplitudes[s].resize(static_cast<Eigen::Index>(bank.lines()), static_cast<Eigen::Index>(problem.samples));
    bank.reset();
    for (std::size_t k = 0; k < problem.samples; ++k) {
      bank.step(problem.values[s][k]);
      for (std::size_t i = 0; i < bank.lines(); ++i)
        amplitudes[s](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = bank.amplitude(i);
    }
  }
  return amplitudes;
}

Eigen::Vector3cd mean_of(const Amplitudes& amplitudes, Eigen::Index line, std::size_t first,
                         std::size_t count) {
  Eigen::Vector3cd mean = Eigen::Vector3cd::Zero();
  for (std::size_t s = 0; s < 3; ++s)
    if (amplitudes[s].size() > 0)
      mean(static_cast<Eigen::Index>(s)) =
          amplitudes[s]
              .row(line)
              .segment(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(count))
              .mean();
  return mean;
}

/// What constant lines leave of the signals [sample, signal].
Eigen::MatrixX3d left_over(const Problem& problem, const std::vector<LineEstimate>& lines) {
  Eigen::MatrixX3d residual = Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(problem.samples), 3);
  for (std::size_t s = 0; s < 3; ++s)
    for (std::size_t k = 0; k < problem.values[s].size(); ++k)
      residual(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(s)) = problem.values[s][k];
  for (const LineEstimate& line : lines)
    for (Eigen::Index k = 0; k < residual.rows(); ++k) {
      const Complex turn =
          std::polar(1.0, kTwoPi * line.frequency_hz * static_cast<double>(k) / problem.rate_hz);
      residual.row(k) -= Eigen::RowVector3d((line.excitation * turn).real(), (line.input * turn).real(),
                                            (line.output * turn).real());
    }
  return residual;
}

/// A tracker's error in the words of TrackedLinesConfig.
Error named_here(Error error) {
  if (error.field == "frequency_hz") error.field = "lines_hz";
  return error;
}

template <std::size_t MaxLines>
expected<LineEstimates, Error> run_kalman(const Problem& problem, const TrackedLinesConfig& config,
                                          LineEstimates estimates) {
  auto created = Bank<MaxLines>::create(bank_config(problem, config));
  if (!created) return unexpected(named_here(created.error()));
  const auto bank = std::make_unique<Bank<MaxLines>>(*created);
  const Amplitudes amplitudes = run_bank(problem, *bank);
  const std::size_t period = config.period_samples;
  std::vector<std::size_t> first_of;  // [line] where its mean begins; 0: covariance is there already
  for (std::size_t i = 0; i < bank->lines(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const std::size_t settling = bank->settling_samples(i);
    if (settling == online::kNeverSettles || settling + (period > 0 ? period : settling) > problem.samples) {
      estimates.unsettled_hz.push_back(problem.lines_hz[i]);
      continue;
    }
    // What "settled" leaves of the start decays on; more of it is left out where the record is long.
    const std::size_t spare = problem.samples - settling;
    std::size_t count = spare - std::min(4 * settling, 2 * spare / 5);
    std::size_t periods = 0;
    if (period > 0) periods = std::max(count / period, std::min<std::size_t>(spare / period, 2));
    LineEstimate line;
    line.frequency_hz = problem.lines_hz[i];
    first_of.push_back(0);
    if (periods >= 2) {
      Eigen::Matrix3Xcd blocks(3, static_cast<Eigen::Index>(periods));
      for (std::size_t p = 0; p < periods; ++p)
        blocks.col(static_cast<Eigen::Index>(p)) =
            mean_of(amplitudes, row, problem.samples - (p + 1) * period, period);
      put_blocks(line, blocks);
    } else {
      if (periods == 1) count = period;
      first_of.back() = problem.samples - count;
      put(line, mean_of(amplitudes, row, first_of.back(), count));
    }
    estimates.lines.push_back(line);
  }
  if (std::all_of(first_of.begin(), first_of.end(), [](std::size_t first) { return first == 0; }))
    return estimates;
  const Eigen::MatrixX3d residual = left_over(problem, estimates.lines);
  for (std::size_t i = 0; i < estimates.lines.size(); ++i) {
    if (first_of[i] == 0) continue;
    LineEstimate& line = estimates.lines[i];
    const SideNoise noise = line_noise(problem, residual, first_of[i], line.frequency_hz);
    line.covariance = 4.0 / static_cast<double>(problem.samples - first_of[i]) * noise.density;
    line.degrees_of_freedom = noise.averages;
  }
  return estimates;
}

expected<LineEstimates, Error> run_sliding_dft(const Problem& problem, const TrackedLinesConfig& config,
                                               LineEstimates estimates) {
  using Tracker = online::SlidingDft<double, kMostLines, 16384>;
  const std::size_t window = config.window_samples > 0 ? config.window_samples : config.period_samples;
  if (window == 0) return refuse("window_samples", "is needed by the sliding DFT, or the period");
  online::SlidingDftConfig c;
  c.sample_rate_hz = problem.rate_hz;
  c.window_samples = window;
  c.frequency_hz = problem.lines_hz;
  const auto created = Tracker::create(c);
  if (!created) return unexpected(named_here(created.error()));
  const std::size_t windows = problem.samples / window;
  if (windows < 2) {
    estimates.unsettled_hz = problem.lines_hz;
    return estimates;
  }
  const auto tracker = std::make_unique<Tracker>(*created);
  const std::size_t lines = problem.lines_hz.size();
  std::vector<Eigen::Matrix3Xcd> blocks(lines,
                                        Eigen::Matrix3Xcd::Zero(3, static_cast<Eigen::Index>(windows)));
  for (std::size_t s = 0; s < 3; ++s) {
    if (problem.values[s].empty()) continue;
    tracker->reset();
    for (std::size_t k = 0; k < problem.samples; ++k) {
      tracker->step(problem.values[s][k]);
      const std::size_t left = problem.samples - 1 - k;
      if (left % window != 0 || left / window >= windows) continue;
      for (std::size_t i = 0; i < lines; ++i)
        blocks[i](static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(left / window)) =
            tracker->amplitude(i);
    }
  }
  for (std::size_t i = 0; i < lines; ++i) {
    LineEstimate line;
    line.frequency_hz = problem.lines_hz[i];
    put_blocks(line, blocks[i]);
    estimates.lines.push_back(line);
  }
  return estimates;
}

expected<LineEstimates, Error> run_least_squares(const Problem& problem, LineEstimates estimates) {
  const auto samples = static_cast<Eigen::Index>(problem.samples);
  const auto lines = static_cast<Eigen::Index>(problem.lines_hz.size());
  if (samples < 4 * lines + 8)
    return refuse("lines_hz", "are too many for the samples", static_cast<double>(lines));
  Eigen::MatrixXd design(samples, 2 * lines + 1);
  Eigen::MatrixX3d measured = Eigen::MatrixX3d::Zero(samples, 3);
  for (Eigen::Index k = 0; k < samples; ++k) {
    for (Eigen::Index i = 0; i < lines; ++i) {
      const double cycles =
          problem.lines_hz[static_cast<std::size_t>(i)] * static_cast<double>(k) / problem.rate_hz;
      const double angle = kTwoPi * (cycles - std::floor(cycles));
      design(k, 2 * i) = std::cos(angle);
      design(k, 2 * i + 1) = -std::sin(angle);
    }
    design(k, 2 * lines) = 1.0;
    for (std::size_t s = 0; s < 3; ++s)
      if (!problem.values[s].empty())
        measured(k, static_cast<Eigen::Index>(s)) = problem.values[s][static_cast<std::size_t>(k)];
  }
  const Eigen::MatrixXd gram = design.transpose() * design;
  const linalg::RealLdlt solver(gram);
  if (!(solver.rcond() > 1e-10)) return refuse("lines_hz", "are too close for the length of the recording");
  const Eigen::MatrixX3d solution = solver.solve(design.transpose() * measured);
  const Eigen::MatrixX3d residual = measured - design * solution;
  const Eigen::MatrixXd inverse = solver.solve(Eigen::MatrixXd::Identity(2 * lines + 1, 2 * lines + 1));
  for (Eigen::Index i = 0; i < lines; ++i) {
    LineEstimate line;
    line.frequency_hz = problem.lines_hz[static_cast<std::size_t>(i)];
    const Eigen::Vector3cd phasors = solution.row(2 * i).transpose() +
                                     Complex(0.0, 1.0) * solution.row(2 * i + 1).transpose().cast<Complex>();
    put(line, phasors);
    const SideNoise noise = line_noise(problem, residual, 0, line.frequency_hz);
    line.covariance = (inverse(2 * i, 2 * i) + inverse(2 * i + 1, 2 * i + 1)) * noise.density;
    line.degrees_of_freedom = noise.averages;
    estimates.lines.push_back(line);
  }
  return estimates;
}

expected<Problem, Error> problem_of(const data::Record& record, const TrackedLinesConfig& config,
                                    const Signals& signals) {
  Problem problem;
  problem.rate_hz = record.sample_rate_hz;
  problem.lines_hz = config.lines_hz;
  std::sort(problem.lines_hz.begin(), problem.lines_hz.end());
  if (problem.lines_hz.empty() || problem.lines_hz.size() > kMostLines)
    return refuse("lines_hz", "needs 1 ... 256 lines", static_cast<double>(problem.lines_hz.size()));
  for (const double f : problem.lines_hz)
    if (!(f > 0.0) || f >= 0.5 * record.sample_rate_hz)
      return refuse("lines_hz", "must lie between 0 and half the sample rate", f);
  if (config.first_sample + 64 > signals.samples)
    return refuse("first_sample", "must leave at least 64 samples", static_cast<double>(config.first_sample));
  problem.samples = signals.samples - config.first_sample;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!signals.has(i)) continue;
    const auto part = signals.signal[i].subspan(config.first_sample);
    const std::size_t period = config.period_samples;
    const bool by_periods = trend_degree(record, i) == 1 && period > 0 && part.size() >= 2 * period;
    problem.values[i] = by_periods ? without_drift(part, period) : detrended(part, trend_degree(record, i));
  }
  return problem;
}

}  // namespace

expected<LineEstimates, Error> tracked_line_estimates(const data::Record& record,
                                                      const TrackedLinesConfig& config, Approach approach) {
  const auto signals = signals_of(record, approach);
  if (!signals) return unexpected(signals.error());
  const auto problem = problem_of(record, config, *signals);
  if (!problem) return unexpected(problem.error());
  LineEstimates estimates = empty_estimates(record, *signals);
  switch (config.method) {
    case LineMethod::sliding_dft:
      return run_sliding_dft(*problem, config, std::move(estimates));
    case LineMethod::least_squares:
      return run_least_squares(*problem, std::move(estimates));
    case LineMethod::kalman:
      break;
  }
  if (problem->lines_hz.size() <= 32) return run_kalman<32>(*problem, config, std::move(estimates));
  return run_kalman<kMostLines>(*problem, config, std::move(estimates));
}

expected<data::FrequencyResponse, Error> tracked_lines(const data::Record& record,
                                                       const TrackedLinesConfig& config,
                                                       const ResponseOptions& options) {
  return tracked_line_estimates(record, config, options.approach).and_then([&](const LineEstimates& lines) {
    return plant_response(lines, options);
  });
}

}  // namespace resonid::response
