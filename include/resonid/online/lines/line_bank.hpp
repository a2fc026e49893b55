// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/lines/detail/bank_config.hpp>
#include <resonid/online/lines/detail/impulse_figures.hpp>
#include <resonid/online/lines/detail/line_kernels.hpp>
#include <resonid/online/lines/detail/oscillators.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

template <class Real, std::size_t MaxLines, std::size_t Channels>
class LineBankBlock;

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
/// finite is missing for all; no instruction of step() depends on the data. A bank of five lines or more uses
/// the widest vectors of the processor (RESONID_SIMD), to rounding as without; fastest at an address that is
/// a multiple of 64. There are no error bars: ResponseTracker has them. Trivially copyable, no heap. Source:
/// Bitmead et al. 1986; docs/methods/line_bank.md.
template <class Real, std::size_t MaxLines, std::size_t Channels = 2>
class LineBank {
 public:
  using Scalar = Real;
  using Sample = std::array<Real, Channels>;  ///< [channel]
  static constexpr std::size_t kMaxLines = MaxLines;
  static constexpr std::size_t kChannels = Channels;

  static expected<LineBank, Error> create(const LineBankConfig& config) {
    if (const auto fault = check(config.bank, MaxLines)) return unexpected<Error>(*fault);
    if (!(config.known_delay_s >= 0.0) || !std::isfinite(config.known_delay_s))
      return refuse("known_delay_s", "must be >= 0", config.known_delay_s);
    LineBank bank;
    const std::span<const double> frequency = config.bank.frequency_hz;
    std::array<double, MaxLines> angle{};
    for (std::size_t i = 0; i < frequency.size(); ++i) {
      angle[i] = kTwoPi * frequency[i] / config.bank.sample_rate_hz;
      const double turn = kTwoPi * frequency[i] * config.known_delay_s;
      bank.delay_[i] = static_cast<Real>(std::cos(turn));
      bank.delay_[MaxLines + i] = static_cast<Real>(std::sin(turn));
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
    if constexpr (kVectors) static_cast<void>(line_kernels<Real>());  // chosen here, not in the first step
    return bank;
  }

  void step(const Sample& z) noexcept {
    if constexpr (kVectors)
      count(line_kernels<Real>().step[Channels - 1](view(), z.data()));
    else
      count(oscillators_.step_or_predict(z));
  }
  void step(Real u, Real y) noexcept requires(Channels == 2) { step(Sample{u, y}); }
  /// `lost` samples were lost: as so many steps with a sample that is not finite, in a bounded time.
  void miss(std::uint64_t lost) noexcept {
    oscillators_.predict(lost);
    samples_ += lost;
    skipped_ += lost;
  }
  /// step() and responses() at once: quicker than one after the other.
  void step(const Sample& z, std::span<Real> response_re, std::span<Real> response_im) noexcept
      requires(Channels >= 2) {
    if constexpr (kVectors) {
      count(line_kernels<Real>().step_responses[Channels - 1](view(), z.data(), delay_.data(),
                                                              response_re.data(), response_im.data()));
    } else {
      step(z);
      responses(response_re, response_im);
    }
  }
  void reset() noexcept {
    oscillators_.reset();
    samples_ = skipped_ = 0;
  }

  /// Rotating phasor at the newest sample, in the unit of the channel's signal (peak value).
  [[nodiscard]] std::complex<Real> phasor(std::size_t channel, std::size_t line) const noexcept {
    return oscillators_.phasor(line, channel);
  }
  /// Phasor of one channel over that of another, delay removed; 0 while the latter's square is below the
  /// smallest normal number (2e-308, in float 1e-38).
  [[nodiscard]] std::complex<Real> response(std::size_t line, std::size_t over = 0,
                                            std::size_t of = 1) const noexcept {
    const auto u = oscillators_.predicted_phasor(line, over), y = oscillators_.predicted_phasor(line, of);
    const Real power = u.real() * u.real() + u.imag() * u.imag();
    const Real inverse = power >= std::numeric_limits<Real>::min() ? Real(1) / power : Real(0);
    const Real re = (y.real() * u.real() + y.imag() * u.imag()) * inverse;
    const Real im = (y.imag() * u.real() - y.real() * u.imag()) * inverse;
    const Real cos = delay_[line], sin = delay_[MaxLines + line];
    return {re * cos - im * sin, re * sin + im * cos};
  }
  /// response(line) of all lines: response_re and response_im, [line], with room for lines() each.
  void responses(std::span<Real> response_re, std::span<Real> response_im) const noexcept
      requires(Channels >= 2) {
    if constexpr (kVectors) {
      line_kernels<Real>().responses({oscillators_.data(), lines32(), kPadded, MaxLines}, delay_.data(),
                                     response_re.data(), response_im.data());
      return;
    }
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

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return oscillators_.intact(); }

 private:
  friend class LineBankBlock<Real, MaxLines, Channels>;
  static constexpr std::uint32_t kNever = static_cast<std::uint32_t>(-1);
  static constexpr std::size_t kPadded = Oscillators<Real, MaxLines, Channels>::kPadded;
  static constexpr bool kVectors = kHasLineKernels<Real, MaxLines, Channels>;

  LineBank() = default;

  [[nodiscard]] std::uint32_t lines32() const noexcept { return static_cast<std::uint32_t>(lines()); }
  [[nodiscard]] LineView<Real> view() noexcept { return {oscillators_.data(), lines32(), kPadded, MaxLines}; }
  void count(bool finite) noexcept {
    skipped_ += static_cast<std::uint64_t>(!finite);
    ++samples_;
  }

  Oscillators<Real, MaxLines, Channels> oscillators_;
  std::array<Real, 2 * MaxLines> delay_{};  // e^{j w Td}: re, then im [line]
  Real sample_rate_hz_{};
  std::uint32_t settling_ = kNever;
  std::uint64_t samples_ = 0;
  std::uint64_t skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<LineBank<double, 21>>);
static_assert(std::is_trivially_copyable_v<LineBank<float, 21>>);
static_assert(sizeof(LineBank<float, 21>) < 1024);

}  // namespace resonid::online
