// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <resonid/base/detail/flushed.hpp>
#include <resonid/online/models/detail/regression.hpp>
#include <resonid/online/models/discrete_model.hpp>

namespace resonid::online {

/// The regressor filtered by 1/A of the newest estimate with its poles drawn in by `contraction`:
///
///   x_F(k) = x(k) - c a_1 x_F(k-1) - c^2 a_2 x_F(k-2) - ...
///
/// With c = 1 it is the gradient of the simulated output. Drawn in, the filter forgets: neither the
/// integrator nor an estimate that moves makes the gradient run away, and its phase is still right enough for
/// the recursion to be locally stable, whatever the sample time (docs/methods/recursive_output_error.md).
template <class Real, std::size_t Order, std::size_t Extra = 0>
class DampedGradient {
 public:
  using Past = Regression<Real, Order, Extra>;

  DampedGradient(std::size_t delay_samples, bool fixed_integrator, double contraction) noexcept
      : past_(delay_samples, fixed_integrator), contraction_(static_cast<Real>(contraction)) {}

  /// Entries of b and a; the extra ones stay as they are.
  void fill(typename Past::Vector& psi) const noexcept { past_.fill(psi); }
  void push(Real input, Real output, const DiscreteModel<Real, Order>& model) noexcept {
    const Real smooth_input = filter(input_, input, model);
    past_.push(smooth_input, filter(output_, output, model));
  }
  void reset() noexcept {
    past_.reset();
    input_ = output_ = Tail{};
  }
  [[nodiscard]] double contraction() const noexcept { return static_cast<double>(contraction_); }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return past_.intact(); }

 private:
  using Tail = std::array<Real, Order>;

  Real filter(Tail& tail, Real x, const DiscreteModel<Real, Order>& model) const noexcept {
    Real power = contraction_;
    for (std::size_t i = 0; i < Order; ++i, power *= contraction_) x -= model.a[i] * power * tail[i];
    for (std::size_t i = Order - 1; i > 0; --i) tail[i] = tail[i - 1];
    tail[0] = flushed_signal(x);
    return tail[0];
  }

  Past past_;
  Tail input_{}, output_{};
  Real contraction_;
};

}  // namespace resonid::online
