// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/online/models/detail/stiffness_motion.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>
#include <span>

namespace resonid::online {

/// Matrix of run-time size without heap: compiled once for all orders.
inline constexpr int kMostParameters = 12;
using BoundedMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostParameters, kMostParameters>;

/// Least real part of the eigenvalues; not a number of a matrix that is not finite.
[[nodiscard]] double least_real_eigenvalue(const BoundedMatrix& m) noexcept;
/// a^-1 b; not a number where a is singular.
[[nodiscard]] BoundedMatrix solved(const BoundedMatrix& a, const BoundedMatrix& b) noexcept;

/// Covariance X that residuals leave in the parameters of a pseudo-linear recursion; `p`: their variance
/// times the recursion's P where they are white, else PositiveReal::of_errors(). With `share` = sum of
/// squared weights over sum of weights (1 without forgetting, 1/(1 + lambda) with):
///
///   (M - d) X + X (M - d)' = p      d = 1 - 1/(2 share)
///
/// which is p share for M = I. Infinite where the recursion does not settle, Re eig M <= d.
[[nodiscard]] BoundedMatrix recursion_covariance(const BoundedMatrix& m, const BoundedMatrix& p,
                                                 double share) noexcept;

/// A controller in powers of z^-1, from measured output to -u; all 0 in the numerator: none.
struct ControllerCoefficients {
  static constexpr std::size_t kMaxOrder = 4;
  std::array<double, kMaxOrder + 1> numerator{};
  std::array<double, kMaxOrder + 1> denominator{1.0};
};

/// Spans of at most kMaxOrder + 1 coefficients.
inline ControllerCoefficients controller_coefficients(std::span<const double> numerator,
                                                      std::span<const double> denominator) noexcept {
  ControllerCoefficients c;
  for (std::size_t i = 0; i < std::min(numerator.size(), c.numerator.size()); ++i)
    c.numerator[i] = numerator[i];
  for (std::size_t i = 0; i < std::min(denominator.size(), c.denominator.size()); ++i)
    c.denominator[i] = denominator[i];
  return c;
}

/// By what a regressor is filtered.
enum class RegressorFilter { none, inverse_a, sensitivity };  ///< 1, 1/A, S/A

/// A pseudo-linear recursion that moves its parameters along H f while the error depends on them by F f.
template <std::size_t Order>
struct PseudoLinearRecursion {
  DiscreteModel<double, Order> model{};  ///< The machine, or the estimate that stands for it.
  std::size_t delay_samples = 0;
  bool fixed_integrator = false;
  ControllerCoefficients controller{};                 ///< Of the loop that the data comes from.
  RegressorFilter error = RegressorFilter::inverse_a;  ///< F: 1/A of output error, S/A of CLOE.
  RegressorFilter gradient = RegressorFilter::none;    ///< H
  DiscreteModel<double, Order> gradient_model{};       ///< That H is built from.
  double gradient_contraction = 1.0;                   ///< Factor that draws in the poles of H = 1/A.
  double from = 0.0, to = 0.5;                         ///< Excited band in cycles per sample.
};

/// What becomes of a small error of the parameters: on average theta' = -(1 - lambda) M (theta - theta*).
struct LocalStability {
  bool stable = false;
  double least_eigenvalue =
      -std::numeric_limits<double>::infinity();  ///< Least real part, of M; > 0: stable.
  /// Least Re F/H - 1/2 over the excited band; >= 0 is sufficient for stability, but not necessary.
  double least_real_part = -std::numeric_limits<double>::infinity();
  /// Lag of the first resonance over the mean age of the memory, when the stiffness changes and the damping
  /// ratio stays; 1 of least squares and of instrumental variables. Not a number where nothing oscillates.
  double lag_share = std::numeric_limits<double>::quiet_NaN();
};

/// Evaluates
///
///   M = (E[(H f)(H f)'])^-1 E[(H f)(F f)']     f = [z^-(d+i) U, -z^-i Y],  U = S ru,  Y = G z^-d U
///
/// by an integral over the excited band, ru being white in it as a PRBS is. M is I where H = F. A stable
/// machine keeps the recursion stable if Re F/H > 1/2; light damping and fast sampling break that, and then M
/// decides. Its inverse, along the direction in which a changing stiffness moves the parameters, is the lag.
/// No heap; some 50 us. Source: METHOD 6.3-6.5; ORACLE E; Ljung 1977; Landau and Karimi 1997.
template <std::size_t Order>
class PositiveReal {
 public:
  static constexpr int kN = static_cast<int>(2 * Order);
  using Matrix = Eigen::Matrix<double, kN, kN>;
  using Vector = Eigen::Matrix<double, kN, 1>;
  using Complex = std::complex<double>;

