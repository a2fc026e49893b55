// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <type_traits>

namespace resonid::online {

/// Least squares that takes its rows one by one: the triangle of an orthogonal decomposition, kept
/// square-root free as R = D^{1/2} U with a unit upper triangle U (Gentleman 1974, algorithm AS 75; Miller
/// 1992, AS 274).
///
///   minimise  sum_i w_i (y_i - x_i^T theta)^2
///
/// The condition is that of the rows, not of their squares, and columns may differ in scale. It starts
/// without any prior knowledge. Columns that nothing has excited yet get a coefficient of 0, and so do those
/// beyond the `columns` in use.
template <class Real, std::size_t MaxColumns>
class WeightedRows {
 public:
  using Row = std::array<Real, MaxColumns>;

  explicit WeightedRows(std::size_t columns = MaxColumns) noexcept : columns_(columns) {}
  void reset() noexcept { *this = WeightedRows(columns_); }

  /// Everything so far counts `factor` times as much, 0 < factor <= 1.
  void forget(Real factor) noexcept {
    for (Real& d : d_) d *= factor;
    squares_ *= factor;
    weights_ *= factor;
  }

  /// Takes x^T theta = y with weight w >= 0 (the inverse of the variance). All must be finite.
  void add(Row x, Real y, Real w) noexcept {
    weights_ += Real(1);
    for (std::size_t i = 0; i < columns_; ++i) {
      if (!(w > Real(0))) return;
      const Real xi = x[i];
      if (xi == Real(0)) continue;
      const Real sum = d_[i] + w * xi * xi;
      if (!(sum > Real(0))) continue;  // underflow
      const Real keep = d_[i] / sum, take = w * xi / sum;
      d_[i] = sum;
      w *= keep;
      for (std::size_t k = i + 1; k < columns_; ++k) {
        const Real old = u_[i][k];
        u_[i][k] = keep * old + take * x[k];
        x[k] -= xi * old;
      }
      const Real old = right_[i];
      right_[i] = keep * old + take * y;
      y -= xi * old;
    }
    squares_ += w * y * y;
  }

  [[nodiscard]] Row solution() const noexcept {
    Row theta{};
    for (std::size_t i = columns_; i-- > 0;) {
      if (!(d_[i] > Real(0))) continue;
      theta[i] = right_[i];
      for (std::size_t k = i + 1; k < columns_; ++k) theta[i] -= u_[i][k] * theta[k];
    }
    return theta;
  }

  /// (sum w x x^T)^-1: the covariance when every weight is the inverse of its row's variance. Not finite
  /// while there is a column that nothing has excited.
  [[nodiscard]] Eigen::Matrix<Real, int(MaxColumns), int(MaxColumns)> covariance() const noexcept {
    // U^-1 column by column, then U^-1 D^-1 U^-T.
    std::array<Row, MaxColumns> inverse{};
    for (std::size_t j = 0; j < columns_; ++j) {
      inverse[j][j] = Real(1);
      for (std::size_t i = j; i-- > 0;)
        for (std::size_t k = i + 1; k <= j; ++k) inverse[i][j] -= u_[i][k] * inverse[k][j];
    }
    Eigen::Matrix<Real, int(MaxColumns), int(MaxColumns)> p;
    p.setZero();
    for (std::size_t i = 0; i < columns_; ++i) {
      for (std::size_t j = i; j < columns_; ++j) {
        Real sum(0);
        for (std::size_t k = j; k < columns_; ++k) sum += inverse[i][k] * inverse[j][k] / d_[k];
        p(int(i), int(j)) = p(int(j), int(i)) = sum;
      }
    }
    return p;
  }

  /// Weighted sum of the squared residuals at the solution.
  [[nodiscard]] Real squares() const noexcept { return squares_; }
  /// How many rows count, forgotten ones less.
  [[nodiscard]] Real rows() const noexcept { return weights_; }
  [[nodiscard]] bool determined() const noexcept {
    for (std::size_t i = 0; i < columns_; ++i)
      if (!(d_[i] > Real(0))) return false;
    return true;
  }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return columns_ <= MaxColumns; }

 private:
  Row d_{}, right_{};
  std::array<Row, MaxColumns> u_{};  // strictly upper part of U
  Real squares_{}, weights_{};
  std::size_t columns_;
};

}  // namespace resonid::online
