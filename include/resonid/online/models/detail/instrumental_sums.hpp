// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace resonid::online {

/// The weighted normal equations of the instrumental-variable estimate, R theta = q, that the recursion
/// P = R^-1, theta = P q of METHOD 6.8 solves:
///
///   R <- lambda R + z f'        q <- lambda q + z t
///
/// R is not symmetric, so that P has no factors that would keep it well-formed over long runs; R itself needs
/// none: what rounding has done to it is forgotten like all else.
///
/// Solved is (R + lambda^k H0 + H) theta = q + lambda^k H0 start + H held with small diagonal H0, H: what is
/// known at the start, forgotten like all else, and a tie of each parameter to its present estimate. That
/// limits the covariance to 1/H per unit residual variance, and without excitation (R -> 0, q -> 0) it keeps
/// the estimate, one direction at a time.
template <class Real, std::size_t N>
class InstrumentalSums {
 public:
  using Vector = std::array<Real, N>;
  using Matrix = Eigen::Matrix<Real, static_cast<int>(N), static_cast<int>(N)>;

  /// Starts from `theta`.
  void reset(const Vector& theta) noexcept {
    r_.fill(Real(0));
    q_.fill(Real(0));
    start_ = held_ = theta;
    start_weight_ = Real(1);
    weight_ = squares_ = ages_ = Real(0);
  }

  /// One equation target = regressor' theta + error. Older ones keep `factor` of their weight.
  void add(const Vector& instrument, const Vector& regressor, Real target, Real factor) noexcept {
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = 0; j < N; ++j)
        r_[i * N + j] = factor * r_[i * N + j] + instrument[i] * regressor[j];
    for (std::size_t i = 0; i < N; ++i) q_[i] = factor * q_[i] + instrument[i] * target;
    ages_ = factor * (ages_ + weight_);
    weight_ = factor * weight_ + Real(1);
    squares_ = factor * factor * squares_ + Real(1);
    start_weight_ *= factor;
  }

  /// Certainty of the start and of the present estimate, per unit residual variance; all > 0.
  struct Prior {
    Vector start, hold;
  };
  struct Solution {
    Vector theta;
    /// Information about each parameter over what holds it, those before it taken as known; 1: none but that.
    Vector gain;
  };
  [[nodiscard]] Solution solve(const Prior& prior) const noexcept {
    Column right;
    for (std::size_t i = 0; i < N; ++i)
      right(static_cast<int>(i)) =
          q_[i] + start_weight_ * prior.start[i] * start_[i] + prior.hold[i] * held_[i];
    const Eigen::PartialPivLU<Matrix> factors(matrix(prior));
    const Column solution = factors.solve(right);
    Solution s;
    for (std::size_t i = 0; i < N; ++i) {
      const int j = static_cast<int>(i);
      s.theta[i] = solution(j);
      s.gain[i] = std::abs(factors.matrixLU()(j, j)) / prior.hold[i];
    }
    return s;
  }
  /// From now on what is not excited stays here.
  void hold(const Vector& theta) noexcept { held_ = theta; }

  /// Without excitation the sums fade; this keeps them from fading into slow denormal numbers.
  void flush() noexcept {
    for (Real& x : r_) x = std::abs(x) < kNothing ? Real(0) : x;
    for (Real& x : q_) x = std::abs(x) < kNothing ? Real(0) : x;
  }

  /// R^-1 E[z z'] R^-T per unit residual variance of white noise: the weights' squares against the weights,
  /// the symmetric part of E[z f'] taken for E[z z']. Infinite while that is not positive definite.
  [[nodiscard]] Matrix covariance(const Prior& prior) const noexcept {
    const Matrix r = matrix(prior);
    const Eigen::LLT<Matrix> factor(Matrix(Real(0.5) * (r + r.transpose())));
    if (factor.info() != Eigen::Success) return Matrix::Identity() * std::numeric_limits<Real>::infinity();
    const Matrix inverse = factor.solve(Matrix::Identity());
    return weight_ > Real(0) ? Matrix(inverse * (squares_ / weight_)) : inverse;
  }

  /// Sum of the weights: 1/(1 - lambda) in the steady state.
  [[nodiscard]] Real weight() const noexcept { return weight_; }
  /// Mean age of the equations in samples: lambda/(1 - lambda) in the steady state.
  [[nodiscard]] Real age() const noexcept { return weight_ > Real(0) ? ages_ / weight_ : Real(0); }
  /// Sum of squared weights over the square of their sum: the part of an equation's error in the estimate.
  [[nodiscard]] Real share() const noexcept {
    return weight_ > Real(0) ? squares_ / (weight_ * weight_) : Real(1);
  }

 private:
  using Column = Eigen::Matrix<Real, static_cast<int>(N), 1>;

  [[nodiscard]] Matrix matrix(const Prior& prior) const noexcept {
    Matrix m =
        Eigen::Map<const Eigen::Matrix<Real, static_cast<int>(N), static_cast<int>(N), Eigen::RowMajor>>(
            r_.data());
    for (std::size_t i = 0; i < N; ++i)
      m(static_cast<int>(i), static_cast<int>(i)) += start_weight_ * prior.start[i] + prior.hold[i];
    return m;
  }

  static constexpr Real kNothing = Real(1e-30);

  std::array<Real, N * N> r_{};
  Vector q_{}, start_{}, held_{};
  Real start_weight_ = Real(1);
  Real weight_ = Real(0), squares_ = Real(0), ages_ = Real(0);
};

}  // namespace resonid::online
