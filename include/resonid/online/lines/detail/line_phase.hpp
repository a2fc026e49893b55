// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <complex>
#include <cstdint>
#include <resonid/base/constants.hpp>

namespace resonid::online {

/// Phase of a line at any sample: an angle in units of 2^-64 turns wraps as angles do, so it stays exact over
/// any record length (1e9 samples: 3e-11 turns).
class LinePhase {
 public:
  LinePhase() = default;
  /// `cycles_per_sample` from 0 to 0.5; anything that is no such number (a forged snapshot's) does not turn.
  explicit LinePhase(double cycles_per_sample) noexcept
      : step_(cycles_per_sample > 0.0 && cycles_per_sample < 1.0
                  ? static_cast<std::uint64_t>(cycles_per_sample * 0x1p64)
                  : 0) {}

  /// e^{jwk}: turns a phasor on by k samples.
  [[nodiscard]] std::complex<double> forth_to(std::uint64_t sample) const noexcept {
    return std::conj(back_from(sample));
  }
  /// e^{-jwk}: turns the phasor at sample k back to sample 0.
  [[nodiscard]] std::complex<double> back_from(std::uint64_t sample) const noexcept {
    const double turns = static_cast<double>((step_ * sample) >> 11U) * 0x1p-53;
    return std::polar(1.0, -kTwoPi * turns);
  }

 private:
  std::uint64_t step_ = 0;
};

}  // namespace resonid::online