  explicit PositiveReal(const PseudoLinearRecursion<Order>& recursion) noexcept
      : at_(recursion), stiffness_(StiffnessDirection<double, Order>::of(recursion.model)) {
    integrate();
    const Matrix m = solved(own_, cross_);
    if (!m.allFinite()) return;
    m_ = m;
    result_.least_eigenvalue = least_real_eigenvalue(m);
    result_.stable = result_.least_eigenvalue > 0.0;
    result_.least_real_part = least_real_part_;
    result_.lag_share = lag_share(m);
  }
  [[nodiscard]] const LocalStability& result() const noexcept { return result_; }
  /// M for [b, a], or with a fixed integrator for b and the coefficients of A/(1 - z^-1), the last one idle.
  [[nodiscard]] const Matrix& matrix() const noexcept { return m_; }
  /// Along the direction g in which a stiffness moves the parameters, means over the band:
  /// |g'H f|^2, Re g'(H f)(F f)^* g and |g'F f|^2. All 0 where nothing oscillates.
  struct Motion {
    double own = 0.0, cross = 0.0, error = 0.0;
  };
  [[nodiscard]] const Motion& motion() const noexcept { return motion_; }
  /// What stands for variance P in recursion_covariance() when the error is not white, `p` being the
  /// recursion's P: `noise` of the error's variance is white noise of the output, `motion` of it what a
  /// stiffness leaves that moves, the error g'F f.
  ///
  ///   U R^-1 W R^-T U'     R R' = E[(H f)(H f)']     U U' = P     R lower, U upper triangular
  ///
  /// so that P counts once, and no direction gets a negative variance. W = noise Wn + motion Wm. Under
  /// feedback (RegressorFilter::sensitivity) the error is S (y - G u), which has most of its power where
  /// |1 + L| is least: Wn = E[(S H f)(S H f)'] / mean |S|^2. In open loop p stays as it is.
  ///
  /// Wm is the spectrum of H f times that error, both being signals of the same oscillation. With
  /// v = (H f)(g'F f)^*, Gaussian signals make it 2 Re v Re v', half of which remains after the mean lag is
  /// taken off; what lies in quadrature cancels then, but a smeared resonance looks damped, for which
  /// kSmeared Im v Im v' stands (docs/methods/recursive_output_error.md).
  [[nodiscard]] Matrix of_errors(const Matrix& p, double noise, double motion) const noexcept {
    if (at_.error != RegressorFilter::sensitivity) return p * (noise + motion);
    Matrix r = Matrix::Zero(), u = Matrix::Zero();
    for (int j = 0; j < kN; ++j)
      for (int i = j; i < kN; ++i) {
        double rest = own_(i, j);
        for (int k = 0; k < j; ++k) rest -= r(i, k) * r(j, k);
        r(i, j) = i == j ? std::sqrt(rest) : rest / r(j, j);
      }
    for (int j = kN; j-- > 0;)  // columns from the last one on; 0 of a parameter that is not estimated
      for (int i = j + 1; i-- > 0;) {
        double rest = p(i, j);
        for (int k = j + 1; k < kN; ++k) rest -= u(i, k) * u(j, k);
        u(i, j) = i == j ? std::sqrt(std::max(rest, 0.0)) : (u(j, j) > 0.0 ? rest / u(j, j) : 0.0);
      }
    Matrix half = noise_ * (noise / noise_level_);  // W, R^-1 W, then R^-1 (R^-1 W)'
    if (motion > 0.0) half += moving_ * (motion / motion_.error);
    for (int side = 0; side < 2; ++side) {
      for (int j = 0; j < kN; ++j)
        for (int i = 0; i < kN; ++i) {
          for (int k = 0; k < i; ++k) half(i, j) -= r(i, k) * half(k, j);
          half(i, j) /= r(i, i);
        }
      half.transposeInPlace();
    }
    return u * half * u.transpose();
  }

