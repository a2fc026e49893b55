// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/lines/detail/bank_config.hpp>
#include <resonid/online/lines/detail/gain_rule.hpp>
#include <resonid/online/lines/detail/impulse_figures.hpp>
#include <resonid/online/lines/detail/line_phase.hpp>
#include <resonid/online/lines/detail/oscillators.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

/// Complex amplitudes of several spectral lines, sample by sample: Kalman short-time DFT with constant gain.
///
///   e(k) = z(k) - H x(k)      x(k+1) = Phi x(k) + K e(k)      K = Phi H^T/(H H^T + lambda) or placed poles
///
/// signal = sum Re phasor(i) + offset. Reported is the filtered phasor, the newest sample included. All lines
/// share one innovation, so that a settled bank separates them exactly, however close they are; lines of the
/// signal that the bank does not hold leak into it. A sample that is not finite counts as missing. Trivially
/// copyable, no heap. Source: Bitmead et al. 1986; Nevaranta 2016, Pub. IV, eqs. 5-16 (mended:
/// docs/errata.md).
template <class Real, std::size_t MaxLines>
class KalmanBank {
 public:
  using Scalar = Real;
  static constexpr std::size_t kMaxLines = MaxLines;
  static constexpr std::size_t kProbes = 1;  ///< See probe().

  static expected<KalmanBank, Error> create(const KalmanBankConfig& config) {
    if (auto fault = check(config, MaxLines)) return unexpected<Error>(*fault);
    KalmanBank bank;
    const std::span<const double> frequency = config.frequency_hz;
    std::array<double, MaxLines> angle{};
    for (std::size_t i = 0; i < frequency.size(); ++i) {
      bank.frequency_hz_[i] = frequency[i];
      bank.phase_[i] = LinePhase(frequency[i] / config.sample_rate_hz);
      angle[i] = kTwoPi * frequency[i] / config.sample_rate_hz;
    }
    const std::span<const double> angles(angle.data(), frequency.size());
    const auto gain = bank_gain<MaxLines>(angles, config);
    Oscillators<double, MaxLines> exact;
    exact.configure(angles, gain);
    bank.figures_ = impulse_figures(exact);
    for (std::size_t i = 0; i < frequency.size(); ++i)
      if (!std::isfinite(bank.figures_[i].noise_gain))
        return refuse("pole_radius", "must be nearer to 1 for lines this close", config.pole_radius);
    bank.oscillators_.configure(angles, gain);
    bank.sample_rate_hz_ = config.sample_rate_hz;
    bank.offset_ = config.offset;
    return bank;
  }

  void step(Scalar z) noexcept {
    skipped_ += static_cast<std::uint64_t>(!oscillators_.step_or_predict({z}));
    ++samples_;
  }
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

  /// Rotating phasor at the newest sample, in the unit of the signal (peak value).
  [[nodiscard]] std::complex<Scalar> phasor(std::size_t line) const noexcept {
    return oscillators_.phasor(line);
  }
  /// The same with its phase referred to sample 0: constant for a constant line.
  [[nodiscard]] std::complex<Scalar> amplitude(std::size_t line) const noexcept {
    if (samples_ == 0) return {};
    const auto a = std::complex<double>(phasor(line)) * phase_[line].back_from(samples_ - 1);
    return {static_cast<Scalar>(a.real()), static_cast<Scalar>(a.imag())};
  }
  [[nodiscard]] Scalar offset() const noexcept { return oscillators_.offset(); }
  /// Newest sample minus what was predicted for it; 0 for a missing one.
  [[nodiscard]] Scalar innovation() const noexcept { return oscillators_.innovation(); }

  /// Whether the start no longer matters for this line (kSettledRemainder).
  [[nodiscard]] bool settled(std::size_t line) const noexcept {
    return settling_samples(line) != kNeverSettles && samples_ >= settling_samples(line);
  }
  [[nodiscard]] bool ready() const noexcept {
    for (std::size_t i = 0; i < lines(); ++i)
      if (!settled(i)) return false;
    return true;
  }
  /// Samples until settled(), or kNeverSettles.
  [[nodiscard]] std::size_t settling_samples(std::size_t line) const noexcept {
    return figures_[line].settling_samples;
  }
  /// Rms of the complex phasor's error per unit standard deviation of white noise in the signal.
  [[nodiscard]] double noise_gain(std::size_t line) const noexcept { return figures_[line].noise_gain; }
  /// How far the phasor lags behind slow changes of the line.
  [[nodiscard]] double lag_samples(std::size_t line) const noexcept { return figures_[line].lag_samples; }

  [[nodiscard]] std::size_t lines() const noexcept { return oscillators_.lines(); }
  [[nodiscard]] double frequency_hz(std::size_t line) const noexcept { return frequency_hz_[line]; }
  [[nodiscard]] double sample_rate_hz() const noexcept { return sample_rate_hz_; }
  [[nodiscard]] bool has_offset() const noexcept { return offset_; }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// Gain of the predictor form for the phasor; K of the printed state is (Re, -Im) of it.
  [[nodiscard]] std::complex<Scalar> gain(std::size_t line) const noexcept { return oscillators_.gain(line); }
  [[nodiscard]] Scalar offset_gain() const noexcept { return oscillators_.offset_gain(); }

  /// For ResponseTracker: turn of a line over the next `count` samples and per sample, time-invariant
  /// trackers that stand for this one, and which of them holds now.
  [[nodiscard]] std::complex<double> turn_over(std::size_t line, std::uint64_t count) const noexcept {
    return phase_[line].forth_to(count);
  }
  [[nodiscard]] std::complex<Scalar> rotation(std::size_t line) const noexcept {
    return oscillators_.rotation(line);
  }
  [[nodiscard]] KalmanBank probe(std::size_t) const noexcept {
    KalmanBank copy = *this;
    copy.reset();
    return copy;
  }
  [[nodiscard]] double probe_position() const noexcept { return 0.0; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return oscillators_.intact() && resonid::intact(offset_); }

 private:
  KalmanBank() = default;

  Oscillators<Scalar, MaxLines> oscillators_;
  std::array<double, MaxLines> frequency_hz_{};  // [line]
  std::array<LinePhase, MaxLines> phase_{};
  std::array<ImpulseFigures, MaxLines> figures_{};
  double sample_rate_hz_ = 0.0;
  bool offset_ = true;
  std::uint64_t samples_ = 0;
  std::uint64_t skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<KalmanBank<double, 8>>);
static_assert(std::is_trivially_copyable_v<KalmanBank<float, 8>>);

}  // namespace resonid::online
