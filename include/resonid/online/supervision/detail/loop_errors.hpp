// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/online/models/detail/zoh_two_mass.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/supervision/loop_margins.hpp>

namespace resonid::online {

/// Covariance of the relative error dG/G of a response at one frequency: all that the errors of margins and
/// gap depend on, whatever G came from.
struct RelativeError {
  double real = std::numeric_limits<double>::quiet_NaN();   ///< E Re(dG/G)^2
  double imag = std::numeric_limits<double>::quiet_NaN();   ///< E Im(dG/G)^2
  double cross = std::numeric_limits<double>::quiet_NaN();  ///< E Re(dG/G) Im(dG/G)

  /// Variance of Re(c dG/G) to first order.
  [[nodiscard]] double along(std::complex<double> c) const noexcept {
    return c.real() * c.real() * real + c.imag() * c.imag() * imag - 2.0 * c.real() * c.imag() * cross;
  }
};

/// Relative error of a line whose error is circular, std^2 = E|error|^2.
[[nodiscard]] inline RelativeError relative_error(std::complex<double> value, double std) noexcept {
  const double half = 0.5 * std * std / std::norm(value);
  return {half, half, 0.0};
}

/// Relative error dG/G = gradient' e for parameters with errors e of the given covariance.
template <std::size_t N, class Covariance>
[[nodiscard]] RelativeError relative_error(const std::array<std::complex<double>, N>& gradient,
                                           const Covariance& covariance) noexcept {
  RelativeError e{0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < N; ++i)
    for (std::size_t j = 0; j < N; ++j) {
      const auto c = static_cast<double>(covariance(static_cast<int>(i), static_cast<int>(j)));
      e.real += c * gradient[i].real() * gradient[j].real();
      e.imag += c * gradient[i].imag() * gradient[j].imag();
      e.cross += c * gradient[i].real() * gradient[j].imag();
    }
  return e;
}

/// Relative error of a discrete model with the covariance of [b, a]:
/// dG/G = sum db_i z^-i/B - sum da_i z^-i/A.
template <class Real, std::size_t Order>
[[nodiscard]] RelativeError relative_error(const DiscreteModel<Real, Order>& model,
                                           const ModelCovariance<Real, Order>& covariance,
                                           double frequency_hz, double sample_rate_hz) noexcept {
  const auto back = std::polar(1.0, -kTwoPi * frequency_hz / sample_rate_hz);
  std::complex<double> b = 0.0, a = 1.0, power = 1.0;
  std::array<std::complex<double>, 2 * Order> gradient;
  for (std::size_t i = 0; i < Order; ++i) {
    power *= back;
    b += static_cast<double>(model.b[i]) * power;
    a += static_cast<double>(model.a[i]) * power;
    gradient[i] = power;
    gradient[Order + i] = -power;
  }
  for (std::size_t i = 0; i < Order; ++i) {
    gradient[i] /= b;
    gradient[Order + i] /= a;
  }
  return relative_error(gradient, covariance);
}

/// Sampled response (zero-order hold) of a two-mass drive, torque to driven velocity, with its exact gradient
/// by ln J1, ln J2, ln K, ln D and B:
///
///   G = c X b,   X = (z - A)^-1   dG = c X (dA X b + db)
///
/// The discretisation is done once; a frequency costs one solution of three equations.
class TwoMassResponse {
 public:
  static constexpr std::size_t kParameters = ZohTwoMass<double>::kDerivatives;
  using Covariance = Eigen::Matrix<double, static_cast<int>(kParameters), static_cast<int>(kParameters)>;
  struct Point {
    std::complex<double> value;
    std::array<std::complex<double>, kParameters> relative_gradient;
  };

  TwoMassResponse(const TwoMassPoint<double>& p, double sample_rate_hz) noexcept
      : sample_rate_hz_(sample_rate_hz),
        zoh_(ZohTwoMass<double>::over(
            p, std::sqrt(p.stiffness * (1.0 / p.driven_inertia + 1.0 / p.load_inertia)),
            1.0 / sample_rate_hz)) {}

  [[nodiscard]] Point at(double frequency_hz) const noexcept;
  /// `covariance` of ln J1, ln J2, ln K, ln D, B.
  [[nodiscard]] RelativeError relative_error_at(double frequency_hz,
                                                const Covariance& covariance) const noexcept {
    return relative_error(at(frequency_hz).relative_gradient, covariance);
  }

