// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

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
  using Matrix = std::array<Real, N * N>;  ///< Row by row.

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
  /// By elimination with row pivots.
  [[nodiscard]] Solution solve(const Prior& prior) const noexcept {
    Matrix m = matrix(prior);
    Vector x;
    for (std::size_t i = 0; i < N; ++i)
      x[i] = q_[i] + start_weight_ * prior.start[i] * start_[i] + prior.hold[i] * held_[i];
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
      s.gain[i] = std::abs(m[i * N + i]) / prior.hold[i];
    }
    s.theta = x;
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
    Matrix factor{}, inverse{};  // L and L^-1 of L L' = (R + R')/2
    for (std::size_t j = 0; j < N; ++j)
      for (std::size_t i = j; i < N; ++i) {
        Real rest = Real(0.5) * (r[i * N + j] + r[j * N + i]);
        for (std::size_t k = 0; k < j; ++k) rest -= factor[i * N + k] * factor[j * N + k];
        if (i == j && !(rest > Real(0))) {
          for (std::size_t d = 0; d < N; ++d) inverse[d * N + d] = std::numeric_limits<Real>::infinity();
          return inverse;
        }
        factor[i * N + j] = i == j ? std::sqrt(rest) : rest / factor[j * N + j];
      }
    for (std::size_t j = 0; j < N; ++j)
      for (std::size_t i = j; i < N; ++i) {
        Real rest = i == j ? Real(1) : Real(0);
        for (std::size_t k = j; k < i; ++k) rest -= factor[i * N + k] * inverse[k * N + j];
        inverse[i * N + j] = rest / factor[i * N + i];
      }
    const Real scale = weight_ > Real(0) ? squares_ / weight_ : Real(1);
    Matrix result;
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        Real sum(0);
        for (std::size_t k = i; k < N; ++k) sum += inverse[k * N + i] * inverse[k * N + j];
        result[i * N + j] = result[j * N + i] = sum * scale;
      }
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
    for (std::size_t i = 0; i < N; ++i) m[i * N + i] += start_weight_ * prior.start[i] + prior.hold[i];
    return m;
  }

  static constexpr Real kNothing = Real(1e-30);

  Matrix r_{};
  Vector q_{}, start_{}, held_{};
  Real start_weight_ = Real(1);
  Real weight_ = Real(0), squares_ = Real(0), ages_ = Real(0);
};

}  // namespace resonid::online
