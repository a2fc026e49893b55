// SPDX-License-Identifier: MIT
#include "response/detect/sine_dwells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>

#include "linalg/decompositions.hpp"
#include "response/spectra/analytic_signal.hpp"

namespace resonid::response {
namespace {

/// Corners of the polygon that a phase is, ends included (Ramer 1972, Douglas and Peucker 1973).
std::vector<std::size_t> corners(const std::vector<double>& phase, double tolerance_rad) {
  std::vector<std::size_t> found{0, phase.size() - 1};
  std::vector<std::array<std::size_t, 2>> open{{0, phase.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    const double slope = (phase[last] - phase[first]) / static_cast<double>(last - first);
    double farthest = tolerance_rad;
    std::size_t corner = first;
    for (std::size_t k = first + 1; k < last; ++k) {
      const double distance = std::abs(phase[k] - phase[first] - slope * static_cast<double>(k - first));
      if (distance <= farthest) continue;
      farthest = distance;
      corner = k;
    }
    if (corner == first) continue;
    found.push_back(corner);
    open.push_back({first, corner});
    open.push_back({corner, last});
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// x = c + d t + Re{p e^{j w t}} around a centre sample.
struct SineFit {
  double centre = 0.0;
  double omega = 0.0;  ///< Per sample.
  double constant = 0.0;
  double slope = 0.0;
  std::complex<double> phasor;
  double scatter = 0.0;  ///< Robust standard deviation of what it leaves.

  [[nodiscard]] double value(std::size_t sample) const {
    const double t = static_cast<double>(sample) - centre;
    return constant + slope * t + (phasor * std::polar(1.0, omega * t)).real();
  }
};

std::optional<SineFit> fit_sine(std::span<const double> x, std::size_t first, std::size_t last,
                                double omega) {
  const auto count = static_cast<Eigen::Index>(last - first);
  if (count < 8) return std::nullopt;
  SineFit fit;
  fit.centre = 0.5 * static_cast<double>(first + last - 1);
  fit.omega = omega;
  const Eigen::VectorXd measured = Eigen::Map<const Eigen::VectorXd>(&x[first], count);
  Eigen::MatrixXd design(count, 5);
  for (int iteration = 0; iteration < 6; ++iteration) {
    const Eigen::Index columns = iteration > 0 ? 5 : 4;
    for (Eigen::Index n = 0; n < count; ++n) {
      const double t = static_cast<double>(first) + static_cast<double>(n) - fit.centre;
      const auto turn = std::polar(1.0, fit.omega * t);
      design.row(n) << 1.0, t, turn.real(), -turn.imag(), -t * (fit.phasor * turn).imag();
    }
    const Eigen::VectorXd solution = linalg::PivotedQr(design.leftCols(columns)).solve(measured);
    fit.constant = solution(0);
    fit.slope = solution(1);
    fit.phasor = {solution(2), solution(3)};
    if (iteration > 0) fit.omega += solution(4);
    if (!(fit.omega > 0.0 && fit.omega < kPi)) return std::nullopt;
  }
  std::vector<double> miss;
  for (std::size_t k = first; k < last; ++k) miss.push_back(std::abs(x[k] - fit.value(k)));
  fit.scatter = median(std::move(miss)) / 0.6745;
  return fit;
}

/// How far from `from` the fit holds, in one direction, up to `end` (not included; -1 stands before sample
/// 0).
std::ptrdiff_t reach(std::span<const double> x, const SineFit& fit, std::ptrdiff_t from, std::ptrdiff_t end) {
  const double limit = std::max(4.0 * fit.scatter, 1e-3 * std::abs(fit.phasor));
  const std::ptrdiff_t step = end > from ? 1 : -1;
  std::ptrdiff_t last_good = from;
  int missed = 0;
  for (std::ptrdiff_t k = from; k != end && missed < 2; k += step) {
    const auto sample = static_cast<std::size_t>(k);
    missed = std::abs(x[sample] - fit.value(sample)) > limit ? missed + 1 : 0;
    if (missed == 0) last_good = k;
  }
  return last_good;
}

/// The dwell around a piece of the polygon.
std::optional<SineDwell> grown(std::span<const double> x, double rate_hz, std::size_t first, std::size_t last,
                               double omega) {
  // The beginning may still carry the transient of the step before.
  const std::size_t length = last - first;
  const auto rough = fit_sine(x, first + length / 3, last - length / 10, omega);
  if (!rough) return std::nullopt;
  const auto middle = static_cast<std::ptrdiff_t>(rough->centre);
  const auto begin = static_cast<std::size_t>(reach(x, *rough, middle, -1));
  const auto end = static_cast<std::size_t>(reach(x, *rough, middle, std::ssize(x))) + 1;
  const auto fit = fit_sine(x, begin, end, rough->omega);
  if (!fit) return std::nullopt;
  double left = 0.0;
  for (std::size_t k = begin; k < end; ++k) left += std::pow(x[k] - fit->value(k), 2);
  const double power = 0.5 * std::norm(fit->phasor) * static_cast<double>(end - begin);
  SineDwell dwell{begin, end - begin, fit->omega / kTwoPi * rate_hz, power / (power + left)};
  dwell.frequency_hz =
      shortest_decimal(dwell.frequency_hz, 1e-3 * rate_hz / static_cast<double>(dwell.samples));
  return dwell;
}

std::vector<SineDwell> dwells_between(std::span<const double> x, double rate_hz, double least_share,
                                      const std::vector<double>& phase, double tolerance_rad) {
  std::vector<SineDwell> dwells;
  const auto corner = corners(phase, tolerance_rad);
  for (std::size_t i = 0; i + 1 < corner.size(); ++i) {
    const std::size_t first = corner[i];
    const std::size_t last = corner[i + 1];
    const double turned = phase[last] - phase[first];
    if (turned < 2.0 * kTwoPi || (!dwells.empty() && last <= dwells.back().end())) continue;
    const auto dwell = grown(x, rate_hz, first, last, turned / static_cast<double>(last - first));
    if (!dwell || !(dwell->share >= least_share)) continue;
    if (static_cast<double>(dwell->samples) * dwell->frequency_hz < 3.0 * rate_hz) continue;
    if (dwells.empty() || dwell->first >= dwells.back().end()) {
      dwells.push_back(*dwell);
      continue;
    }
    // Noise may have split a dwell; its pieces all grow to the same.
    const std::size_t common = std::min(dwell->end(), dwells.back().end()) - dwell->first;
    if (2 * common <= std::min(dwell->samples, dwells.back().samples))
      dwells.push_back(*dwell);
    else if (dwell->samples > dwells.back().samples)
      dwells.back() = *dwell;
  }
  return dwells;
}

std::size_t covered(const std::vector<SineDwell>& dwells) {
  std::size_t samples = 0;
  for (const SineDwell& dwell : dwells) samples += dwell.samples;
  return samples;
}

}  // namespace

std::vector<SineDwell> sine_dwells(std::span<const double> samples, double sample_rate_hz,
                                   double least_share) {
  std::vector<SineDwell> best;
  if (samples.size() < 16) return best;
  const auto phase = unwrapped_phase(analytic_signal(samples, 0.999));
  for (const double tolerance_rad : {0.25, 0.5, 1.0, 2.0}) {
    auto dwells = dwells_between(samples, sample_rate_hz, least_share, phase, tolerance_rad);
    if (covered(dwells) > covered(best)) best = std::move(dwells);
    if (20 * covered(best) > 19 * samples.size()) break;
  }
  return best;
}

}  // namespace resonid::response
