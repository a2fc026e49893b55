// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/lines/detail/gain_rule.hpp>
#include <resonid/online/lines/detail/impulse_figures.hpp>
#include <resonid/online/lines/detail/sweep.hpp>
#include <type_traits>

namespace resonid::online {

struct ChirpTrackerConfig {
  double sample_rate_hz = 0.0;  ///< Rate at which step() is called, > 0.
  double from_hz = 0.0;         ///< Frequency at sample 0, > 0 and below half the sample rate.
  double to_hz = 0.0;           ///< Frequency at the end, likewise; the tracker stays there.
  double duration_s = 0.0;      ///< Length of the sweep, > 0.
  Sweep sweep = Sweep::linear;
  bool offset = false;  ///< A state for a constant part of the signal; needed where there is one.
  GainRule gain = GainRule::fixed;
  double lambda = 8.0;        ///< Fixed gain: larger is quieter and slower; > -(1 + offset)/2.
  double pole_radius = 0.98;  ///< Placed poles: in (0, 1); nearer to 1 is quieter and slower.
};

/// Phasor of the one line whose frequency follows a chirp: Kalman short-time DFT with Phi(k) of the
/// instantaneous frequency f(k), which for a linear chirp is f0 + m t (not the printed f0 + m t/2:
/// docs/errata.md).
///
///   e(k) = z(k) - Re p(k) - offset(k)        p(k+1) = e^{j w(k)} p(k) + gain(k) e(k)
///
/// Reported is the filtered phasor. It lags the line by lag_samples() and, what is more, a sweep through a
/// resonance biases Y/U to first order in the sweep rate (docs/methods/swept_response.md): slower sweeps are
/// better ones. A linear chirp needs no trigonometry per sample: the rotation is itself rotated, and set anew
/// every 32 samples. A logarithmic one takes an exponential, a cosine and a sine in double precision per
/// sample: not for microcontrollers. A sample that is not finite counts as missing.
///
/// Several signals (ru, u, y) share one rotation and one gain as the channels of one tracker; a sample of
/// which any channel is not finite is then missing for all. Source: Nevaranta 2016, Pub. VI, eqs. 8-17.
template <class Real, std::size_t Channels = 1>
class ChirpTracker {
 public:
  using Scalar = Real;
  using Sample = std::array<Real, Channels>;  ///< [channel]
  static constexpr std::size_t kChannels = Channels;
  using MovingLine = void;  ///< Says that frequency_hz() changes with time.
  static constexpr std::size_t kMaxLines = 1;
  static constexpr std::size_t kProbes = 9;  ///< Frequencies at which the figures are computed.

  static expected<ChirpTracker, Error> create(const ChirpTrackerConfig& config) {
    if (auto fault = check(config)) return unexpected<Error>(*fault);
    ChirpTracker tracker;
    tracker.sample_time_s_ = 1.0 / config.sample_rate_hz;
    tracker.law_ = {config.from_hz, config.to_hz, config.duration_s, config.sweep};
    tracker.has_offset_ = config.offset;
    tracker.rule_ = config.gain;
    tracker.weight_ = static_cast<Scalar>(1.0 / ((config.offset ? 2.0 : 1.0) + config.lambda));
    tracker.radius_ = static_cast<Scalar>(config.pole_radius);
    const double turn = config.sweep == Sweep::linear
                            ? kTwoPi * (config.to_hz - config.from_hz) / config.duration_s *
                                  tracker.sample_time_s_ * tracker.sample_time_s_
                            : 0.0;
    tracker.first_angle_ = static_cast<Scalar>(kTwoPi * config.from_hz * tracker.sample_time_s_);
    tracker.last_angle_ = static_cast<Scalar>(kTwoPi * config.to_hz * tracker.sample_time_s_);
    tracker.angle_step_ = static_cast<Scalar>(turn);
    tracker.end_ = tracker.first_at_end();
    tracker.turn_cos_ = static_cast<Scalar>(std::cos(turn));
    tracker.turn_sin_ = static_cast<Scalar>(std::sin(turn));
    for (std::size_t i = 0; i < kProbes; ++i) {
      const std::array<double, 1> angle{kTwoPi * tracker.probe_hz(i) * tracker.sample_time_s_};
      Oscillators<double, 1> frozen;
      frozen.configure(angle, config.gain == GainRule::fixed
                                  ? fixed_gain<1>(angle, config.offset, config.lambda)
                                  : placed_gain<1>(angle, config.offset, config.pole_radius));
      tracker.figures_[i] = impulse_figures(frozen)[0];
    }
    tracker.settling_ = std::max(tracker.figures_[0].settling_samples, tracker.figures_[1].settling_samples);
    return tracker;
  }

