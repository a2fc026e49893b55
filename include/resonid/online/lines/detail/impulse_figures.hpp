// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <resonid/online/lines/detail/gain_rule.hpp>
#include <resonid/online/lines/detail/oscillators.hpp>

namespace resonid::online {

/// What a tracker's impulse response h(k) of the phasor says about it.
struct ImpulseFigures {
  double noise_gain = 0.0;   ///< sqrt(sum |h|^2): rms phasor error per standard deviation of white noise.
  double lag_samples = 0.0;  ///< Delay of the phasor behind slow changes of the line.
  std::size_t settling_samples = kNeverSettles;  ///< See kSettledRemainder.
};

/// Runs the impulse response of a bank until nothing of it is left, twice: the first time for sums, the
/// second for the sample from which on the rest, sum |h|, stays below kSettledRemainder. No heap; the search
/// is bounded and what has not decayed by then "never settles" (its noise gain is then a lower bound).
template <class Scalar, std::size_t MaxLines>
std::array<ImpulseFigures, MaxLines> impulse_figures(Oscillators<Scalar, MaxLines> bank) noexcept {
  constexpr auto kGone = static_cast<Scalar>(1e-9);  // of the largest value so far
  const std::size_t lines = bank.lines();
  const std::size_t bound = std::clamp<std::size_t>((std::size_t{1} << 25U) / std::max<std::size_t>(lines, 1),
                                                    std::size_t{1} << 16U, std::size_t{1} << 20U);
  std::array<ImpulseFigures, MaxLines> figures{};
  std::array<Scalar, MaxLines> total{};
  std::array<std::complex<Scalar>, MaxLines> turn{};  // e^{-jwk}
  turn.fill(Scalar(1));
  Scalar largest(0);
  std::size_t length = 0;
  bool decayed = false;
  for (bank.reset(); length < bound && !decayed; ++length) {
    bank.step(Scalar(length == 0 ? 1 : 0));
    Scalar present = std::abs(bank.offset());
    for (std::size_t i = 0; i < lines; ++i) {
      const auto h = bank.phasor(i);
      const Scalar size = std::abs(h);
      figures[i].noise_gain += size * size;
      figures[i].lag_samples += 0.5 * static_cast<double>(length) * static_cast<double>((h * turn[i]).real());
      total[i] += size;
      turn[i] *= std::conj(bank.rotation(i));
      present = std::max(present, size);
    }
    largest = std::max(largest, present);
    decayed = present < kGone * largest;
  }
  for (std::size_t i = 0; i < lines; ++i) figures[i].noise_gain = std::sqrt(figures[i].noise_gain);
  if (!decayed) return figures;
  bank.reset();
  for (std::size_t k = 0; k < length; ++k) {
    bank.step(Scalar(k == 0 ? 1 : 0));
    for (std::size_t i = 0; i < lines; ++i) {
      total[i] -= std::abs(bank.phasor(i));
      if (total[i] < static_cast<Scalar>(kSettledRemainder) && figures[i].settling_samples == kNeverSettles)
        figures[i].settling_samples = k + 1;
    }
  }
  return figures;
}

}  // namespace resonid::online