 private:
  static constexpr double kSmeared = 0.75;  // measured on belts, 2 and 4 ms

  void integrate() noexcept {
    const int points = grid();
    for (int k = 0; k < points; ++k) {
      const double share = (static_cast<double>(k) + 0.5) / points;
      const double omega = kTwoPi * (at_.from + share * (at_.to - at_.from));
      const Complex back = std::polar(1.0, -omega);
      const Complex loop = delayed(at_.model, back) * controller(back);
      const Complex input = 1.0 / (1.0 + loop);
      const Complex output = delayed(at_.model, back) * input;
      const Complex error = filter(at_.error, at_.model, 1.0, back);
      const Complex gradient = filter(at_.gradient, at_.gradient_model, at_.gradient_contraction, back);
      accumulate(points, back, input, output, error, gradient);
      noise_level_ += std::norm(input) / points;
      least_real_part_ = std::min(least_real_part_, (error / gradient).real() - 0.5);
    }
    if (at_.fixed_integrator) own_(kN - 1, kN - 1) = cross_(kN - 1, kN - 1) = 1.0;
  }
  void accumulate(int points, Complex back, Complex input, Complex output, Complex error,
                  Complex gradient) noexcept {
    std::array<Complex, 2 * Order> f;
    Complex power = std::pow(back, static_cast<int>(at_.delay_samples));
    for (std::size_t i = 0; i < Order; ++i) f[i] = (power *= back) * input;
    power = at_.fixed_integrator ? 1.0 - back : Complex(1.0);
    for (std::size_t i = 0; i < Order; ++i) f[Order + i] = -(power *= back) * output;
    if (at_.fixed_integrator) f[2 * Order - 1] = 0.0;
    const double own = std::norm(gradient);
    const Complex cross = gradient * std::conj(error);
    Complex moving = 0.0;
    power = std::pow(back, static_cast<int>(at_.delay_samples));
    for (std::size_t i = 0; i < Order; ++i) moving += stiffness_.change.b[i] * (power *= back) * input;
    power = 1.0;
    for (std::size_t i = 0; i < Order; ++i) moving -= stiffness_.change.a[i] * (power *= back) * output;
    motion_.own += own * std::norm(moving) / points;
    motion_.cross += cross.real() * std::norm(moving) / points;
    motion_.error += std::norm(error) * std::norm(moving) / points;
    std::array<double, 2 * Order> in_phase, quadrature;
    for (std::size_t i = 0; i < 2 * Order; ++i) {
      const Complex v = cross * f[i] * std::conj(moving);
      in_phase[i] = v.real();
      quadrature[i] = v.imag();
    }
    for (std::size_t i = 0; i < 2 * Order; ++i)
      for (std::size_t j = 0; j < 2 * Order; ++j) {
        const Complex product = f[i] * std::conj(f[j]);
        own_(static_cast<int>(i), static_cast<int>(j)) += own * product.real();
        noise_(static_cast<int>(i), static_cast<int>(j)) += own * std::norm(input) * product.real();
        moving_(static_cast<int>(i), static_cast<int>(j)) +=
            in_phase[i] * in_phase[j] + kSmeared * quadrature[i] * quadrature[j];
        cross_(static_cast<int>(i), static_cast<int>(j)) += (cross * product).real();
      }
  }

  /// Enough points for the narrowest resonance.
  [[nodiscard]] int grid() const noexcept {
    double narrowest = 0.1;
    const SampledModes<Order> modes(at_.model, 1.0);
    for (const Complex& z : modes.poles())
      if (z.imag() > 0.0) narrowest = std::min(narrowest, std::abs(1.0 - std::abs(z)));
    return static_cast<int>(std::clamp(12.0 / std::max(narrowest, 1e-6), 128.0, 2048.0));
  }

