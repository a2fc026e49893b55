// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/response/detail/excitation_lines.hpp>

#include "linalg/decompositions.hpp"
#include "response/spectra/analytic_signal.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;
using online::Sweep;
using online::SweepLaw;

constexpr std::size_t kBlocks = 64;

/// A candidate law and how well a cosine of constant amplitude along it explains the samples.
struct Candidate {
  SweepLaw law;
  double amplitude = 0.0;
  double offset = 0.0;
  double phase_rad = 0.0;
  double residual_share = 1.0;    ///< Of the samples' variance.
  double phasor_deviation = 1.0;  ///< Rms over blocks of the phasor's deviation, relative to the amplitude.
  double worst_deviation = 1.0;   ///< Of one block.

  [[nodiscard]] double value(double time_s) const {
    return offset + amplitude * std::cos(kTwoPi * law.cycles(time_s) + phase_rad);
  }
};

/// First samples of the blocks, and the end.
std::vector<std::size_t> block_edges(std::size_t samples) {
  std::vector<std::size_t> edges;
  for (std::size_t b = 0; b <= kBlocks; ++b) edges.push_back(b * samples / kBlocks);
  return edges;
}

/// Law through the blocks' mean frequencies: median of the slopes between any two (Theil and Sen), so that
/// the ends, where the analytic signal is wrong, do not matter.
std::optional<SweepLaw> coarse_law(const std::vector<Complex>& analytic, double rate_hz, Sweep sweep) {
  const auto edges = block_edges(analytic.size());
  std::vector<double> time;
  std::vector<double> value;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    Complex turn = 0.0;
    for (std::size_t k = edges[b]; k + 1 < edges[b + 1]; ++k)
      turn += analytic[k + 1] * std::conj(analytic[k]);
    const double f = std::arg(turn) / kTwoPi * rate_hz;
    if (!(f > 0.0)) continue;
    time.push_back(0.5 * static_cast<double>(edges[b] + edges[b + 1] - 1) / rate_hz);
    value.push_back(sweep == Sweep::linear ? f : std::log(f));
  }
  if (time.size() < kBlocks / 2) return std::nullopt;
  std::vector<double> slopes;
  for (std::size_t i = 0; i < time.size(); ++i)
    for (std::size_t j = i + 1; j < time.size(); ++j)
      slopes.push_back((value[j] - value[i]) / (time[j] - time[i]));
  const double slope = median(std::move(slopes));
  std::vector<double> starts;
  for (std::size_t i = 0; i < time.size(); ++i) starts.push_back(value[i] - slope * time[i]);
  const double start = median(std::move(starts));
  SweepLaw law;
  law.sweep = sweep;
  law.duration_s = static_cast<double>(analytic.size()) / rate_hz;
  law.from_hz = sweep == Sweep::linear ? start : std::exp(start);
  const double end = start + slope * law.duration_s;
  law.to_hz = sweep == Sweep::linear ? end : std::exp(end);
  return law;
}

bool sensible(const SweepLaw& law, double rate_hz) {
  return law.from_hz > 0.0 && law.to_hz > 0.0 && law.from_hz < 0.5 * rate_hz && law.to_hz < 0.5 * rate_hz &&
         law.from_hz != law.to_hz;
}

/// Derivatives of the phase with respect to from_hz and to_hz.
Eigen::RowVector2d phase_gradient(const SweepLaw& law, double time_s) {
  const double part = time_s / law.duration_s;
  if (law.sweep == Sweep::linear) return kTwoPi * time_s * Eigen::RowVector2d(1.0 - 0.5 * part, 0.5 * part);
  const double q = std::log(law.to_hz / law.from_hz);
  const double grown = std::expm1(q * part);
  const double by_q = (q * part * (grown + 1.0) - grown) / (q * q);  // of (e^{q t/T} - 1)/q
  return kTwoPi * law.duration_s * Eigen::RowVector2d(grown / q - by_q, law.from_hz / law.to_hz * by_q);
}

