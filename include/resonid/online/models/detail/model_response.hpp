// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/online/models/discrete_model.hpp>

namespace resonid::online {

/// Response of a model, its known delay left out: G = B(e^{jw})/A(e^{jw}), w = 2 pi f/fs.
template <class Real, std::size_t Order>
[[nodiscard]] std::complex<double> response(const DiscreteModel<Real, Order>& model, double frequency_hz,
                                            double sample_rate_hz) noexcept {
  const auto back = std::polar(1.0, -kTwoPi * frequency_hz / sample_rate_hz);
  std::complex<double> b = 0.0, a = 1.0, power = 1.0;
  for (std::size_t i = 0; i < Order; ++i) {
    power *= back;
    b += static_cast<double>(model.b[i]) * power;
    a += static_cast<double>(model.a[i]) * power;
  }
  return b / a;
}

/// Whether all poles lie within |z| < radius. An integrator that is estimated may lie a little outside of 1.
template <class Real, std::size_t Order>
[[nodiscard]] bool poles_within(const DiscreteModel<Real, Order>& model, Real radius) noexcept {
  return roots_within(model.a, radius);
}

/// The model with every pole outside of |z| = radius drawn radially onto it; the numerator stays.
template <class Real, std::size_t Order>
[[nodiscard]] DiscreteModel<Real, Order> stabilized(DiscreteModel<Real, Order> model,
                                                    double radius) noexcept {
  if (poles_within(model, static_cast<Real>(radius))) return model;
  Monic<Order> a;
  for (std::size_t i = 0; i < Order; ++i) a[i] = static_cast<double>(model.a[i]);
  Roots<Order> pole = roots<Order>(a);
  for (auto& z : pole)
    if (std::abs(z) > radius) z *= radius / std::abs(z);
  a = from_roots<Order>(pole);
  for (std::size_t i = 0; i < Order; ++i) model.a[i] = static_cast<Real>(a[i]);
  return model;
}

}  // namespace resonid::online
