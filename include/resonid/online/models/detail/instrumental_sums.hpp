// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace resonid::online {

/// Autocorrelation of the equations' errors over their variance:  r(t) = (near + far |t|) pole^|t|, r(0) = 1.
template <class Real>
struct ErrorCorrelation {
  Real pole = Real(0), near = Real(0), far = Real(0);  ///< All 0: white.

  /// Correlation of white noise that has passed (1 - z^-1)/(1 - pole z^-1) no time, once or twice.
  static ErrorCorrelation high_passed(Real pole, int times) noexcept {
    if (times == 0) return {};
    // Once it is 1/rho + b T, T being the transform of rho^|t|; that of T^2 is rho^t (t + (1 + rho^2)/(1 -
    // rho^2)).
    const Real b = -(Real(1) - pole) / ((Real(1) + pole) * pole);
    if (times == 1) {
      const Real variance = Real(2) / (Real(1) + pole);
      return {pole, b / variance, Real(0)};
    }
    const Real square = pole * pole;
    const Real both = Real(2) * b / pole + b * b * (Real(1) + square) / (Real(1) - square);
    const Real variance = Real(1) / square + both;
    return {pole, both / variance, b * b / variance};
  }
};

/// The weighted normal equations of the instrumental-variable estimate, R theta = q, that the recursion
/// P = R^-1, theta = P q solves (Young 2011):
///
///   R <- lambda R + z f'        q <- lambda q + z t
///
/// R is not symmetric, so that P has no factors that would keep it well-formed over long runs; R itself needs
/// none: what rounding has done to it is forgotten like all else.
///
/// Solved is (R + lambda^k H0 + H) theta = q + lambda^k H0 start + H frozen with small diagonal H0, H: what
/// is known at the start, forgotten like all else, and a tie of each parameter to its present estimate. That
/// limits the covariance to 1/H per unit residual variance, and without excitation (R -> 0, q -> 0) it keeps
/// the estimate, one direction at a time.
///
/// The errors of the equations need not be white: their autocorrelation is told (ErrorCorrelation), and
///
///   V = sum_i sum_j lambda^i lambda^j r(i - j) z_i z_j'
///
/// is kept beside R, so that R^-1 V R^-T is the covariance of the estimate per unit variance of an error.
template <class Real, std::size_t N>
class InstrumentalSums {
 public:
  using Vector = std::array<Real, N>;
  using Matrix = std::array<Real, N * N>;  ///< Row by row.

  explicit InstrumentalSums(const ErrorCorrelation<Real>& correlation = {}) noexcept
      : correlation_(correlation) {}

  /// Starts from `theta`.
  void reset(const Vector& theta) noexcept {
    r_.fill(Real(0));
    v_.fill(Real(0));
    near_.fill(Real(0));
    far_.fill(Real(0));
    q_.fill(Real(0));
    start_ = frozen_ = theta;
    start_weight_ = Real(1);
    weight_ = squares_ = ages_ = Real(0);
  }

