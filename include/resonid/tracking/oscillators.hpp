// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/tracking/gain_rule.hpp>
#include <resonid/tracking/line_phase.hpp>
#include <span>

namespace resonid::tracking {

/// Bank of oscillators for one or more signals (channels) over the same lines; each channel has one
/// innovation, shared by its lines. The recursion of METHOD 4.1 in phasors:
///
///   e(k) = z(k) - sum_i Re p_i(k) - offset(k)
///   p_i(k+1) = e^{j w_i} p_i(k) + gain_i e(k)          offset(k+1) = offset(k) + gain_0 e(k)
///
/// The state is kept one sample ahead; phasor() turns it back and so is the filtered value, newest sample
/// included. Structure of arrays in blocks of lanes: one pass over all channels, which wait for their sums
/// together and share rotations and gains.
template <class Scalar, std::size_t MaxLines, std::size_t Channels = 1>
class Oscillators {
 public:
  using Sample = std::array<Scalar, Channels>;

  void configure(std::span<const double> angle_rad, const BankGain<MaxLines>& gain) noexcept {
    lines_ = angle_rad.size();
    for (std::size_t i = 0; i < lines_; ++i) {
      cos_[i] = static_cast<Scalar>(std::cos(angle_rad[i]));
      sin_[i] = static_cast<Scalar>(std::sin(angle_rad[i]));
      gain_re_[i] = static_cast<Scalar>(gain.line[i].real());
      gain_im_[i] = static_cast<Scalar>(gain.line[i].imag());
    }
    offset_gain_ = static_cast<Scalar>(gain.offset);
    reset();
  }

  void step(const Sample& z) noexcept {
    Sample innovation;
    for (std::size_t c = 0; c < Channels; ++c) innovation[c] = z[c] - predicted_[c];
    advance(innovation);
  }
  void step(Scalar z) noexcept requires(Channels == 1) { step(Sample{z}); }
  /// A sample without measurement.
  void predict() noexcept { advance(Sample{}); }
  /// `count` of them, in a time that does not depend on it: all but the last turn the state at once.
  void predict(std::uint64_t count) noexcept {
    constexpr std::uint64_t kStepped = 16;  // so few are stepped, bit for bit
    if (count > kStepped) {
      for (std::size_t i = 0; i < lines_; ++i) {
        const double angle = std::atan2(static_cast<double>(sin_[i]), static_cast<double>(cos_[i]));
        const auto turn = LinePhase(angle / kTwoPi).forth_to(count - 1);
        const auto c = static_cast<Scalar>(turn.real()), s = static_cast<Scalar>(turn.imag());
        for (std::size_t channel = 0; channel < Channels; ++channel) {
          const Scalar re = re_[channel][i], im = im_[channel][i];
          re_[channel][i] = c * re - s * im;
          im_[channel][i] = s * re + c * im;
        }
      }
      count = 1;
    }
    for (; count > 0; --count) predict();
  }

  void reset() noexcept {
    re_ = im_ = {};
    offset_ = predicted_ = innovation_ = {};
  }

  [[nodiscard]] std::complex<Scalar> phasor(std::size_t i, std::size_t channel = 0) const noexcept {
    const Scalar re = re_[channel][i], im = im_[channel][i];
    return {cos_[i] * re + sin_[i] * im, cos_[i] * im - sin_[i] * re};
  }
  /// Phasor of the next sample, as predicted: phasor() turned on.
  [[nodiscard]] std::complex<Scalar> predicted_phasor(std::size_t i, std::size_t channel = 0) const noexcept {
    return {re_[channel][i], im_[channel][i]};
  }
  [[nodiscard]] std::complex<Scalar> rotation(std::size_t i) const noexcept { return {cos_[i], sin_[i]}; }
  [[nodiscard]] std::complex<Scalar> gain(std::size_t i) const noexcept { return {gain_re_[i], gain_im_[i]}; }
  [[nodiscard]] Scalar offset_gain() const noexcept { return offset_gain_; }
  [[nodiscard]] Scalar offset(std::size_t channel = 0) const noexcept { return offset_[channel]; }
  [[nodiscard]] Scalar innovation(std::size_t channel = 0) const noexcept { return innovation_[channel]; }
  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }

 private:
  static constexpr std::size_t kLanes = std::min<std::size_t>(8, std::bit_ceil(MaxLines));
  static constexpr std::size_t kPadded = (MaxLines + kLanes - 1) / kLanes * kLanes;
  using Array = std::array<Scalar, kPadded>;

  void advance(const Sample& innovation) noexcept {
    std::array<std::array<Scalar, kLanes>, Channels> sum{};
    for (std::size_t block = 0; block < lines_; block += kLanes) {
      for (std::size_t c = 0; c < Channels; ++c) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {  // lines that are not used stay 0
          const std::size_t i = block + lane;
          const Scalar re = cos_[i] * re_[c][i] - sin_[i] * im_[c][i] + gain_re_[i] * innovation[c];
          im_[c][i] = sin_[i] * re_[c][i] + cos_[i] * im_[c][i] + gain_im_[i] * innovation[c];
          re_[c][i] = re;
          sum[c][lane] += re;
        }
      }
    }
    for (std::size_t c = 0; c < Channels; ++c) {
      offset_[c] += offset_gain_ * innovation[c];
      predicted_[c] = offset_[c];
      for (const Scalar s : sum[c]) predicted_[c] += s;
    }
    innovation_ = innovation;
  }

  Array cos_{}, sin_{}, gain_re_{}, gain_im_{};  // [line]
  std::array<Array, Channels> re_{}, im_{};      // [channel][line], state for the next sample
  Scalar offset_gain_{};
  Sample offset_{}, predicted_{}, innovation_{};  // [channel]
  std::size_t lines_ = 0;
};

}  // namespace resonid::tracking
