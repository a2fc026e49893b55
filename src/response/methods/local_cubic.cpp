// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "linalg/decompositions.hpp"
#include "response/methods/sweep.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;
constexpr Eigen::Index kTerms = 4;  // cubic

/// Phasor and its Taylor coefficients in time: value, 1/s, 1/s^2.
using Series = std::array<Complex, 3>;

/// What the sweep does at one instant: wdot, and wddot/wdot.
struct SweepRate {
  double rate = 0.0;
  double curvature = 0.0;
};

/// Value of the quotient a/b freed from the sweep (docs/methods/swept_response.md). With q the quotient's
/// series in time, G' = q1/wdot and G'' = (2 q2 - q1 wddot/wdot)/wdot^2, so
/// G = q0 + j (q1 (b1/b0 - wddot/(2 wdot)) + q2)/wdot.
Complex corrected_ratio(const Series& a, const Series& b, const SweepRate& sweep) {
  const Complex q0 = a[0] / b[0];
  const Complex q1 = (a[1] - q0 * b[1]) / b[0];
  const Complex q2 = (a[2] - q0 * b[2] - q1 * b[1]) / b[0];
  return q0 + Complex(0.0, 1.0 / sweep.rate) * (q1 * (b[1] / b[0] - 0.5 * sweep.curvature) + q2);
}

/// Derivatives of corrected_ratio, or of a0/b0, with respect to a0, a1, a2, b0, b1, b2 (holomorphic in all).
std::array<Complex, 6> ratio_gradient(const Series& a, const Series& b, const SweepRate& sweep,
                                      bool correct) {
  const Complex q0 = a[0] / b[0];
  const Complex q1 = (a[1] - q0 * b[1]) / b[0];
  const Complex q2 = (a[2] - q0 * b[2] - q1 * b[1]) / b[0];
  const Complex s = b[1] / b[0];
  const Complex j(0.0, correct ? 1.0 / sweep.rate : 0.0);
  std::array<Complex, 6> gradient{};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto unit = [&](std::size_t k) { return i == k ? 1.0 : 0.0; };
    const Complex d0 = (unit(0) - q0 * unit(3)) / b[0];
    const Complex d1 = (unit(1) - q0 * unit(4) - q1 * unit(3) - b[1] * d0) / b[0];
    const Complex d2 = (unit(2) - q0 * unit(5) - q1 * unit(4) - q2 * unit(3) - b[2] * d0 - b[1] * d1) / b[0];
    const Complex ds = (unit(4) - s * unit(3)) / b[0];
    gradient[i] = d0 + j * (d1 * (s - 0.5 * sweep.curvature) + q1 * ds + d2);
  }
  return gradient;
}

struct Regression {
  std::array<Series, 3> series;  ///< of excitation, input, output
  Eigen::Matrix3cd noise_gain;   ///< E{e e^H} of the three Taylor coefficients for white noise of variance 1
  Eigen::MatrixX3d residual;     ///< [sample of the window, signal]
  Eigen::VectorXd weights;
  Eigen::Index first = 0;
};

/// Linear: constant rate. Logarithmic: wdot = w q/T and wddot/wdot = q/T with q = ln(f1/f0).
SweepRate rate_of(const online::SweepLaw& law, double frequency_hz) {
  if (law.sweep == online::Sweep::linear) return {kTwoPi * (law.to_hz - law.from_hz) / law.duration_s, 0.0};
  const double growth = std::log(law.to_hz / law.from_hz) / law.duration_s;
  return {kTwoPi * frequency_hz * growth, growth};
}

