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

/// U R^-1 W R^-T U' with own = R R', p = U U', R lower and U upper triangular; a direction in which p is 0
/// stays 0.
[[nodiscard]] BoundedMatrix weighted(const BoundedMatrix& p, const BoundedMatrix& own,
                                     const BoundedMatrix& w) noexcept;

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
  ControllerCoefficients controller{};                 ///< Controller of the loop that the data comes from.
  RegressorFilter error = RegressorFilter::inverse_a;  ///< F: 1/A of output error, S/A of CLOE.
  RegressorFilter gradient = RegressorFilter::none;    ///< H
  DiscreteModel<double, Order> gradient_model{};       ///< That H is built from.
  double gradient_contraction = 1.0;                   ///< Factor that draws in the poles of H = 1/A.
  double from = 0.0, to = 0.5;                         ///< Excited band in cycles per sample.
};

/// The same for recursion_means(), which is compiled once: as many coefficients of each as the order.
struct RecursionBand {
  std::span<const double> b, a, gradient_b, gradient_a;
  std::span<const double> moving_b, moving_a;  ///< g: their change with the stiffness; 0: nothing oscillates.
  std::size_t delay_samples = 0;
  bool fixed_integrator = false;
  ControllerCoefficients controller{};
  RegressorFilter error{}, gradient{};
  double gradient_contraction = 1.0;
  double from = 0.0, to = 0.5;
  int points = 1;
};
/// Means over the band, of f in the parameters of the regression; v = (H f)(g'F f)^*.
struct RecursionMeans {
  BoundedMatrix own;         ///< (H f)(H f)'
  BoundedMatrix cross;       ///< (H f)(F f)'
  BoundedMatrix noise;       ///< (S H f)(S H f)'
  BoundedMatrix moving;      ///< Re v Re v' + kSmeared Im v Im v'
  double noise_level = 0.0;  ///< |S|^2
  double along_own = 0.0, along_cross = 0.0,
         along_error = 0.0;  ///< |g'H f|^2, Re g'(H f)(g'F f)^*, |g'F f|^2
  /// Real part of F/H, less 1/2; least, not mean.
  double least_real_part = std::numeric_limits<double>::infinity();
  static constexpr double kSmeared = 0.75;  ///< Measured on belts, 2 and 4 ms.
};
[[nodiscard]] RecursionMeans recursion_means(const RecursionBand& band) noexcept;

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
/// No heap; some 50 us. Source: Ljung 1977; Landau and Karimi 1997.
template <std::size_t Order>
class PositiveReal {
 public:
  static constexpr int kN = static_cast<int>(2 * Order);
  using Matrix = Eigen::Matrix<double, kN, kN>;
  using Vector = Eigen::Matrix<double, kN, 1>;
  using Complex = std::complex<double>;

  explicit PositiveReal(const PseudoLinearRecursion<Order>& recursion) noexcept : at_(recursion) {
    const auto stiffness = StiffnessDirection<double, Order>::of(recursion.model);
    RecursionBand band{.b = at_.model.b,
                       .a = at_.model.a,
                       .gradient_b = at_.gradient_model.b,
                       .gradient_a = at_.gradient_model.a,
                       .moving_b = stiffness.change.b,
                       .moving_a = stiffness.change.a};
    band.delay_samples = at_.delay_samples;
    band.fixed_integrator = at_.fixed_integrator;
    band.controller = at_.controller;
    band.error = at_.error;
    band.gradient = at_.gradient;
    band.gradient_contraction = at_.gradient_contraction;
    band.from = at_.from;
    band.to = at_.to;
    band.points = grid();
    means_ = recursion_means(band);
    const Matrix m = solved(means_.own, means_.cross);
    if (!m.allFinite()) return;
    m_ = m;
    result_.least_eigenvalue = least_real_eigenvalue(m);
    result_.stable = result_.least_eigenvalue > 0.0;
    result_.least_real_part = means_.least_real_part;
    result_.lag_share = lag_share(m);
  }
  [[nodiscard]] const LocalStability& result() const noexcept { return result_; }
  /// M for [b, a], or with a fixed integrator for b and the coefficients of A/(1 - z^-1), the last one idle.
  [[nodiscard]] const Matrix& matrix() const noexcept { return m_; }
  [[nodiscard]] const RecursionMeans& means() const noexcept { return means_; }
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
    BoundedMatrix errors = means_.noise;
    for (int i = 0; i < kN; ++i)
      for (int j = 0; j < kN; ++j) {
        errors(i, j) *= noise / means_.noise_level;
        if (motion > 0.0) errors(i, j) += means_.moving(i, j) * motion / means_.along_error;
      }
    return weighted(p, means_.own, errors);
  }

 private:
  /// Enough points for the narrowest resonance.
  [[nodiscard]] int grid() const noexcept {
    double narrowest = 0.1;
    const SampledModes<Order> modes(at_.model, 1.0);
    for (const Complex& z : modes.poles())
      if (z.imag() > 0.0) narrowest = std::min(narrowest, std::abs(1.0 - std::abs(z)));
    return static_cast<int>(std::clamp(12.0 / std::max(narrowest, 1e-6), 128.0, 2048.0));
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
  RecursionMeans means_;
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
