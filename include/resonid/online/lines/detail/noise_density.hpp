// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>

namespace resonid::online {

/// Mean that forgets its beginning: while fewer than `memory` values are there, value k of n weighs in
/// proportion to k, so what a start-up transient left fades with 1/n^2; after that the memory is exponential.
template <class Scalar>
class FadingMean {
 public:
  void add(Scalar value, Scalar memory) noexcept {
    count_ = std::min(count_ + Scalar(1), memory);
    mean_ += (value - mean_) * std::min(Scalar(1), Scalar(2) / (count_ + Scalar(1)));
  }
  void reset() noexcept { mean_ = count_ = Scalar(0); }
  [[nodiscard]] bool empty() const noexcept { return count_ == Scalar(0); }
  [[nodiscard]] Scalar value() const noexcept { return mean_; }

 private:
  Scalar mean_{}, count_{};
};

/// Power of a sequence in a narrow band around a line, without what stands on the line itself and hardly
/// changes: in coordinates that turn with the line two equal one-pole low-passes ("wide"), less a slow one of
/// their output ("narrow").
///
///   d1 += (1 - wide)(v - d1)     d2 += (1 - wide)(d1 - d2)     m += (1 - narrow)(d2 - m)     power = |d2 -
///   m|^2
template <class Scalar>
class LinePower {
 public:
  void configure(double wide_decay, double narrow_decay) noexcept {
    wide_ = static_cast<Scalar>(1.0 - wide_decay);
    narrow_ = static_cast<Scalar>(1.0 - narrow_decay);
    reset();
  }
  void reset() noexcept { first_ = second_ = mean_ = {}; }

  /// Samples without a value, over which the line turns: what stands in its coordinates stays.
  void hold(std::complex<Scalar> turn) noexcept {
    follow(first_, {}, Scalar(0), turn);
    follow(second_, {}, Scalar(0), turn);
    follow(mean_, {}, Scalar(0), turn);
  }
  /// Takes the next value, gives the power. `rotation` is the line's e^{jw}.
  Scalar step(std::complex<Scalar> v, std::complex<Scalar> rotation) noexcept {
    follow(first_, v, wide_, rotation);
    follow(second_, first_, wide_, rotation);
    follow(mean_, second_, narrow_, rotation);
    const std::complex<Scalar> rest = second_ - mean_;
    return rest.real() * rest.real() + rest.imag() * rest.imag();
  }

 private:
  static void follow(std::complex<Scalar>& state, std::complex<Scalar> target, Scalar part,
                     std::complex<Scalar> turn) noexcept {
    const Scalar re = turn.real() * state.real() - turn.imag() * state.imag();
    const Scalar im = turn.imag() * state.real() + turn.real() * state.imag();
    state = {re + part * (target.real() - re), im + part * (target.imag() - im)};
  }

  Scalar wide_{}, narrow_{};
  std::complex<Scalar> first_{}, second_{}, mean_{};
};

}  // namespace resonid::online
