// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/detail/gain_rule.hpp>
#include <resonid/online/lines/detail/line_phase.hpp>
#include <span>

namespace resonid::online {

/// Covariance of a bank of lines and its Riccati recursion, in the order Re p_0, Im p_0, Re p_1 ... offset.
/// What H and Phi are (a 1 per line; turns of 2 x 2) is used throughout: a step takes no matrix product.
/// Symmetric by construction: one triangle is computed and copied.
template <class Scalar, std::size_t MaxLines>
class LineCovariance {
 public:
  static constexpr std::size_t kMaxStates = 2 * MaxLines + 1;
  using Complex = std::complex<Scalar>;

  LineCovariance() = default;
  LineCovariance(std::span<const double> angle_rad, bool offset, double noise_variance,
                 double start_variance) noexcept
      : noise_(static_cast<Scalar>(noise_variance)),
        lines_(angle_rad.size()),
        states_(2 * angle_rad.size() + (offset ? 1 : 0)) {
    for (std::size_t i = 0; i < lines_; ++i) {
      cos_[i] = static_cast<Scalar>(std::cos(angle_rad[i]));
      sin_[i] = static_cast<Scalar>(std::sin(angle_rad[i]));
    }
    for (std::size_t i = 0; i < states_; ++i) p_[i][i] = static_cast<Scalar>(0.5 * start_variance);
  }
  /// In another precision.
  template <class Other>
  explicit LineCovariance(const LineCovariance<Other, MaxLines>& other) noexcept
      : noise_(static_cast<Scalar>(other.noise_)), lines_(other.lines_), states_(other.states_) {
    const auto copy = [](auto& to, const auto& from) {
      std::transform(from.begin(), from.end(), to.begin(), [](Other x) { return static_cast<Scalar>(x); });
    };
    for (std::size_t i = 0; i < kMaxStates; ++i) copy(p_[i], other.p_[i]);
    copy(gain_, other.gain_);
    copy(drift_, other.drift_);
    copy(cos_, other.cos_);
    copy(sin_, other.sin_);
  }

  /// E|change|^2 of the phasor per sample.
  void set_drift(std::size_t line, double variance) noexcept {
    drift_[2 * line] = drift_[2 * line + 1] = static_cast<Scalar>(0.5 * variance);
  }
  void set_offset_drift(double variance) noexcept {
    if (states_ > 2 * lines_) drift_[2 * lines_] = static_cast<Scalar>(variance);
  }

  /// P <- Phi P Phi' + Q
  void predict() noexcept { predict(cos_, sin_, Scalar(1)); }
  /// `count` of them at once: Q is the same for Re and Im of a line, so turning leaves it as it is.
  void predict(std::uint64_t count) noexcept {
    std::array<Scalar, MaxLines> c{}, s{};
    for (std::size_t l = 0; l < lines_; ++l) {
      const double angle = std::atan2(static_cast<double>(sin_[l]), static_cast<double>(cos_[l]));
      const auto turned = LinePhase(angle / kTwoPi).forth_to(count);
      c[l] = static_cast<Scalar>(turned.real());
      s[l] = static_cast<Scalar>(turned.imag());
    }
    predict(c, s, static_cast<Scalar>(count));
  }

  /// One sample: the gain, and P <- P - P H' H P/s.
  void correct() noexcept {
    std::array<Scalar, kMaxStates> ph{};  // P H'
    for (std::size_t i = 0; i < states_; ++i) {
      for (std::size_t l = 0; l < lines_; ++l) ph[i] += p_[i][2 * l];
      if (states_ > 2 * lines_) ph[i] += p_[i][2 * lines_];
    }
    Scalar s = noise_;
    for (std::size_t l = 0; l < lines_; ++l) s += ph[2 * l];
    if (states_ > 2 * lines_) s += ph[2 * lines_];
    for (std::size_t i = 0; i < states_; ++i) {
      gain_[i] = ph[i] / s;
      for (std::size_t k = i; k < states_; ++k) {
        p_[i][k] -= gain_[i] * ph[k];
        p_[k][i] = p_[i][k];
      }
    }
  }

  /// Goes on to the steady state; false when it is not reached within a bounded number of steps. A small
  /// change per step is not enough for slow lines, so as many steps again follow as that took.
  bool settle() noexcept {
    constexpr std::size_t kMost = 500000;
    constexpr Scalar kSame = static_cast<Scalar>(1e-12);
    std::size_t taken = 0;
    for (Scalar change(1), size(0); change > kSame * kSame * size; ++taken) {
      if (taken == kMost) return false;
      const auto before = gain_;
      predict();
      correct();
      change = size = Scalar(0);
      for (std::size_t i = 0; i < states_; ++i) {
        change += (gain_[i] - before[i]) * (gain_[i] - before[i]);
        size += gain_[i] * gain_[i];
      }
    }
    for (; taken > 0; --taken) {
      predict();
      correct();
    }
    return true;
  }

  /// Gain of the filter form.
  [[nodiscard]] Complex gain(std::size_t line) const noexcept {
    return {gain_[2 * line], gain_[2 * line + 1]};
  }
  [[nodiscard]] Scalar offset_gain() const noexcept {
    return states_ > 2 * lines_ ? gain_[2 * lines_] : Scalar(0);
  }
  [[nodiscard]] BankGain<MaxLines> predictor_gain() const noexcept {
    BankGain<MaxLines> gains;
    for (std::size_t l = 0; l < lines_; ++l)
      gains.line[l] = std::complex<double>(gain(l)) * std::complex<double>(cos_[l], sin_[l]);
    gains.offset = static_cast<double>(offset_gain());
    return gains;
  }
  [[nodiscard]] Eigen::Matrix<Scalar, 2, 2> block(std::size_t line) const noexcept {
    const std::size_t i = 2 * line;
    Eigen::Matrix<Scalar, 2, 2> b;
    b << p_[i][i], p_[i][i + 1], p_[i + 1][i], p_[i + 1][i + 1];
    return b;
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return lines_ <= MaxLines && states_ <= kMaxStates; }

 private:
  template <class, std::size_t>
  friend class LineCovariance;

  /// Over so many samples that the lines turn by (c, s).
  void predict(const std::array<Scalar, MaxLines>& c, const std::array<Scalar, MaxLines>& s,
               Scalar samples) noexcept {
    const auto turn = [&](Scalar& re, Scalar& im, std::size_t l) {
      const Scalar x = c[l] * re - s[l] * im;
      im = s[l] * re + c[l] * im;
      re = x;
    };
    for (std::size_t l = 0; l < lines_; ++l) {
      auto& re = p_[2 * l];
      auto& im = p_[2 * l + 1];
      for (std::size_t k = 0; k < states_; ++k) turn(re[k], im[k], l);
    }
    for (std::size_t k = 0; k < states_; ++k)
      for (std::size_t l = 0; l < lines_; ++l) turn(p_[k][2 * l], p_[k][2 * l + 1], l);
    for (std::size_t i = 0; i < states_; ++i) {
      p_[i][i] += samples * drift_[i];
      for (std::size_t k = 0; k < i; ++k) p_[i][k] = p_[k][i];
    }
  }

  std::array<std::array<Scalar, kMaxStates>, kMaxStates> p_{};
  std::array<Scalar, kMaxStates> gain_{}, drift_{};
  std::array<Scalar, MaxLines> cos_{}, sin_{};
  Scalar noise_{};
  std::size_t lines_ = 0, states_ = 0;
};

}  // namespace resonid::online
