// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <complex>
#include <span>
#include <vector>

// Polynomials in z^-1, lowest power first.
namespace resonid::design {

[[nodiscard]] inline std::vector<double> polynomial_product(std::span<const double> p,
                                                            std::span<const double> q) {
  std::vector<double> product(p.size() + q.size() - 1, 0.0);
  for (std::size_t i = 0; i < p.size(); ++i)
    for (std::size_t j = 0; j < q.size(); ++j) product[i + j] += p[i] * q[j];
  return product;
}

[[nodiscard]] inline std::complex<double> polynomial_at(std::span<const double> p,
                                                        const std::complex<double>& inverse_z) {
  std::complex<double> sum = 0.0;
  for (std::size_t i = p.size(); i-- > 0;) sum = sum * inverse_z + p[i];
  return sum;
}

/// Whether its value at z = 1 is none beside its terms, to that part of them.
[[nodiscard]] inline bool is_zero_at_standstill(std::span<const double> p, double part) {
  double sum = 0.0, sizes = 0.0;
  for (const double term : p) {
    sum += term;
    sizes += std::abs(term);
  }
  return !(std::abs(sum) > part * sizes);
}

}  // namespace resonid::design
