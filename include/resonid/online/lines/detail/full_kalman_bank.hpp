// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/lines/detail/gain_rule.hpp>
#include <resonid/online/lines/detail/impulse_figures.hpp>
#include <resonid/online/lines/detail/line_covariance.hpp>
#include <resonid/online/lines/detail/line_phase.hpp>
#include <resonid/online/lines/detail/oscillators.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

enum class RiccatiForm {
  time_varying,  ///< The covariance is carried along: fast at the start, knows of missing samples.
  steady_state,  ///< The gain that it ends at, from the first sample on; as cheap as a KalmanBank.
};

struct FullKalmanBankConfig {
  double sample_rate_hz = 0.0;             ///< Rate at which step() is called, > 0.
  std::span<const double> frequency_hz{};  ///< Lines in (0, sample_rate_hz/2), no two equal.
  bool offset = true;                      ///< One shared state for a constant part of the signal.
  double noise_rms = 1.0;                  ///< White noise of the signal, > 0.
  /// How far a line's phasor wanders, rms over 1 s: E|p(t) - p(0)|^2 = drift^2 t. One value for all lines or
  /// one for each, in the unit of the signal per sqrt(s), > 0.
  std::span<const double> drift{};
  double offset_drift = 0.0;     ///< The same of the offset; 0: as the line that wanders most.
  double start_deviation = 0.0;  ///< Total standard deviation of a phasor at the start; 0: 1000 noise_rms.
  RiccatiForm form = RiccatiForm::time_varying;
};

/// Complex amplitudes of a few spectral lines with the covariance of all of them: Kalman short-time DFT with
/// the gain of the Riccati equation.
///
///   s = H P H' + r         e(k) = z(k) - H x(k)        x+ = x + P H' e/s        P+ = P - P H' H P/s
///   x(k+1) = Phi x+        P(k+1) = Phi P+ Phi' + Q
///
/// One block (Re p, Im p) per line and one offset. Unlike the bank of fixed gain every line may wander at its
/// own rate, the gain follows from noise and drift, and covariance() is the uncertainty of what is reported,
/// if those two are true. Without drift the gain would die out, so it must be > 0. A step costs about
/// (2 lines + 1)^2 * 3 operations (time_varying). A sample that is not finite counts as missing. Trivially
/// copyable, no heap. Source: Nevaranta 2016, Pub. IV, eqs. 9-11, sign of (11) mended (docs/errata.md).
template <class Real, std::size_t MaxLines>
class FullKalmanBank {
 public:
  using Scalar = Real;
  static constexpr std::size_t kMaxLines = MaxLines;
  static constexpr std::size_t kProbes = 1;  ///< See probe().

  static expected<FullKalmanBank, Error> create(const FullKalmanBankConfig& config) {
    if (auto fault = check(config)) return unexpected<Error>(*fault);
    FullKalmanBank bank;
    const std::size_t lines = config.frequency_hz.size();
    std::array<double, MaxLines> angle{};
    for (std::size_t i = 0; i < lines; ++i) {
      bank.frequency_hz_[i] = config.frequency_hz[i];
      bank.phase_[i] = LinePhase(config.frequency_hz[i] / config.sample_rate_hz);
      angle[i] = kTwoPi * config.frequency_hz[i] / config.sample_rate_hz;
      const auto turn = std::polar(1.0, angle[i]);
      bank.rotation_[i] = {static_cast<Scalar>(turn.real()), static_cast<Scalar>(turn.imag())};
    }
    const std::span<const double> angles(angle.data(), lines);
    const auto exact = riccati<double>(config, angles);
    auto last = exact;
    if (!last.settle()) return refuse("drift", "must be larger for the gain to settle", config.drift[0]);
    Oscillators<double, MaxLines> steady;
    steady.configure(angles, last.predictor_gain());
    bank.figures_ = impulse_figures(steady);
    for (std::size_t i = 0; i < lines; ++i)
      if (!std::isfinite(bank.figures_[i].noise_gain))
        return refuse("drift", "must be smaller for lines this close", config.drift[0]);
    bank.form_ = config.form;
    bank.start_ = riccati<Scalar>(config, angles);
    bank.steady_ = LineCovariance<Scalar, MaxLines>(last);
    bank.sample_rate_hz_ = config.sample_rate_hz;
    bank.lines_ = lines;
    bank.offset_ = config.offset;
    bank.reset();
    return bank;
  }

