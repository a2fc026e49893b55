// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/expected.hpp>
#include <span>

namespace resonid {

/// Ends a sample of a filter in transposed direct form II, given its input and the output that took effect.
/// Coefficients over a_0; as many states as coefficients, of which that at `order` stays 0.
template <class Coefficients, class States, class Signal>
void advance_filter(const Coefficients& b, const Coefficients& a, std::size_t order, const Signal& input,
                    const Signal& output, States& state) noexcept {
  for (std::size_t i = 0; i < order; ++i) state[i] = b[i + 1] * input - a[i + 1] * output + state[i + 1];
}

/// Discrete transfer function run sample by sample; also what a linear controller is.
///
///   y(k) = sum_{i=0} b_i u(k-i) - sum_{i=1} a_i y(k-i),   numerator b, denominator a in powers of z^-1, a_0
///   = 1
///
/// Transposed direct form II. A trivially copyable value without heap. In step() an input that is not finite
/// is taken for 0, and counted.
template <class Scalar, std::size_t MaxOrder>
class DiscreteFilter {
 public:
  /// Coefficients in powers of z^-1; the denominator's first one must not be 0 (it is divided out). At most
  /// MaxOrder + 1 coefficients each.
  static expected<DiscreteFilter, Error> create(std::span<const double> numerator,
                                                std::span<const double> denominator) {
    if (numerator.empty() || numerator.size() > MaxOrder + 1)
      return refuse("numerator", "needs 1 ... MaxOrder + 1 coefficients",
                    static_cast<double>(numerator.size()));
    if (denominator.empty() || denominator.size() > MaxOrder + 1)
      return refuse("denominator", "needs 1 ... MaxOrder + 1 coefficients",
                    static_cast<double>(denominator.size()));
    if (denominator[0] == 0.0) return refuse("denominator", "must not begin with 0", denominator[0]);
    DiscreteFilter filter;
    for (std::size_t i = 0; i < numerator.size(); ++i)
      filter.b_[i] = static_cast<Scalar>(numerator[i] / denominator[0]);
    for (std::size_t i = 0; i < denominator.size(); ++i)
      filter.a_[i] = static_cast<Scalar>(denominator[i] / denominator[0]);
    filter.order_ = std::max(numerator.size(), denominator.size()) - 1;
    return filter;
  }

  Scalar step(Scalar input) noexcept {
    if (!std::isfinite(input)) {
      input = Scalar(0);
      ++skipped_;
    }
    const Scalar y = output(input);
    commit(input, y);
    return y;
  }

  /// The two halves of step(), for an output that does not always take effect, such as one that an actuator
  /// limits. output() gives y(k) and remembers nothing; commit() ends the sample with the y(k) that was
  /// realised, which is what the recursion goes on from. Committing output() itself is step(), bit for bit.
  /// All must be finite.
  [[nodiscard]] Scalar output(Scalar input) const noexcept { return b_[0] * input + state_[0]; }
  void commit(Scalar input, Scalar realised) noexcept {
    advance_filter(b_, a_, order_, input, realised, state_);
  }
  void reset() noexcept {
    state_.fill(Scalar(0));
    skipped_ = 0;
  }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// Puts the filter in the steady state in which a constant `input` gives `output`; for an integrating
  /// filter `input` must be 0 for that to be a rest.
  void settle(Scalar input, Scalar output) noexcept {
    for (std::size_t i = order_; i-- > 0;) state_[i] = b_[i + 1] * input - a_[i + 1] * output + state_[i + 1];
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return order_ <= MaxOrder; }

 private:
  std::array<Scalar, MaxOrder + 1> b_{};
  std::array<Scalar, MaxOrder + 1> a_{};
  std::array<Scalar, MaxOrder + 1> state_{};  // from order_ on they stay 0
  std::size_t order_ = 0;
  std::uint64_t skipped_ = 0;
};

}  // namespace resonid
