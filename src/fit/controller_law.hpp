// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/data/transfer_function.hpp>
#include <vector>

namespace resonid::fit::detail {

/// A linear controller of any order in transposed direct form II. The state is the caller's, as many elements
/// as coefficients: of values, or of their derivatives, which go through the same law.
class ControllerLaw {
 public:
  explicit ControllerLaw(const data::TransferFunction& c)
      : b_(std::max(c.numerator.size(), c.denominator.size()), 0.0), a_(b_) {
    for (std::size_t i = 0; i < c.numerator.size(); ++i) b_[i] = c.numerator[i] / c.denominator[0];
    for (std::size_t i = 0; i < c.denominator.size(); ++i) a_[i] = c.denominator[i] / c.denominator[0];
  }

  [[nodiscard]] std::size_t order() const { return b_.size() - 1; }

  /// Unlike DiscreteFilter's, lets numbers through that are not finite: a loop that runs away must show it.
  template <class Signal>
  Signal step(const Signal& e, std::vector<Signal>& state) const {
    const Signal u = b_[0] * e + state[0];
    advance_filter(b_, a_, order(), e, u, state);
    return u;
  }

 private:
  std::vector<double> b_, a_;
};

}  // namespace resonid::fit::detail