  void step(const Sample& z) noexcept {
    turn();
    bool finite = true;
    for (const Scalar x : z) finite = finite && std::isfinite(x);
    advance(z, finite);
    if (!finite) ++skipped_;
    ++samples_;
  }
  void step(Scalar z) noexcept requires(Channels == 1) { step(Sample{z}); }
  /// `count` samples were lost: as so many steps with a sample that is not finite, in a bounded time.
  void miss(std::uint64_t count) noexcept {
    constexpr std::uint64_t kStepped = 16;  // so few are stepped, bit for bit
    if (count > kStepped) {
      const std::uint64_t turned = count - 1;
      const auto turn = std::polar(1.0, kTwoPi * law_.turns_over(samples_, turned, sample_time_s_));
      const auto cos = static_cast<Scalar>(turn.real()), sin = static_cast<Scalar>(turn.imag());
      for (Channel& c : channels_) {
        const Scalar re = c.re;
        c.re = cos * re - sin * c.im;
        c.im = sin * re + cos * c.im;
      }
      samples_ += turned;
      skipped_ += turned;
      set_rotation(samples_ - 1);
      count = 1;
    }
    Sample missing;
    missing.fill(std::numeric_limits<Scalar>::quiet_NaN());
    for (; count > 0; --count) step(missing);
  }
  void reset() noexcept {
    channels_ = {};
    samples_ = skipped_ = 0;
  }

  /// The signals begin anew at rest, the sweep goes on.
  void forget_signals() noexcept { channels_ = {}; }

  /// Rotating phasor at the newest sample, in the unit of the signal (peak value).
  [[nodiscard]] std::complex<Scalar> phasor(std::size_t = 0, std::size_t channel = 0) const noexcept {
    const Channel& c = channels_[channel];
    return {cos_ * c.re + sin_ * c.im, cos_ * c.im - sin_ * c.re};
  }
  /// The same against the chirp cos(phase(t)) of phase 0 at sample 0: constant for a constant gain.
  [[nodiscard]] std::complex<Scalar> amplitude(std::size_t = 0, std::size_t channel = 0) const noexcept {
    const double cycles = law_.cycles(time_s());
    const auto a =
        std::complex<double>(phasor(0, channel)) * std::polar(1.0, -kTwoPi * (cycles - std::floor(cycles)));
    return {static_cast<Scalar>(a.real()), static_cast<Scalar>(a.imag())};
  }
  [[nodiscard]] Scalar offset(std::size_t channel = 0) const noexcept { return channels_[channel].offset; }
  /// Newest sample minus what was predicted for it; 0 for a missing one.
  [[nodiscard]] Scalar innovation(std::size_t channel = 0) const noexcept {
    return channels_[channel].innovation;
  }

  /// Whether the start no longer matters (kSettledRemainder).
  [[nodiscard]] bool settled(std::size_t = 0) const noexcept {
    return settling_ != kNeverSettles && samples_ >= settling_;
  }
  [[nodiscard]] bool ready() const noexcept { return settled(); }
  /// Samples until settled(), at the frequencies of the first eighth of the sweep, or kNeverSettles.
  [[nodiscard]] std::size_t settling_samples(std::size_t = 0) const noexcept { return settling_; }
  /// Rms of the complex phasor's error per unit standard deviation of white noise, at the present frequency.
  [[nodiscard]] double noise_gain(std::size_t = 0) const noexcept {
    return between(&ImpulseFigures::noise_gain);
  }
  /// How far the phasor lags behind slow changes of the line: it describes the frequency of that long ago.
  [[nodiscard]] double lag_samples(std::size_t = 0) const noexcept {
    return between(&ImpulseFigures::lag_samples);
  }