/// Weighted regression of the three signals around sample `centre`.
Regression regress(const Sweep& sweep, const SweptConfig& config, double centre, double half_width) {
  const auto count = static_cast<Eigen::Index>(sweep.phase_rad.size());
  Regression result;
  result.first = std::max<Eigen::Index>(0, static_cast<Eigen::Index>(std::ceil(centre - half_width - 1.0)));
  const auto last = std::min(count - 1, static_cast<Eigen::Index>(std::floor(centre + half_width + 1.0)));
  const Eigen::Index samples = last - result.first + 1;
  const Eigen::Index columns = 2 * kTerms + (config.fit_offset ? 2 : 0);
  Eigen::MatrixXd design(samples, columns);
  Eigen::MatrixX3d measured = Eigen::MatrixX3d::Zero(samples, 3);
  result.weights.resize(samples);
  for (Eigen::Index n = 0; n < samples; ++n) {
    const auto k = static_cast<std::size_t>(result.first + n);
    const double distance = static_cast<double>(k) - centre;
    const double u = std::min(1.0, std::abs(distance) / (half_width + 1.0));
    const double falling = 1.0 - u * u * u;
    result.weights(n) = falling * falling * falling;
    const double cosine = sweep.cosine[k], sine = sweep.sine[k];
    double power = 1.0;
    for (Eigen::Index i = 0; i < kTerms; ++i, power *= distance / half_width) {
      design(n, i) = power * cosine;
      design(n, kTerms + i) = -power * sine;
    }
    if (config.fit_offset) {
      design(n, 2 * kTerms) = 1.0;
      design(n, 2 * kTerms + 1) = distance / half_width;
    }
    for (std::size_t i = 0; i < 3; ++i)
      if (!sweep.values[i].empty()) measured(n, static_cast<Eigen::Index>(i)) = sweep.values[i][k];
  }
  // The columns are far from dependent: normal equations lose no digit that counts, and cost a part of a QR.
  const Eigen::MatrixXd weighted = result.weights.asDiagonal() * design;
  const linalg::RealLdlt normal(design.transpose() * weighted);
  const Eigen::MatrixX3d solution = normal.solve(weighted.transpose() * measured);
  result.residual = measured - design * solution;

  // Estimates are P x with P = (A'WA)^-1 A'W, so white noise gives P P' = (A'WA)^-1 A'W W A (A'WA)^-1.
  const Eigen::MatrixXd half = normal.solve(weighted.transpose() * weighted);
  const Eigen::MatrixXd gain = normal.solve(half.transpose());
  const double unit_s = half_width * sweep.sample_time_s;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double scale = std::pow(unit_s, static_cast<double>(-i));
    for (std::size_t x = 0; x < 3; ++x) {
      const auto column = static_cast<Eigen::Index>(x);
      result.series[x][static_cast<std::size_t>(i)] =
          scale * Complex(solution(i, column), solution(kTerms + i, column));
    }
    for (Eigen::Index m = 0; m < 3; ++m)
      result.noise_gain(i, m) =
          scale * std::pow(unit_s, static_cast<double>(-m)) *
          Complex(gain(i, m) + gain(kTerms + i, kTerms + m), gain(kTerms + i, m) - gain(i, kTerms + m));
  }
  return result;
}

}  // namespace

LineEstimate local_cubic_line(const Sweep& sweep, const SweptConfig& config, double half_width,
                              double frequency_hz) {
  const double time_s = time_of(sweep.law, frequency_hz);
  const double centre = time_s / sweep.sample_time_s;
  const Regression fit = regress(sweep, config, centre, half_width);
  // The regression takes up noise within about 2/(1.5 w) of the chirp (four complex terms per effective
  // length 1.5 w); the noise is looked at from there on.
  const double reach_hz = 2.0 / (1.5 * half_width * sweep.sample_time_s);
  const SideNoise noise = noise_beside(
      std::span(sweep.phase_rad).subspan(static_cast<std::size_t>(fit.first)), sweep.sample_time_s,
      frequency_hz, fit.residual, fit.weights, 1.5 * reach_hz, 4.0 * reach_hz);

  LineEstimate line;
  line.frequency_hz = frequency_hz;
  line.degrees_of_freedom = std::max(noise.averages, 1.0);
  // Everything is anchored at one signal, whose error is put into the ratios to it.
  const std::size_t anchor = sweep.values[1].empty() ? 0 : 1;
  const Series& base = fit.series[anchor];
  std::array<Complex, 3> value{};
  std::array<std::array<Complex, 6>, 3> gradient{};
  const SweepRate rate = rate_of(sweep.law, frequency_hz);
  for (std::size_t x = 0; x < 3; ++x) {
    if (sweep.values[x].empty()) continue;
    value[x] = x == anchor ? base[0]
                           : base[0] * (config.correct_sweep ? corrected_ratio(fit.series[x], base, rate)
                                                             : fit.series[x][0] / base[0]);
    if (x != anchor) gradient[x] = ratio_gradient(fit.series[x], base, rate, config.correct_sweep);
  }
  for (std::size_t x = 0; x < 3; ++x)
    for (std::size_t y = 0; y < 3; ++y) {
      Complex sum = 0.0;
      for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t m = 0; m < 6; ++m) {
          const auto from = static_cast<Eigen::Index>(i < 3 ? x : anchor);
          const auto to = static_cast<Eigen::Index>(m < 3 ? y : anchor);
          sum += gradient[x][i] * std::conj(gradient[y][m]) *
                 fit.noise_gain(static_cast<Eigen::Index>(i % 3), static_cast<Eigen::Index>(m % 3)) *
                 noise.density(from, to);
        }
      line.covariance(static_cast<Eigen::Index>(x), static_cast<Eigen::Index>(y)) = std::norm(base[0]) * sum;
    }
  line.excitation = value[0];
  line.input = value[1];
  line.output = value[2];
  return line;
}

}  // namespace resonid::response