void correct(SweepLaw& law, const Eigen::Vector2d& step) {
  law.from_hz += step(0);
  law.to_hz += step(1);
}

/// Brings a law, whose phase may be off by whole cycles, near the signal's: least squares on the unwrapped
/// phases of the demodulated blocks.
bool follow_phase(const std::vector<Complex>& analytic, double rate_hz, SweepLaw& law) {
  const auto edges = block_edges(analytic.size());
  constexpr int kIterations = 5;
  for (int iteration = 0;; ++iteration) {
    std::vector<Complex> mean(kBlocks);
    for (std::size_t b = 0; b < kBlocks; ++b)
      for (std::size_t k = edges[b]; k < edges[b + 1]; ++k)
        mean[b] += analytic[k] * std::polar(1.0, -kTwoPi * law.cycles(static_cast<double>(k) / rate_hz));
    if (iteration == kIterations) {  // in step with the signal, or it is no such chirp
      double inside = 0.0;
      double outside = 0.0;
      for (const Complex& m : mean) inside += std::abs(m);
      for (const Complex& z : analytic) outside += std::abs(z);
      return inside > 0.8 * outside;
    }
    const auto phase = unwrapped_phase(mean);
    Eigen::MatrixXd design(kBlocks, 3);
    Eigen::VectorXd measured(kBlocks);
    for (std::size_t b = 0; b < kBlocks; ++b) {
      const auto row = static_cast<Eigen::Index>(b);
      const double t = 0.5 * static_cast<double>(edges[b] + edges[b + 1] - 1) / rate_hz;
      const double weight = std::abs(mean[b]);  // where it turns within the block it counts less
      design.row(row) << weight, weight * phase_gradient(law, t);
      measured(row) = weight * phase[b];
    }
    const Eigen::Vector3d solution = linalg::PivotedQr(design).solve(measured);
    correct(law, solution.tail<2>());
    if (!sensible(law, rate_hz)) return false;
  }
}

/// Gauss-Newton on the samples themselves: x = c + a cos(phi) - b sin(phi).
bool fit_samples(std::span<const double> x, double rate_hz, Candidate& candidate) {
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  Complex phasor;
  for (int iteration = 0; iteration < 6; ++iteration) {
    Eigen::Matrix<double, 5, 5> gram = Eigen::Matrix<double, 5, 5>::Zero();
    Vector5 right = Vector5::Zero();
    for (std::size_t k = 0; k < x.size(); ++k) {
      const double t = static_cast<double>(k) / rate_hz;
      const Complex turn = std::polar(1.0, kTwoPi * candidate.law.cycles(t));
      Vector5 row;
      row << 1.0, turn.real(), -turn.imag(), 0.0, 0.0;
      if (iteration > 0)
        row.tail<2>() = -(phasor * turn).imag() * phase_gradient(candidate.law, t).transpose();
      gram += row * row.transpose();
      right += x[k] * row;
    }
    const Eigen::Index columns = iteration > 0 ? 5 : 3;  // no slope in the law before there is a phasor
    const Eigen::MatrixXd used = gram.topLeftCorner(columns, columns);
    const Eigen::VectorXd solution = linalg::PivotedQr(used).solve(right.head(columns));
    phasor = {solution(1), solution(2)};
    candidate.offset = solution(0);
    if (iteration > 0) correct(candidate.law, solution.tail<2>());
    if (!sensible(candidate.law, rate_hz)) return false;
  }
  candidate.amplitude = std::abs(phasor);
  candidate.phase_rad = std::arg(phasor);
  return candidate.amplitude > 0.0;
}

