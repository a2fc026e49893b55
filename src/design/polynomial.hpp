// SPDX-License-Identifier: MIT
#pragma once

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

}  // namespace resonid::design
