// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <resonid/tracking/gain_rule.hpp>
#include <span>

namespace resonid::tracking {

/// Bank of oscillators with one shared innovation, the recursion of METHOD 4.1 in phasors:
///
///   e(k) = z(k) - sum_i Re p_i(k) - offset(k)
///   p_i(k+1) = e^{j w_i} p_i(k) + gain_i e(k)          offset(k+1) = offset(k) + gain_0 e(k)
///
/// The state is kept one sample ahead; phasor() turns it back and so is the filtered value, newest sample
/// included. Structure of arrays in blocks of lanes: one pass, which compilers turn into vector instructions.
template <class Scalar, std::size_t MaxLines>
class Oscillators {
 public:
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

  void step(Scalar z) noexcept { advance(z - predicted_); }
  /// A sample without measurement.
  void predict() noexcept { advance(Scalar(0)); }

  void reset() noexcept {
    re_.fill(Scalar(0));
    im_.fill(Scalar(0));
    offset_ = predicted_ = innovation_ = Scalar(0);
  }

  [[nodiscard]] std::complex<Scalar> phasor(std::size_t i) const noexcept {
    return {cos_[i] * re_[i] + sin_[i] * im_[i], cos_[i] * im_[i] - sin_[i] * re_[i]};
  }
  [[nodiscard]] std::complex<Scalar> rotation(std::size_t i) const noexcept { return {cos_[i], sin_[i]}; }
  [[nodiscard]] std::complex<Scalar> gain(std::size_t i) const noexcept { return {gain_re_[i], gain_im_[i]}; }
  [[nodiscard]] Scalar offset_gain() const noexcept { return offset_gain_; }
  [[nodiscard]] Scalar offset() const noexcept { return offset_; }
  [[nodiscard]] Scalar innovation() const noexcept { return innovation_; }
  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }

 private:
  static constexpr std::size_t kLanes = std::min<std::size_t>(8, std::bit_ceil(MaxLines));
  static constexpr std::size_t kPadded = (MaxLines + kLanes - 1) / kLanes * kLanes;
  using Array = std::array<Scalar, kPadded>;

  void advance(Scalar innovation) noexcept {
    std::array<Scalar, kLanes> sum{};
    for (std::size_t block = 0; block < lines_; block += kLanes) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {  // lines that are not used stay 0
        const std::size_t i = block + lane;
        const Scalar re = cos_[i] * re_[i] - sin_[i] * im_[i] + gain_re_[i] * innovation;
        im_[i] = sin_[i] * re_[i] + cos_[i] * im_[i] + gain_im_[i] * innovation;
        re_[i] = re;
        sum[lane] += re;
      }
    }
    offset_ += offset_gain_ * innovation;
    predicted_ = offset_;
    for (const Scalar s : sum) predicted_ += s;
    innovation_ = innovation;
  }

  Array cos_{}, sin_{}, gain_re_{}, gain_im_{};  // [line]
  Array re_{}, im_{};                            // [line], state for the next sample
  Scalar offset_gain_{}, offset_{}, predicted_{}, innovation_{};
  std::size_t lines_ = 0;
};

}  // namespace resonid::tracking