void judge(std::span<const double> x, double rate_hz, Candidate& candidate) {
  const auto edges = block_edges(x.size());
  double residual = 0.0;
  double variance = 0.0;
  double squares = 0.0;
  candidate.worst_deviation = 0.0;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    Complex deviation = 0.0;
    for (std::size_t k = edges[b]; k < edges[b + 1]; ++k) {
      const double t = static_cast<double>(k) / rate_hz;
      const double error = x[k] - candidate.value(t);
      residual += error * error;
      variance += (x[k] - candidate.offset) * (x[k] - candidate.offset);
      deviation += error * std::polar(2.0, -kTwoPi * candidate.law.cycles(t));
    }
    const double relative =
        std::abs(deviation) / (static_cast<double>(edges[b + 1] - edges[b]) * candidate.amplitude);
    squares += relative * relative / static_cast<double>(kBlocks);
    candidate.worst_deviation = std::max(candidate.worst_deviation, relative);
  }
  candidate.residual_share = residual / variance;
  candidate.phasor_deviation = std::sqrt(squares);
}

/// Samples up to the silence at the end, if there is one.
std::size_t active_samples(std::span<const double> x) {
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  const double range = *high - *low;
  std::size_t count = x.size();
  while (count > 1 && std::abs(x[count - 1] - x.back()) < 0.1 * range) --count;
  return count;
}

}  // namespace

std::optional<online::SweepLaw> detect_chirp(const data::Record& record) {
  const std::span<const double> all = data::exciting(record);
  const double rate_hz = record.sample_rate_hz;
  constexpr std::size_t kFewest = 16 * kBlocks;
  if (all.size() < kFewest || !(rate_hz > 0.0)) return std::nullopt;
  const std::size_t active = active_samples(all);
  if (active < kFewest) return std::nullopt;
  const auto x = all.first(active);
  const auto analytic = analytic_signal(x, 0.99);
  Candidate best;
  for (const Sweep sweep : {Sweep::linear, Sweep::logarithmic}) {
    Candidate candidate;
    const auto coarse = coarse_law(analytic, rate_hz, sweep);
    if (!coarse || !sensible(*coarse, rate_hz)) continue;
    candidate.law = *coarse;
    if (!follow_phase(analytic, rate_hz, candidate.law) || !fit_samples(x, rate_hz, candidate)) continue;
    judge(x, rate_hz, candidate);
    if (candidate.residual_share < best.residual_share) best = candidate;
  }
  SweepLaw& law = best.law;
  // Broad-band noise of a measured signal may remain; a phasor that wanders more than such noise moves it may
  // not.
  const double by_noise =
      std::sqrt(2.0 * best.residual_share * static_cast<double>(kBlocks) / static_cast<double>(active));
  if (!(best.residual_share < 0.03 && best.phasor_deviation < 0.02 + 3.0 * by_noise &&
        best.worst_deviation < 0.25))
    return std::nullopt;
  const double span_hz = std::abs(law.to_hz - law.from_hz);
  if (span_hz * law.duration_s < 10.0 || span_hz < 0.05 * std::max(law.from_hz, law.to_hz))
    return std::nullopt;  // a sine

  // The end may look silent where the chirp passes zero, and still belong to it.
  const double near = best.amplitude * (0.02 + 3.0 * std::sqrt(0.5 * best.residual_share));
  std::size_t end = active;
  while (end < all.size() && std::abs(all[end] - best.value(static_cast<double>(end) / rate_hz)) < near)
    ++end;
  const double longer = static_cast<double>(end) / static_cast<double>(active);
  law.to_hz = law.sweep == Sweep::linear ? law.from_hz + (law.to_hz - law.from_hz) * longer
                                         : law.from_hz * std::pow(law.to_hz / law.from_hz, longer);
  law.duration_s = static_cast<double>(end) / rate_hz;
  const double tolerance_hz = 0.003 / law.duration_s;  // less than 0.6 degrees over the sweep
  law.from_hz = shortest_decimal(law.from_hz, tolerance_hz);
  law.to_hz = shortest_decimal(law.to_hz, tolerance_hz);
  return sensible(law, rate_hz) ? std::optional(law) : std::nullopt;
}

}  // namespace resonid::response
