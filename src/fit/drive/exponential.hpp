// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <resonid/base/detail/linear_system.hpp>
#include <type_traits>

namespace resonid::fit::detail {

/// matrix_exponential() of numbers with derivatives: the same steps by the product rule, with one plain
/// matrix for each derivative that is not zero throughout A. Most are zero, and plain matrices take a tenth
/// of the time of a matrix of numbers with derivatives.
template <class T, int Order>
Eigen::Matrix<T, Order, Order> exponential(const Eigen::Matrix<T, Order, Order>& a, double norm_bound) {
  if constexpr (std::is_floating_point_v<T>) {
    return matrix_exponential<T, Order>(a, norm_bound);
  } else {
    using Plain = Eigen::Matrix<double, Order, Order>;
    constexpr int kTerms = 14;
    constexpr auto kDerivatives = static_cast<std::size_t>(T::DIMENSION);
    int squarings = 0;
    double scale = 1.0;
    for (; norm_bound * scale > 0.5 && squarings < 60; ++squarings) scale *= 0.5;
    Plain scaled;
    std::array<int, kDerivatives> by{};
    std::array<Plain, kDerivatives> slope, sum_slope;
    std::size_t count = 0;
    for (int p = 0; p < T::DIMENSION; ++p) {
      bool any = false;
      for (Eigen::Index k = 0; k < a.size(); ++k) any = any || a.data()[k].v(p) != 0.0;
      if (any) by[count++] = p;
    }
    for (Eigen::Index k = 0; k < a.size(); ++k) {
      scaled.data()[k] = scale * a.data()[k].a;
      for (std::size_t s = 0; s < count; ++s) slope[s].data()[k] = scale * a.data()[k].v(by[s]);
    }
    Plain sum = Plain::Identity();
    for (std::size_t s = 0; s < count; ++s) sum_slope[s].setZero();
    for (int k = kTerms; k >= 1; --k) {
      for (std::size_t s = 0; s < count; ++s)
        sum_slope[s] = (plain_product(slope[s], sum) + plain_product(scaled, sum_slope[s])) / k;
      sum = Plain::Identity() + plain_product(scaled, sum) / k;
    }
    for (int k = 0; k < squarings; ++k) {
      for (std::size_t s = 0; s < count; ++s)
        sum_slope[s] = plain_product(sum_slope[s], sum) + plain_product(sum, sum_slope[s]);
      sum = plain_product(sum, sum);
    }
    Eigen::Matrix<T, Order, Order> result;
    for (Eigen::Index k = 0; k < a.size(); ++k) {
      T& value = result.data()[k];
      value = T(sum.data()[k]);
      for (std::size_t s = 0; s < count; ++s) value.v(by[s]) = sum_slope[s].data()[k];
    }
    return result;
  }
}

}  // namespace resonid::fit::detail