  [[nodiscard]] std::size_t lines() const noexcept { return 1; }
  /// Instantaneous frequency at the newest sample.
  [[nodiscard]] double frequency_hz(std::size_t = 0) const noexcept { return law_.frequency_hz(time_s()); }
  [[nodiscard]] double sample_rate_hz() const noexcept { return 1.0 / sample_time_s_; }
  [[nodiscard]] bool has_offset() const noexcept { return has_offset_; }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// For ResponseTracker: see KalmanBank.
  [[nodiscard]] std::complex<double> turn_over(std::size_t, std::uint64_t count) const noexcept {
    const std::uint64_t newest = samples_ > 0 ? samples_ - 1 : 0;
    return std::polar(1.0, kTwoPi * law_.turns_over(newest, count, sample_time_s_));
  }
  [[nodiscard]] std::complex<Scalar> rotation(std::size_t = 0) const noexcept { return {cos_, sin_}; }
  [[nodiscard]] ChirpTracker probe(std::size_t i) const noexcept {
    ChirpTracker frozen = *this;
    frozen.law_.from_hz = frozen.law_.to_hz = probe_hz(i);
    frozen.first_angle_ = frozen.last_angle_ = static_cast<Scalar>(kTwoPi * probe_hz(i) * sample_time_s_);
    frozen.angle_step_ = Scalar(0);
    frozen.turn_cos_ = Scalar(1);
    frozen.turn_sin_ = Scalar(0);
    frozen.reset();
    return frozen;
  }
  [[nodiscard]] double probe_lag_samples(std::size_t i) const noexcept { return figures_[i].lag_samples; }
  [[nodiscard]] double probe_position() const noexcept {
    if (law_.to_hz == law_.from_hz) return 0.0;
    return (kProbes - 1) * (frequency_hz() - law_.from_hz) / (law_.to_hz - law_.from_hz);
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return law_.intact() && positive(sample_time_s_) && positive(law_.duration_s / sample_time_s_) &&
           resonid::intact(has_offset_) && resonid::intact(rule_, GainRule::placed_poles);
  }

 private:
  ChirpTracker() = default;

  static std::optional<Error> check(const ChirpTrackerConfig& c) {
    if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
      return Error{"sample_rate_hz", "must be > 0", c.sample_rate_hz};
    const double nyquist = 0.5 * c.sample_rate_hz;
    if (!(c.from_hz > 0.0 && c.from_hz < nyquist))
      return Error{"from_hz", "must be > 0 and below half the sample rate", c.from_hz};
    if (!(c.to_hz > 0.0 && c.to_hz < nyquist))
      return Error{"to_hz", "must be > 0 and below half the sample rate", c.to_hz};
    if (!(c.duration_s > 0.0) || !std::isfinite(c.duration_s))
      return Error{"duration_s", "must be > 0", c.duration_s};
    if (c.gain == GainRule::fixed && !(c.lambda > (c.offset ? -1.0 : -0.5) && std::isfinite(c.lambda)))
      return Error{"lambda", "must be above minus half the number of lines and offset", c.lambda};
    if (c.gain == GainRule::placed_poles && !(c.pole_radius > 0.0 && c.pole_radius < 1.0))
      return Error{"pole_radius", "must lie between 0 and 1", c.pole_radius};
    return std::nullopt;
  }

  struct Channel {
    Scalar re{}, im{}, offset{}, predicted{}, innovation{};
  };

  /// Brings e^{jw} to the sample that comes.
  void turn() noexcept {
    constexpr std::uint32_t kAnew =
        32;  // float: 1e-5 of rounding in the phasor; 256 would let it grow to 9e-5
    const bool anew = static_cast<std::uint32_t>(samples_) % kAnew == 0 || samples_ == end_;
    if (!anew && samples_ > end_) return;
    if (anew || law_.sweep != Sweep::linear) {
      set_rotation(samples_);
      return;
    }
    const Scalar c = turn_cos_ * cos_ - turn_sin_ * sin_;
    const Scalar s = turn_sin_ * cos_ + turn_cos_ * sin_;
    const Scalar scale = Scalar(1.5) - Scalar(0.5) * (c * c + s * s);  // 1/|.| to first order
    cos_ = scale * c;
    sin_ = scale * s;
  }
  /// w of a sample, in rad per sample.
  [[nodiscard]] Scalar angle(std::uint64_t sample) const noexcept {
    if (sample >= end_) return last_angle_;
    if (law_.sweep == Sweep::linear) return first_angle_ + angle_step_ * static_cast<Scalar>(sample);
    const double time = static_cast<double>(sample) * sample_time_s_;
    return static_cast<Scalar>(kTwoPi * law_.frequency_hz(time) * sample_time_s_);
  }