  /// B/A z^-d
  [[nodiscard]] Complex delayed(const DiscreteModel<double, Order>& m, Complex back) const noexcept {
    Complex b = 0.0, power = std::pow(back, static_cast<int>(at_.delay_samples));
    for (std::size_t i = 0; i < Order; ++i) b += m.b[i] * (power *= back);
    return b / denominator(m, back);
  }
  [[nodiscard]] static Complex denominator(const DiscreteModel<double, Order>& m, Complex back) noexcept {
    Complex a = 1.0, power = 1.0;
    for (std::size_t i = 0; i < Order; ++i) a += m.a[i] * (power *= back);
    return a;
  }
  [[nodiscard]] Complex controller(Complex back) const noexcept {
    Complex n = 0.0, d = 0.0;
    for (std::size_t i = ControllerCoefficients::kMaxOrder + 1; i-- > 0;) {
      n = n * back + at_.controller.numerator[i];
      d = d * back + at_.controller.denominator[i];
    }
    return n / d;
  }
  [[nodiscard]] Complex filter(RegressorFilter kind, const DiscreteModel<double, Order>& m,
                               double contraction, Complex back) const noexcept {
    if (kind == RegressorFilter::none) return 1.0;
    const Complex a = denominator(m, contraction * back);
    return kind == RegressorFilter::inverse_a ? 1.0 / a
                                              : 1.0 / (a * (1.0 + delayed(m, back) * controller(back)));
  }

  [[nodiscard]] double lag_share(const Matrix& m) const noexcept {
    constexpr double kStep = 1e-4;
    const SampledModes<Order> modes(at_.model, 1.0);
    const auto stiffer = modes.with_first_resonance_scaled(1.0 + kStep);
    const auto softer = modes.with_first_resonance_scaled(1.0 - kStep);
    const auto gradient = modes.resonance_gradient();
    Vector motion;
    for (std::size_t i = 0; i < Order; ++i) {
      motion(static_cast<int>(i)) = stiffer.b[i] - softer.b[i];
      motion(static_cast<int>(Order + i)) = stiffer.a[i] - softer.a[i];
    }
    const double moved = along(gradient, motion);
    if (at_.fixed_integrator)
      for (int i = static_cast<int>(Order) + 1; i < kN; ++i) motion(i) += motion(i - 1);
    Vector lag = solved(m, motion);
    if (at_.fixed_integrator)
      for (int i = kN - 1; i > static_cast<int>(Order); --i) lag(i) -= lag(i - 1);
    return along(gradient, lag) / moved;
  }
  [[nodiscard]] static double along(const std::array<double, 2 * Order>& gradient, const Vector& x) noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < 2 * Order; ++i) sum += gradient[i] * x(static_cast<int>(i));
    return sum;
  }

  PseudoLinearRecursion<Order> at_;
  Matrix own_ = Matrix::Zero(), cross_ = Matrix::Zero(), noise_ = Matrix::Zero(), moving_ = Matrix::Zero();
  double noise_level_ = 0.0;  // mean |S|^2
  StiffnessDirection<double, Order> stiffness_;
  Motion motion_;
  double least_real_part_ = std::numeric_limits<double>::infinity();
  Matrix m_ = Matrix::Zero();
  LocalStability result_;
};

/// A model in double precision.
template <class Real, std::size_t Order>
[[nodiscard]] DiscreteModel<double, Order> widened(const DiscreteModel<Real, Order>& m) noexcept {
  DiscreteModel<double, Order> wide;
  for (std::size_t i = 0; i < Order; ++i) {
    wide.b[i] = static_cast<double>(m.b[i]);
    wide.a[i] = static_cast<double>(m.a[i]);
  }
  return wide;
}

template <std::size_t Order>
[[nodiscard]] LocalStability local_stability(const PseudoLinearRecursion<Order>& recursion) noexcept {
  return PositiveReal<Order>(recursion).result();
}

}  // namespace resonid::online
