// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/tracking/bank_config.hpp>
#include <resonid/tracking/impulse_figures.hpp>
#include <resonid/tracking/oscillators.hpp>
#include <span>
#include <type_traits>

namespace resonid::tracking {

struct LineBankConfig {
  KalmanBankConfig bank{};
  double known_delay_s = 0.0;  ///< Delay in the measured output that is taken out of the response, >= 0.
};

/// The Kalman line bank (kalman_bank.hpp) for several signals at once, and the response at every line, in the
/// least time and memory: for servo threads and microcontrollers.
///
///   G_i(k) = Y_i/U_i e^{j w_i Td}
///
/// Channels go through one pass and wait for one another's sums, so that two cost little more than one. The
/// samples' order is that of the channels: u, y, and whatever else (ru). A sample of which any channel is not
/// finite is missing for all. There are no error bars: ResponseTracker has them. Trivially copyable, no heap.
/// Source: METHOD 4.1, 5.1.
template <class Real, std::size_t MaxLines, std::size_t Channels = 2>
class LineBank {
 public:
  using Scalar = Real;
  using Sample = std::array<Real, Channels>;  ///< [channel]
  static constexpr std::size_t kMaxLines = MaxLines;
  static constexpr std::size_t kChannels = Channels;

  static expected<LineBank, ConfigError> create(const LineBankConfig& config) {
    if (const auto fault = check(config.bank, MaxLines)) return unexpected<ConfigError>(*fault);
    if (!(config.known_delay_s >= 0.0) || !std::isfinite(config.known_delay_s))
      return refuse("known_delay_s", "must be >= 0", config.known_delay_s);
    LineBank bank;
    const std::span<const double> frequency = config.bank.frequency_hz;
    std::array<double, MaxLines> angle{};
    for (std::size_t i = 0; i < frequency.size(); ++i) {
      angle[i] = kTwoPi * frequency[i] / config.bank.sample_rate_hz;
      const double turn = kTwoPi * frequency[i] * config.known_delay_s;
      bank.delay_re_[i] = static_cast<Real>(std::cos(turn));
      bank.delay_im_[i] = static_cast<Real>(std::sin(turn));
    }
    const std::span<const double> angles(angle.data(), frequency.size());
    const auto gain = bank_gain<MaxLines>(angles, config.bank);
    for (std::size_t i = 0; i < frequency.size(); ++i)
      if (!std::isfinite(std::norm(gain.line[i])))
        return refuse("pole_radius", "must be nearer to 1 for lines this close", config.bank.pole_radius);
    Oscillators<Real, MaxLines> one;
    one.configure(angles, gain);
    std::size_t settling = 0;
    const auto figures = impulse_figures(one);
    for (std::size_t i = 0; i < frequency.size(); ++i)
      settling = std::max(settling, figures[i].settling_samples);
    bank.settling_ = static_cast<std::uint32_t>(std::min<std::size_t>(settling, kNever));
    bank.oscillators_.configure(angles, gain);
    bank.sample_rate_hz_ = static_cast<Real>(config.bank.sample_rate_hz);
    return bank;
  }

  void step(const Sample& z) noexcept {
    bool finite = true;
    for (const Real x : z) finite = finite && std::isfinite(x);
    if (finite) {
      oscillators_.step(z);
    } else {
      oscillators_.predict();
      ++skipped_;
    }
    ++samples_;
  }
  void step(Real u, Real y) noexcept requires(Channels == 2) { step(Sample{u, y}); }
  /// `count` samples were lost: as so many steps with a sample that is not finite, in a bounded time.
  void miss(std::uint64_t count) noexcept {
    oscillators_.predict(count);
    samples_ += count;
    skipped_ += count;
  }
  void reset() noexcept {
    oscillators_.reset();
    samples_ = skipped_ = 0;
  }

  /// Rotating phasor at the newest sample, in the unit of the channel's signal (peak value).
  [[nodiscard]] std::complex<Real> phasor(std::size_t channel, std::size_t line) const noexcept {
    return oscillators_.phasor(line, channel);
  }
  /// Phasor of one channel over that of another, delay removed; 0 while the latter is 0.
  [[nodiscard]] std::complex<Real> response(std::size_t line, std::size_t over = 0,
                                            std::size_t of = 1) const noexcept {
    const auto u = oscillators_.predicted_phasor(line, over), y = oscillators_.predicted_phasor(line, of);
    const Real power = u.real() * u.real() + u.imag() * u.imag();
    const Real inverse = power > Real(0) ? Real(1) / power : Real(0);
    const Real re = (y.real() * u.real() + y.imag() * u.imag()) * inverse;
    const Real im = (y.imag() * u.real() - y.real() * u.imag()) * inverse;
    return {re * delay_re_[line] - im * delay_im_[line], re * delay_im_[line] + im * delay_re_[line]};
  }
  /// response(line) of all lines: response_re and response_im, [line], with room for lines() each.
  void responses(std::span<Real> response_re, std::span<Real> response_im) const noexcept {
    for (std::size_t i = 0; i < lines(); ++i) {
      const auto g = response(i);
      response_re[i] = g.real();
      response_im[i] = g.imag();
    }
  }
  [[nodiscard]] Real offset(std::size_t channel) const noexcept { return oscillators_.offset(channel); }
  /// Newest sample minus what was predicted for it; 0 for a missing one.
  [[nodiscard]] Real innovation(std::size_t channel) const noexcept {
    return oscillators_.innovation(channel);
  }

  /// Whether the start no longer matters for any line (kSettledRemainder).
  [[nodiscard]] bool ready() const noexcept { return settling_ != kNever && samples_ >= settling_; }
  /// Samples until ready(), or kNeverSettles.
  [[nodiscard]] std::size_t settling_samples() const noexcept {
    return settling_ == kNever ? kNeverSettles : settling_;
  }
  [[nodiscard]] std::size_t lines() const noexcept { return oscillators_.lines(); }
  [[nodiscard]] double frequency_hz(std::size_t line) const noexcept {
    const auto turn = std::complex<double>(oscillators_.rotation(line));
    return std::arg(turn) / kTwoPi * static_cast<double>(sample_rate_hz_);
  }
  [[nodiscard]] double sample_rate_hz() const noexcept { return static_cast<double>(sample_rate_hz_); }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

 private:
  static constexpr std::uint32_t kNever = static_cast<std::uint32_t>(-1);

  LineBank() = default;

  Oscillators<Real, MaxLines, Channels> oscillators_;
  std::array<Real, MaxLines> delay_re_{}, delay_im_{};  // e^{j w Td}
  Real sample_rate_hz_{};
  std::uint32_t settling_ = kNever;
  std::uint64_t samples_ = 0;
  std::uint64_t skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<LineBank<double, 21>>);
static_assert(std::is_trivially_copyable_v<LineBank<float, 21>>);
static_assert(sizeof(LineBank<float, 21>) <= 1024);

}  // namespace resonid::tracking