  void step(Scalar z) noexcept {
    // The state of the newest sample is turned to this one; nothing is turned before the first.
    for (std::size_t i = 0; i < lines_; ++i) {
      const std::complex<Scalar> p = phasor_[i], r = rotation_[i];
      phasor_[i] = {p.real() * r.real() - p.imag() * r.imag(), p.real() * r.imag() + p.imag() * r.real()};
    }
    if (form_ == RiccatiForm::time_varying && samples_ > 0) covariance_.predict();
    ++samples_;
    if (!std::isfinite(z)) {
      innovation_ = Scalar(0);
      ++skipped_;
      return;
    }
    Scalar predicted = constant_;
    for (std::size_t i = 0; i < lines_; ++i) predicted += phasor_[i].real();
    innovation_ = z - predicted;
    if (form_ == RiccatiForm::time_varying) covariance_.correct();
    for (std::size_t i = 0; i < lines_; ++i) phasor_[i] += covariance_.gain(i) * innovation_;
    constant_ += covariance_.offset_gain() * innovation_;
  }
  /// `count` samples were lost: as so many steps with a sample that is not finite, in a bounded time.
  void miss(std::uint64_t count) noexcept {
    if (count == 0) return;
    for (std::size_t i = 0; i < lines_; ++i)
      phasor_[i] *= static_cast<std::complex<Scalar>>(phase_[i].forth_to(count));
    if (form_ == RiccatiForm::time_varying) covariance_.predict(samples_ > 0 ? count : count - 1);
    innovation_ = Scalar(0);
    samples_ += count;
    skipped_ += count;
  }
  void reset() noexcept {
    covariance_ = form_ == RiccatiForm::time_varying ? start_ : steady_;
    phasor_.fill({});
    constant_ = innovation_ = Scalar(0);
    samples_ = skipped_ = 0;
  }

  /// Rotating phasor at the newest sample, in the unit of the signal (peak value).
  [[nodiscard]] std::complex<Scalar> phasor(std::size_t line) const noexcept { return phasor_[line]; }
  /// The same with its phase referred to sample 0: constant for a constant line.
  [[nodiscard]] std::complex<Scalar> amplitude(std::size_t line) const noexcept {
    if (samples_ == 0) return {};
    const auto a = std::complex<double>(phasor_[line]) * phase_[line].back_from(samples_ - 1);
    return {static_cast<Scalar>(a.real()), static_cast<Scalar>(a.imag())};
  }
  [[nodiscard]] Scalar offset() const noexcept { return constant_; }
  /// Newest sample minus what was predicted for it; 0 for a missing one.
  [[nodiscard]] Scalar innovation() const noexcept { return innovation_; }

  /// Covariance of (Re, Im) of phasor(line), given noise_rms and drift.
  [[nodiscard]] Eigen::Matrix<Scalar, 2, 2> covariance(std::size_t line) const noexcept {
    return covariance_.block(line);
  }
  /// Total: std^2 = E|error|^2.
  [[nodiscard]] Scalar standard_deviation(std::size_t line) const noexcept {
    const auto p = covariance(line);
    return std::sqrt(p(0, 0) + p(1, 1));
  }

