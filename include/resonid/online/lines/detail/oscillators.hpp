// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/detail/gain_rule.hpp>
#include <resonid/online/lines/detail/line_phase.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

/// Bank of oscillators for one or more signals (channels) over the same lines; each channel has one
/// innovation, shared by its lines. The recursion of Nevaranta 2016, eqs. 3.20-3.22, in phasors:
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
#if defined(__arm__) && !defined(__ARM_NEON)
  static constexpr std::size_t kLanes = 1;  // without vectors lanes only cost: sums go to memory
#else
  static constexpr std::size_t kLanes = std::min<std::size_t>(8, std::bit_ceil(MaxLines));
#endif
  static constexpr std::size_t kPadded =
      (MaxLines + kLanes - 1) / kLanes * kLanes;  ///< Whole blocks of lanes.

  void configure(std::span<const double> angle_rad, const BankGain<MaxLines>& gain) noexcept {
    lines_ = static_cast<std::uint32_t>(angle_rad.size());
    data_[kOffsetGain] = data_[kGainSum] = static_cast<Scalar>(gain.offset);
    for (std::size_t i = 0; i < lines_; ++i) {
      data_[kCos + i] = static_cast<Scalar>(std::cos(angle_rad[i]));
      data_[kSin + i] = static_cast<Scalar>(std::sin(angle_rad[i]));
      data_[kGainRe + i] = static_cast<Scalar>(gain.line[i].real());
      data_[kGainIm + i] = static_cast<Scalar>(gain.line[i].imag());
      data_[kGainSum] += data_[kGainRe + i];
    }
    reset();
  }

  void step(const Sample& z) noexcept {
    Sample innovation;
    for (std::size_t c = 0; c < Channels; ++c) innovation[c] = z[c] - data_[kPredicted + c];
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
        const double angle =
            std::atan2(static_cast<double>(data_[kSin + i]), static_cast<double>(data_[kCos + i]));
        const auto turn = LinePhase(angle / kTwoPi).forth_to(count - 1);
        const auto c = static_cast<Scalar>(turn.real()), s = static_cast<Scalar>(turn.imag());
        for (std::size_t channel = 0; channel < Channels; ++channel) {
          const Scalar re = data_[re_of(channel) + i], im = data_[im_of(channel) + i];
          data_[re_of(channel) + i] = c * re - s * im;
          data_[im_of(channel) + i] = s * re + c * im;
        }
      }
      count = 1;
    }
    for (; count > 0; --count) predict();
  }
  /// step() if all channels are finite, else predict(), with the same instructions; tells which.
  bool step_or_predict(const Sample& z) noexcept {
    Bits present = finite_mask(z[0]);
    for (std::size_t c = 1; c < Channels; ++c) present &= finite_mask(z[c]);
    Sample innovation;
    for (std::size_t c = 0; c < Channels; ++c)
      innovation[c] = std::bit_cast<Scalar>(std::bit_cast<Bits>(z[c] - data_[kPredicted + c]) & present);
    advance(innovation);
    return (present & 1U) != 0;
  }

  void reset() noexcept { std::fill(data_.begin() + kState, data_.begin() + kOffsetGain, Scalar(0)); }

  [[nodiscard]] std::complex<Scalar> phasor(std::size_t i, std::size_t channel = 0) const noexcept {
    const Scalar re = data_[re_of(channel) + i], im = data_[im_of(channel) + i];
    const Scalar cos = data_[kCos + i], sin = data_[kSin + i];
    return {cos * re + sin * im, cos * im - sin * re};
  }
  /// Phasor of the next sample, as predicted: phasor() turned on.
  [[nodiscard]] std::complex<Scalar> predicted_phasor(std::size_t i, std::size_t channel = 0) const noexcept {
    return {data_[re_of(channel) + i], data_[im_of(channel) + i]};
  }
  [[nodiscard]] std::complex<Scalar> rotation(std::size_t i) const noexcept {
    return {data_[kCos + i], data_[kSin + i]};
  }
  [[nodiscard]] std::complex<Scalar> gain(std::size_t i) const noexcept {
    return {data_[kGainRe + i], data_[kGainIm + i]};
  }
  [[nodiscard]] Scalar offset_gain() const noexcept { return data_[kOffsetGain]; }
  [[nodiscard]] Scalar offset(std::size_t channel = 0) const noexcept { return data_[kOffset + channel]; }
  [[nodiscard]] Scalar innovation(std::size_t channel = 0) const noexcept {
    return data_[kInnovation + channel];
  }
  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }

  /// Everything but the number of lines, for the kernels of line_kernels.hpp: cos, sin, gain re and im
  /// [line], then re and im [line] of every channel, one sample ahead, then offset, prediction and innovation
  /// [channel], the offset's gain, and the sum of it and all gains' real parts. Lanes that are not used stay
  /// 0.
  [[nodiscard]] Scalar* data() noexcept { return data_.data(); }
  [[nodiscard]] const Scalar* data() const noexcept { return data_.data(); }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return lines_ >= 1 && lines_ <= MaxLines; }

 private:
  using Bits = std::conditional_t<sizeof(Scalar) == 4, std::uint32_t, std::uint64_t>;
  static constexpr std::size_t kCos = 0, kSin = kPadded, kGainRe = 2 * kPadded, kGainIm = 3 * kPadded;
  static constexpr std::size_t kState = 4 * kPadded, kOffset = kState + 2 * Channels * kPadded;
  static constexpr std::size_t kPredicted = kOffset + Channels, kInnovation = kPredicted + Channels;
  static constexpr std::size_t kOffsetGain = kInnovation + Channels, kGainSum = kOffsetGain + 1;

  static constexpr std::size_t re_of(std::size_t channel) { return kState + 2 * channel * kPadded; }
  static constexpr std::size_t im_of(std::size_t channel) { return re_of(channel) + kPadded; }

  /// All ones for a finite number, else 0; in integers, so that no data becomes a branch.
  static constexpr Bits finite_mask(Scalar x) noexcept {
    constexpr Bits kExponent = std::bit_cast<Bits>(std::numeric_limits<Scalar>::infinity());
    return Bits(0) - static_cast<Bits>((std::bit_cast<Bits>(x) & kExponent) != kExponent);
  }

  void advance(const Sample& innovation) noexcept {
    std::array<std::array<Scalar, kLanes>, Channels> sum{};
    for (std::size_t block = 0; block < lines_; block += kLanes) {
#if defined(__arm__) && !defined(__ARM_NEON)
#pragma GCC unroll 2  // at any level of optimisation, so that the sums stay in registers
#endif
      for (std::size_t c = 0; c < Channels; ++c) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
          const std::size_t i = block + lane;
          Scalar &re = data_[re_of(c) + i], &im = data_[im_of(c) + i];
          const Scalar next =
              data_[kCos + i] * re - data_[kSin + i] * im + data_[kGainRe + i] * innovation[c];
          im = data_[kSin + i] * re + data_[kCos + i] * im + data_[kGainIm + i] * innovation[c];
          re = next;
          sum[c][lane] += next;
        }
      }
    }
    for (std::size_t c = 0; c < Channels; ++c) {
      Scalar& offset = data_[kOffset + c];
      offset += data_[kOffsetGain] * innovation[c];
      Scalar predicted = offset;
      for (const Scalar s : sum[c]) predicted += s;
      data_[kPredicted + c] = predicted;
      data_[kInnovation + c] = innovation[c];
    }
  }

  std::array<Scalar, kGainSum + 1> data_{};
  std::uint32_t lines_ = 0;
};

}  // namespace resonid::online