  /// One equation target = regressor' theta + error. Older ones keep `factor` of their weight.
  void add(const Vector& instrument, const Vector& regressor, Real target, Real factor) noexcept {
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = 0; j < N; ++j)
        r_[i * N + j] = factor * r_[i * N + j] + instrument[i] * regressor[j];
    for (std::size_t i = 0; i < N; ++i) q_[i] = factor * q_[i] + instrument[i] * target;
    correlate(instrument, factor);
    ages_ = factor * (ages_ + weight_);
    weight_ = factor * weight_ + Real(1);
    squares_ = factor * factor * squares_ + Real(1);
    start_weight_ *= factor;
  }

  /// Certainty of the start and of the present estimate, per unit residual variance; all > 0.
  struct Prior {
    Vector start, frozen;
  };
  struct Solution {
    Vector theta;
    /// Information about each parameter over what freezes it, those before it taken as known; 1: none but
    /// that.
    Vector gain;
  };
  /// By elimination with row pivots.
  [[nodiscard]] Solution solve(const Prior& prior) const noexcept {
    Matrix m = matrix(prior);
    Vector x;
    for (std::size_t i = 0; i < N; ++i)
      x[i] = q_[i] + start_weight_ * prior.start[i] * start_[i] + prior.frozen[i] * frozen_[i];
    for (std::size_t k = 0; k < N; ++k) {
      std::size_t pivot = k;
      for (std::size_t i = k + 1; i < N; ++i)
        if (std::abs(m[i * N + k]) > std::abs(m[pivot * N + k])) pivot = i;
      for (std::size_t j = k; j < N; ++j) std::swap(m[k * N + j], m[pivot * N + j]);
      std::swap(x[k], x[pivot]);
      for (std::size_t i = k + 1; i < N; ++i) {
        const Real share = m[i * N + k] / m[k * N + k];
        for (std::size_t j = k + 1; j < N; ++j) m[i * N + j] -= share * m[k * N + j];
        x[i] -= share * x[k];
      }
    }
    Solution s;
    for (std::size_t i = N; i-- > 0;) {
      for (std::size_t j = i + 1; j < N; ++j) x[i] -= m[i * N + j] * x[j];
      x[i] /= m[i * N + i];
      s.gain[i] = std::abs(m[i * N + i]) / prior.frozen[i];
    }
    s.theta = x;
    return s;
  }
  /// From now on what is not excited stays here.
  void freeze(const Vector& theta) noexcept { frozen_ = theta; }

  /// Without excitation the sums fade; this keeps them from fading into slow denormal numbers.
  void flush() noexcept {
    for (Real& x : r_) x = std::abs(x) < kNothing ? Real(0) : x;
    for (Vector* sum : {&q_, &near_, &far_})
      for (Real& x : *sum) x = std::abs(x) < kNothing ? Real(0) : x;
    for (Real& x : v_) x = std::abs(x) < kNothing ? Real(0) : x;
  }

  /// R^-1 V R^-T per unit variance of an equation's error, start and tie included: what is frozen varies by
  /// 1/H. Infinite where R is singular.
  [[nodiscard]] Matrix covariance(const Prior& prior) const noexcept {
    const Matrix m = matrix(prior);
    Matrix half;  // V, R^-1 V, then R^-1 (R^-1 V)', which is symmetric
    for (std::size_t i = 0; i < N; ++i) {
      for (std::size_t j = 0; j <= i; ++j) half[i * N + j] = half[j * N + i] = v_[i * N + j];
      half[i * N + i] += start_weight_ * start_weight_ * prior.start[i] + prior.frozen[i];
    }
    for (int side = 0; side < 2; ++side) {
      Matrix left = m;
      eliminate(left, half);
      for (std::size_t i = 0; i < N; ++i)
        for (std::size_t j = 0; j < i; ++j) std::swap(half[i * N + j], half[j * N + i]);
    }
    Matrix result;
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = 0; j < N; ++j) result[i * N + j] = Real(0.5) * (half[i * N + j] + half[j * N + i]);
    return result;
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
  [[nodiscard]] Matrix matrix(const Prior& prior) const noexcept {
    Matrix m = r_;
    for (std::size_t i = 0; i < N; ++i) m[i * N + i] += start_weight_ * prior.start[i] + prior.frozen[i];
    return m;
  }

  /// V <- lambda^2 V + z z' + z c' + c z' with c = sum_{t > 0} lambda^t r(t) z(k - t), kept in two sums.
  void correlate(const Vector& z, Real factor) noexcept {
    const ErrorCorrelation<Real>& r = correlation_;
    Vector with;  // z/2 + c
    for (std::size_t i = 0; i < N; ++i) with[i] = Real(0.5) * z[i] + r.near * near_[i] + r.far * far_[i];
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = 0; j <= i; ++j)
        v_[i * N + j] = factor * factor * v_[i * N + j] + z[i] * with[j] + with[i] * z[j];
    const Real fade = factor * r.pole;
    for (std::size_t i = 0; i < N; ++i) {
      far_[i] = fade * (far_[i] + near_[i] + z[i]);
      near_[i] = fade * (near_[i] + z[i]);
    }
  }
  /// m x = right for all columns of `right`, which becomes x; row pivots.
  static void eliminate(Matrix& m, Matrix& right) noexcept {
    for (std::size_t k = 0; k < N; ++k) {
      std::size_t pivot = k;
      for (std::size_t i = k + 1; i < N; ++i)
        if (std::abs(m[i * N + k]) > std::abs(m[pivot * N + k])) pivot = i;
      for (std::size_t j = 0; j < N; ++j) {
        std::swap(m[k * N + j], m[pivot * N + j]);
        std::swap(right[k * N + j], right[pivot * N + j]);
      }
      for (std::size_t i = k + 1; i < N; ++i) {
        const Real share = m[i * N + k] / m[k * N + k];
        for (std::size_t j = k + 1; j < N; ++j) m[i * N + j] -= share * m[k * N + j];
        for (std::size_t j = 0; j < N; ++j) right[i * N + j] -= share * right[k * N + j];
      }
    }
    for (std::size_t i = N; i-- > 0;)
      for (std::size_t j = 0; j < N; ++j) {
        for (std::size_t k = i + 1; k < N; ++k) right[i * N + j] -= m[i * N + k] * right[k * N + j];
        right[i * N + j] /= m[i * N + i];
      }
  }

  static constexpr Real kNothing = Real(1e-30);

  ErrorCorrelation<Real> correlation_;
  Matrix r_{}, v_{};  // of V, which is symmetric, the lower half
  Vector q_{}, start_{}, frozen_{};
  Vector near_{}, far_{};  // sums of (lambda rho)^t z(k - t), and of t (lambda rho)^t z(k - t)
  Real start_weight_ = Real(1);
  Real weight_ = Real(0), squares_ = Real(0), ages_ = Real(0);
};

}  // namespace resonid::online