  /// Whether the start no longer matters for this line (kSettledRemainder) with the steady gain; the
  /// time-varying form gets there sooner, which covariance() tells.
  [[nodiscard]] bool settled(std::size_t line) const noexcept {
    return settling_samples(line) != kNeverSettles && samples_ >= settling_samples(line);
  }
  [[nodiscard]] bool ready() const noexcept {
    for (std::size_t i = 0; i < lines_; ++i)
      if (!settled(i)) return false;
    return true;
  }
  /// Samples until settled(), or kNeverSettles.
  [[nodiscard]] std::size_t settling_samples(std::size_t line) const noexcept {
    return figures_[line].settling_samples;
  }
  /// Rms of the complex phasor's error per unit standard deviation of white noise, with the steady gain.
  [[nodiscard]] double noise_gain(std::size_t line) const noexcept { return figures_[line].noise_gain; }
  /// How far the phasor lags behind slow changes of the line, likewise.
  [[nodiscard]] double lag_samples(std::size_t line) const noexcept { return figures_[line].lag_samples; }

  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }
  [[nodiscard]] double frequency_hz(std::size_t line) const noexcept { return frequency_hz_[line]; }
  [[nodiscard]] double sample_rate_hz() const noexcept { return sample_rate_hz_; }
  [[nodiscard]] bool has_offset() const noexcept { return offset_; }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// Gain of the predictor form, as in KalmanBank: turned to the next sample.
  [[nodiscard]] std::complex<Scalar> gain(std::size_t line) const noexcept {
    return covariance_.gain(line) * rotation_[line];
  }
  [[nodiscard]] Scalar offset_gain() const noexcept { return covariance_.offset_gain(); }

  /// For ResponseTracker: see KalmanBank.
  [[nodiscard]] std::complex<double> turn_over(std::size_t line, std::uint64_t count) const noexcept {
    return phase_[line].forth_to(count);
  }
  [[nodiscard]] std::complex<Scalar> rotation(std::size_t line) const noexcept { return rotation_[line]; }
  [[nodiscard]] FullKalmanBank probe(std::size_t) const noexcept {
    FullKalmanBank copy = *this;
    copy.form_ = RiccatiForm::steady_state;
    copy.reset();
    return copy;
  }
  [[nodiscard]] double probe_position() const noexcept { return 0.0; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return covariance_.intact() && start_.intact() && steady_.intact() && lines_ >= 1 && lines_ <= MaxLines &&
           resonid::intact(offset_) && resonid::intact(form_, RiccatiForm::steady_state);
  }

 private:
  FullKalmanBank() = default;

  static std::optional<Error> check(const FullKalmanBankConfig& c) {
    const std::span<const double> f = c.frequency_hz;
    const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
    if (!positive(c.sample_rate_hz)) return Error{"sample_rate_hz", "must be > 0", c.sample_rate_hz};
    if (f.empty()) return Error{"frequency_hz", "needs at least one line", 0.0};
    if (f.size() > MaxLines)
      return Error{"frequency_hz", "has more lines than the bank was built for", double(f.size())};
    for (std::size_t i = 0; i < f.size(); ++i) {
      if (!(f[i] > 0.0 && f[i] < 0.5 * c.sample_rate_hz))
        return Error{"frequency_hz", "must be > 0 and below half the sample rate", f[i]};
      for (std::size_t j = 0; j < i; ++j)
        if (f[i] == f[j]) return Error{"frequency_hz", "must not hold a line twice", f[i]};
    }
    if (!positive(c.noise_rms)) return Error{"noise_rms", "must be > 0", c.noise_rms};
    if (c.drift.size() != 1 && c.drift.size() != f.size())
      return Error{"drift", "needs one value, or one for every line", double(c.drift.size())};
    for (const double d : c.drift)
      if (!positive(d)) return Error{"drift", "must be > 0", d};
    if (!(c.offset_drift == 0.0 || positive(c.offset_drift)))
      return Error{"offset_drift", "must be >= 0", c.offset_drift};
    if (!(c.start_deviation == 0.0 || positive(c.start_deviation)))
      return Error{"start_deviation", "must be >= 0", c.start_deviation};
    return std::nullopt;
  }

  template <class T>
  static LineCovariance<T, MaxLines> riccati(const FullKalmanBankConfig& c,
                                             std::span<const double> angle_rad) noexcept {
    const double start = c.start_deviation > 0.0 ? c.start_deviation : 1000.0 * c.noise_rms;
    LineCovariance<T, MaxLines> covariance(angle_rad, c.offset, c.noise_rms * c.noise_rms, start * start);
    double most = 0.0;
    for (std::size_t i = 0; i < angle_rad.size(); ++i) {
      const double drift = c.drift[c.drift.size() == 1 ? 0 : i];
      most = std::max(most, drift);
      covariance.set_drift(i, drift * drift / c.sample_rate_hz);
    }
    if (c.offset_drift > 0.0) most = c.offset_drift;
    covariance.set_offset_drift(most * most / c.sample_rate_hz);
    return covariance;
  }

  LineCovariance<Scalar, MaxLines> covariance_, start_, steady_;
  std::array<std::complex<Scalar>, MaxLines> phasor_{}, rotation_{};  // [line]
  std::array<double, MaxLines> frequency_hz_{};                       // [line]
  std::array<LinePhase, MaxLines> phase_{};
  std::array<ImpulseFigures, MaxLines> figures_{};
  Scalar constant_{}, innovation_{};
  double sample_rate_hz_ = 0.0;
  std::size_t lines_ = 0;
  bool offset_ = true;
  RiccatiForm form_ = RiccatiForm::time_varying;
  std::uint64_t samples_ = 0, skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<FullKalmanBank<double, 8>>);
static_assert(std::is_trivially_copyable_v<FullKalmanBank<float, 8>>);

}  // namespace resonid::online
