// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/metrics.hpp>
#include <span>

namespace resonid::online {

struct PrbsConfig {
  double sample_rate_hz = 0.0;      ///< Rate at which step() is called, > 0.
  double amplitude = 1.0;           ///< The signal is +-amplitude, > 0.
  std::size_t register_length = 7;  ///< n cells, 2 ... 24.
  std::size_t clock_divider = 1;    ///< Samples for which a bit is held, >= 1.
  std::uint32_t start_state =
      1;  ///< Cells at the start, bit i for cell i + 1; 1 ... 2^n - 1. Shifts the sequence.
};

/// Pseudo-random binary sequence of maximum length 2^n - 1 from a shift register with XOR feedback.
///
///   bit(k) = bit(k - n) xor bit(k - t1) xor ...,   taps n, t1, ... of a primitive polynomial;   + for 1, -
///   for 0
///
/// By default the register starts with a 1 in its first cell, so the sequence begins with n - 1 minus signs.
/// Over a period there is one plus more than minus: the sum is +amplitude, not 0. The spectrum is flat up to
/// about 0.3 of the bit rate; half the power is left at 0.443 of it. Source: Pintelon and Schoukens 2012,
/// ch. 5; taps: Xilinx XAPP 052; period and balance are tested for every n.
class Prbs {
 public:
  static constexpr std::size_t kMinRegister = 2;
  static constexpr std::size_t kMaxRegister = 24;

  static expected<Prbs, Error> create(const PrbsConfig& config);

  double step() noexcept;
  void reset() noexcept;
  void fill(std::span<double> out) noexcept {
    for (double& x : out) x = step();
  }

  /// clock_divider * (2^n - 1).
  [[nodiscard]] std::size_t period_samples() const noexcept {
    return config_.clock_divider * ((std::size_t{1} << config_.register_length) - 1);
  }
  /// From the line spacing to the frequency with half the power.
  [[nodiscard]] Band band() const noexcept;
  [[nodiscard]] const PrbsConfig& config() const noexcept { return config_; }

  /// The tapped cells for n cells, bit i standing for cell i + 1; 0 outside 2 ... 24.
  [[nodiscard]] static std::uint32_t taps(std::size_t register_length) noexcept;

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return config_.register_length >= kMinRegister && config_.register_length <= kMaxRegister &&
           config_.clock_divider > 0;
  }

 private:
  explicit Prbs(const PrbsConfig& config) noexcept : config_(config) { reset(); }

  PrbsConfig config_;
  std::uint32_t cells_ = 1;  // bit i is cell i + 1; the output is the last cell
  std::size_t bit_samples_ = 0;
};

}  // namespace resonid::online