  void set_rotation(std::uint64_t sample) noexcept {
    const Scalar now = angle(sample);
    cos_ = std::cos(now);
    sin_ = std::sin(now);
  }

  void advance(const Sample& z, bool finite) noexcept {
    Scalar gain_re = weight_ * cos_, gain_im = weight_ * sin_;
    Scalar offset_gain = has_offset_ ? weight_ : Scalar(0);
    if (rule_ == GainRule::placed_poles) placed(gain_re, gain_im, offset_gain);
    for (std::size_t i = 0; i < Channels; ++i) {
      Channel& c = channels_[i];
      const Scalar innovation = finite ? z[i] - c.predicted : Scalar(0);
      const Scalar re = cos_ * c.re - sin_ * c.im + gain_re * innovation;
      c.im = sin_ * c.re + cos_ * c.im + gain_im * innovation;
      c.re = re;
      c.offset += offset_gain * innovation;
      c.predicted = re + c.offset;
      c.innovation = innovation;
    }
  }

  /// placed_gain() of one line in real numbers; l = c + js on the unit circle.
  ///   gain = 2 l (1 - rho) (l - rho l*)/(l - l*) [(l - rho)/(l - 1)]
  void placed(Scalar& gain_re, Scalar& gain_im, Scalar& offset_gain) const noexcept {
    const Scalar one(1), rho = radius_, c = cos_, s = sin_;
    const Scalar re = one - rho * rho;  // of 2 (1 - rho) (l - rho l*)/(l - l*)
    const Scalar im = -(one - rho) * (one - rho) * c / s;
    gain_re = re * c - im * s;
    gain_im = re * s + im * c;
    if (!has_offset_) return;
    const Scalar away = Scalar(2) * s * s / (one + c);               // |l - 1|^2 = 2 - 2c
    const Scalar ratio_re = ((c - rho) * (c - one) + s * s) / away;  // of (l - rho)/(l - 1)
    const Scalar ratio_im = s * ((c - one) - (c - rho)) / away;
    const Scalar turned = gain_re * ratio_re - gain_im * ratio_im;
    gain_im = gain_re * ratio_im + gain_im * ratio_re;
    gain_re = turned;
    offset_gain = (one - rho) * (one - Scalar(2) * rho * c + rho * rho) / away;
  }

  /// First sample at which the sweep has ended.
  [[nodiscard]] std::uint64_t first_at_end() const noexcept {
    const double count = law_.duration_s / sample_time_s_;
    if (!(count < 9e15)) return static_cast<std::uint64_t>(-1);
    auto sample = static_cast<std::uint64_t>(count);
    while (static_cast<double>(sample) * sample_time_s_ < law_.duration_s) ++sample;
    return sample;
  }
  [[nodiscard]] double time_s() const noexcept {
    return samples_ == 0 ? 0.0 : static_cast<double>(samples_ - 1) * sample_time_s_;
  }
  [[nodiscard]] double probe_hz(std::size_t i) const noexcept {
    const double part = static_cast<double>(i) / (kProbes - 1);
    return law_.from_hz + (law_.to_hz - law_.from_hz) * part;
  }
  [[nodiscard]] double between(double ImpulseFigures::*figure) const noexcept {
    const double position = probe_position();
    const auto low = std::min(static_cast<std::size_t>(position), kProbes - 2);
    const double part = position - static_cast<double>(low);
    return (1.0 - part) * figures_[low].*figure + part * figures_[low + 1].*figure;
  }

  SweepLaw law_;
  double sample_time_s_ = 0.0;
  bool has_offset_ = false;
  GainRule rule_ = GainRule::fixed;
  Scalar weight_{}, radius_{}, turn_cos_{}, turn_sin_{};
  Scalar first_angle_{}, last_angle_{}, angle_step_{};  // rad per sample
  Scalar cos_{}, sin_{};
  std::array<Channel, Channels> channels_{};
  std::array<ImpulseFigures, kProbes> figures_{};
  std::size_t settling_ = 0;
  std::uint64_t end_ = 0;  // first sample at the last frequency
  std::uint64_t samples_ = 0;
  std::uint64_t skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<ChirpTracker<double>>);
static_assert(std::is_trivially_copyable_v<ChirpTracker<float>>);

}  // namespace resonid::online