 private:
  double sample_rate_hz_;
  ZohTwoMass<double> zoh_;
};

/// Standard deviations of a loop's margins; NaN where there is no margin, or none of its error is known.
struct MarginStds {
  double crossover_hz = std::numeric_limits<double>::quiet_NaN();
  double phase_margin_deg = std::numeric_limits<double>::quiet_NaN();
  double modulus_margin = std::numeric_limits<double>::quiet_NaN();
};

/// Standard deviation of |v| where v, known with errors of variance `along` in its own direction and `across`
/// to it, is `length` long. To first order sqrt(along); where v is hardly longer than its error, what lies
/// across makes it longer too, and of v = 0 all of the error is left.
[[nodiscard]] inline double length_std(double length, double along, double across) noexcept {
  if (!(along + across > 0.0)) return std::sqrt(along);
  const double bent = 3.0 * across * across / (4.0 * length * length + 3.0 * across);
  return std::sqrt(along + bent);
}

/// By the delta method, with the controller and the delay exactly known (dL/L = dG/G = e):
///
///   df_c = -Re e/Re l      dPM = Im e + Im l df_c      l = d ln L/df at the crossover
///   d|1 + L| = Re(conj(1 + L) L e)/|1 + L|             at its minimum, wherever that moves to
///
/// `found`: of the loop whose error is meant; error_at(f) gives its RelativeError, loop_at(f) the loop.
/// Bounded: two evaluations of the error, three of the loop. Source: first-order propagation
/// (docs/methods/margins.md).
template <class ErrorAt, class LoopAt>
[[nodiscard]] MarginStds margin_stds(const LoopMargins<double>& found, ErrorAt&& error_at,
                                     LoopAt&& loop_at) noexcept {
  constexpr double kStep = 1e-4;  // relative, of the derivative by frequency
  constexpr double kDegrees = 360.0 / kTwoPi;
  MarginStds s;
  if (const double f = found.crossover_hz; f > 0.0) {
    const RelativeError e = error_at(f);
    const std::complex<double> above = loop_at(f * (1.0 + kStep)), below = loop_at(f * (1.0 - kStep));
    const auto slope = std::log(above / below) / (2.0 * kStep * f);
    s.crossover_hz = std::sqrt(e.real) / std::abs(slope.real());
    // Im e - (Im l/Re l) Re e = Re((-Im l/Re l - j) e)
    s.phase_margin_deg = kDegrees * std::sqrt(e.along({-slope.imag() / slope.real(), -1.0}));
  }
  if (const double f = found.modulus_margin_hz; f > 0.0) {
    const RelativeError e = error_at(f);
    const std::complex<double> loop = loop_at(f);
    const auto direction = std::conj(1.0 + loop) / std::abs(1.0 + loop) * loop;
    s.modulus_margin =
        length_std(found.modulus_margin, e.along(direction), e.along(direction * std::complex(0.0, 1.0)));
  }
  return s;
}

/// Chordal distance of two responses at one frequency, 0 ... 1: |x - x0|/sqrt((1 + |x|^2)(1 + |x0|^2)).
template <class Real>
[[nodiscard]] Real chordal(std::complex<Real> x, std::complex<Real> x0) noexcept {
  return std::abs(x - x0) / std::sqrt((Real(1) + std::norm(x)) * (Real(1) + std::norm(x0)));
}

/// Its standard deviation from the relative error of x (x0 is what it is compared with, and exact):
///
///   dk = k Re[(x conj(x - x0)/|x - x0|^2 - |x|^2/(1 + |x|^2)) dx/x]
///
/// Where the distance is no larger than its error, the error's whole length counts (length_std()). The
/// largest distance over frequency has the same, at its frequency: where the maximum lies makes no difference
/// to first order.
[[nodiscard]] inline double gap_std(std::complex<double> x, std::complex<double> x0,
                                    const RelativeError& error) noexcept {
  const std::complex<double> v = x - x0;
  const double scale = 1.0 / std::sqrt((1.0 + std::norm(x)) * (1.0 + std::norm(x0)));
  const double length = std::abs(v);
  const auto direction = (length > 0.0 ? std::conj(v) / length : 1.0) * x;
  const auto nearer = direction - length * std::norm(x) / (1.0 + std::norm(x));
  return scale * length_std(length, error.along(nearer), error.along(direction * std::complex(0.0, 1.0)));
}

/// The largest chordal distance to a reference over the lines or points of a band, one by one: the work of
/// one is bounded. Pointwise: no winding numbers. What is not finite is left out. Source: Vinnicombe 1993.
class GapScan {
 public:
  using Complex = std::complex<double>;

  /// x and reference: W G and W G0. `std`: of x, circular, std^2 = E|error|^2; NaN: not known.
  void step(double frequency_hz, Complex x, Complex reference,
            double std = std::numeric_limits<double>::quiet_NaN()) noexcept {
    const double distance = chordal(x, reference);
    if (!std::isfinite(distance) || distance <= gap_) return;  // false while there is none
    gap_ = distance;
    hz_ = frequency_hz;
    value_ = x;
    reference_ = reference;
    std_ = std;
  }
  void reset() noexcept { *this = {}; }

  /// NaN: no point was finite.
  [[nodiscard]] double gap() const noexcept { return gap_; }
  [[nodiscard]] double gap_hz() const noexcept { return hz_; }
  [[nodiscard]] Complex value() const noexcept { return value_; }  ///< W G there
  [[nodiscard]] Complex reference() const noexcept { return reference_; }
  /// By the std that was given with the point.
  [[nodiscard]] double gap_std() const noexcept {
    return online::gap_std(value_, reference_, relative_error(value_, std_));
  }

 private:
  static constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
  double gap_ = kAbsent, hz_ = kAbsent, std_ = kAbsent;
  Complex value_{kAbsent, kAbsent}, reference_{kAbsent, kAbsent};
};

}  // namespace resonid::online
