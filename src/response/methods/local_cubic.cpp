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

/// Sums over the window of t^m times what is named, m = 0 ... 6 down the rows; t is the distance from the
/// centre over the half width. All scalar products of the regression's columns t^i cos and -t^i sin are made
/// of these few, since cos^2 = (1 + cos 2)/2: a third of the work of the products themselves.
class Moments {
 public:
  static constexpr Eigen::Index kPowers = 2 * kTerms - 1;
  /// With weight w and w^2 each: 1, cos 2 phase, sin 2 phase, cos, sin.
  enum Carried : Eigen::Index { kOne, kDoubleCosine, kDoubleSine, kCosine, kSine, kCarried };

  Moments() : sums_(Eigen::MatrixXd::Zero(kPowers, kColumns)) {}

  /// Some samples: their t and weights, the carrier and the three signals.
  void add(const Eigen::ArrayXd& t, const Eigen::ArrayXd& weights, const Eigen::ArrayXd& cosine,
           const Eigen::ArrayXd& sine, const Eigen::MatrixX3d& measured) {
    const Eigen::Index count = t.size();
    Eigen::MatrixXd powers(count, kPowers), factors(count, kColumns);
    powers.col(0).setOnes();
    for (Eigen::Index m = 1; m < kPowers; ++m) powers.col(m).array() = powers.col(m - 1).array() * t;
    for (Eigen::Index square = 0; square < 2; ++square) {
      const Eigen::ArrayXd w = square == 0 ? weights : weights.square().eval();
      const auto put = [&](Carried what) { return factors.col(square * kCarried + what).array(); };
      put(kOne) = w;
      put(kDoubleCosine) = w * (cosine.square() - sine.square());
      put(kDoubleSine) = 2.0 * w * cosine * sine;
      put(kCosine) = w * cosine;
      put(kSine) = w * sine;
    }
    for (Eigen::Index x = 0; x < 3; ++x) {
      factors.col(kSignals + x).array() = weights * cosine * measured.col(x).array();
      factors.col(kSignals + 3 + x).array() = weights * sine * measured.col(x).array();
      factors.col(kSignals + 6 + x).array() = weights * measured.col(x).array();
    }
    sums_.noalias() += powers.transpose() * factors;
  }

  /// Scalar products of the columns t^i cos, -t^i sin, and 1 and t where there are `columns` for them, with
  /// the weights or (`squared`) their squares.
  [[nodiscard]] Eigen::MatrixXd products(Eigen::Index columns, bool squared) const {
    const auto sum = [&](Carried what, Eigen::Index power) {
      const Eigen::Index column = what;
      return sums_(power, squared ? kCarried + column : column);
    };
    Eigen::MatrixXd all(columns, columns);
    for (Eigen::Index i = 0; i < kTerms; ++i)
      for (Eigen::Index j = 0; j < kTerms; ++j) {
        all(i, j) = 0.5 * (sum(kOne, i + j) + sum(kDoubleCosine, i + j));
        all(kTerms + i, kTerms + j) = 0.5 * (sum(kOne, i + j) - sum(kDoubleCosine, i + j));
        all(i, kTerms + j) = all(kTerms + j, i) = -0.5 * sum(kDoubleSine, i + j);
      }
    for (Eigen::Index m = 0; 2 * kTerms + m < columns; ++m) {
      const Eigen::Index at = 2 * kTerms + m;
      for (Eigen::Index i = 0; i < kTerms; ++i) {
        all(at, i) = all(i, at) = sum(kCosine, i + m);
        all(at, kTerms + i) = all(kTerms + i, at) = -sum(kSine, i + m);
      }
      for (Eigen::Index n = 0; 2 * kTerms + n < columns; ++n) all(at, 2 * kTerms + n) = sum(kOne, m + n);
    }
    return all;
  }

  /// Scalar products of those columns with the signals.
  [[nodiscard]] Eigen::MatrixX3d with_signals(Eigen::Index columns) const {
    Eigen::MatrixX3d all(columns, 3);
    all.topRows(kTerms) = sums_.block(0, kSignals, kTerms, 3);
    all.middleRows(kTerms, kTerms) = -sums_.block(0, kSignals + 3, kTerms, 3);
    const Eigen::Index rest = columns - 2 * kTerms;
    all.bottomRows(rest) = sums_.block(0, kSignals + 6, rest, 3);
    return all;
  }

 private:
  static constexpr Eigen::Index kSignals = 2 * kCarried, kColumns = kSignals + 9;
  Eigen::MatrixXd sums_;
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
  constexpr Eigen::Index kBlock = 256;  // stays in the cache
  const auto in_blocks = [&](const auto& work) {
    for (Eigen::Index from = 0; from < samples; from += kBlock) {
      const Eigen::Index n = std::min(kBlock, samples - from);
      const Carrier carrier = sweep.carrier(result.first + from);
      const Eigen::ArrayXd distance = static_cast<double>(result.first + from) - centre +
                                      Eigen::ArrayXd::LinSpaced(n, 0.0, static_cast<double>(n - 1));
      work(from, distance, Eigen::Map<const Eigen::ArrayXd>(carrier.cosine.data(), n),
           Eigen::Map<const Eigen::ArrayXd>(carrier.sine.data(), n));
    }
  };
  result.residual.setZero(samples, 3);
  for (std::size_t i = 0; i < 3; ++i)
    if (!sweep.values[i].empty())
      result.residual.col(static_cast<Eigen::Index>(i)) =
          Eigen::Map<const Eigen::VectorXd>(sweep.values[i].data() + result.first, samples);
  result.weights.resize(samples);
  Moments moments;
  in_blocks([&](Eigen::Index from, const Eigen::ArrayXd& distance, const auto& cosine, const auto& sine) {
    const Eigen::ArrayXd falling = 1.0 - (distance.abs() / (half_width + 1.0)).min(1.0).cube();
    const Eigen::ArrayXd weights = falling.cube();
    result.weights.segment(from, distance.size()) = weights;
    moments.add(distance / half_width, weights, cosine, sine,
                result.residual.middleRows(from, distance.size()));
  });
  // The columns are far from dependent: normal equations lose no digit that counts, and cost a part of a QR.
  const linalg::RealLdlt normal(moments.products(columns, false));
  const Eigen::MatrixX3d solution = normal.solve(moments.with_signals(columns));
  in_blocks([&](Eigen::Index from, const Eigen::ArrayXd& distance, const auto& cosine, const auto& sine) {
    const Eigen::ArrayXd t = distance / half_width;
    for (Eigen::Index x = 0; x < 3; ++x) {
      const auto cubic = [&](Eigen::Index i) -> Eigen::ArrayXd {
        return solution(i, x) + t * (solution(i + 1, x) + t * (solution(i + 2, x) + t * solution(i + 3, x)));
      };
      auto left = result.residual.col(x).segment(from, t.size()).array();
      left -= cosine * cubic(0) - sine * cubic(kTerms);
      if (config.fit_offset) left -= solution(2 * kTerms, x) + t * solution(2 * kTerms + 1, x);
    }
  });

  // Estimates are P x with P = (A'WA)^-1 A'W, so white noise gives P P' = (A'WA)^-1 A'W W A (A'WA)^-1.
  const Eigen::MatrixXd half = normal.solve(moments.products(columns, true));
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
  const SideNoise noise = noise_beside(sweep.carrier(fit.first), sweep.sample_time_s, frequency_hz,
                                       fit.residual, fit.weights, 1.5 * reach_hz, 4.0 * reach_hz);

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
