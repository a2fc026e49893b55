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
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/detail/sweep_fit.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>
#include <type_traits>

namespace resonid::online {

struct SweepResponseConfig {
  ChirpTrackerConfig chirp{};  ///< The sweep and the filter's gain; `offset` takes a constant part out.
  double known_delay_s = 0.0;  ///< Delay in the measured output, taken out of the response; 0 ... 64 samples.
  SweepQuantity quantity = SweepQuantity::velocity;  ///< What the output is.
};

/// Plant response along a known chirp, sample by sample, without the sweep's own error.
///
/// A line that moves through a resonance is never in a steady state, so Y/U is wrong by -j/2 dw/dt G'' and
/// more. But the equation A y = B u holds through whatever narrow filter T both sides go, if only its terms
/// are filtered alike. With the model B/A that fits the sweep so far (SweepFit) the rest of it corrects the
/// ratio exactly:
///
///   G(w) = [ B(w) + T(A y - B u)/U ]/A(w)      U = T u      y, u: velocity and torque
///
/// which is the truth, whatever the rate, where the machine has two masses, and where it has not errs only in
/// what the model leaves of it. The standard deviation is total (std^2 = E|error|^2) and holds the noise
/// through T A/A(w) and U, the covariance of the model, and in the density of the residuals what the model
/// cannot explain. T: the chirp tracker and two more stages of the same time constant; the response is that
/// of the frequency lag_samples() ago. A sample that is not finite is missing for both signals; after it the
/// filter begins anew. No heap, bounded work per sample. Limits: one machine for the whole sweep; the model
/// is of third order. Source: Nevaranta 2016, Pub. VI, for the tracker; the correction is this
/// project's own.
template <class Real, std::size_t Rows = 128>
class SweepResponse {
 public:
  using Scalar = Real;
  using Complex = std::complex<Real>;
  using Tracker = ChirpTracker<Real>;
  static constexpr std::size_t kOrder = 3;
  static constexpr std::size_t kMaxDelay = 64;

  static expected<SweepResponse, Error> create(const SweepResponseConfig& config) {
    const double delay = config.known_delay_s * config.chirp.sample_rate_hz;
    if (!(config.known_delay_s >= 0.0) || delay > static_cast<double>(kMaxDelay))
      return refuse("known_delay_s", "must be 0 ... 64 samples", config.known_delay_s);
    const auto tracker = Tracker::create(config.chirp);
    if (!tracker) return unexpected<Error>(tracker.error());
    ChirpTrackerConfig plain = config.chirp;
    plain.offset = false;
    const auto rows = Filter::create(plain);
    if (!rows) return unexpected<Error>(rows.error());
    const auto raw = ResponseTracker<Tracker>::create(*tracker, {.known_delay_s = config.known_delay_s});
    if (!raw) return unexpected<Error>(raw.error());
    return SweepResponse(config, *raw, *rows);
  }

  void step(Real ru, Real u, Real y) noexcept {
    if (!(std::isfinite(ru) && std::isfinite(u) && std::isfinite(y))) {
      miss(1);
      return;
    }
    raw_.step(ru, u, y);
    filter(ru, u, y);
    fit_.work(kRowsPerSample);
    if (!known_once_ && since_ >= settling_ && raw_.settled(0) && fit_.ready() && fit_.density() > Real(0)) {
      const auto v = value();
      known_once_ = v.variance < kLeastKnown * std::norm(v.response);
    }
  }
  void step(Real u, Real y) noexcept { step(Real(0), u, y); }
  /// `count` samples were lost.
  void miss(std::uint64_t count) noexcept {
    if (count == 0) return;
    raw_.miss(count);
    rows_.miss(count);
    forget_signals();
  }
  void reset() noexcept {
    raw_.reset();
    rows_.reset();
    fit_.reset();
    next_row_ = 0;
    known_once_ = false;
    least_density_ = std::numeric_limits<Real>::max();
    forget_signals();
  }

  /// Frequency that the response belongs to.
  [[nodiscard]] double described_hz() const noexcept { return hz_before(lag_samples()); }
  /// At described_hz(), delay removed, in the output's unit over the input's; NaN until settled().
  [[nodiscard]] Complex response() const noexcept {
    if (!settled()) return {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::quiet_NaN()};
    return value().response;
  }
  /// Total, std^2 = E|error|^2; infinite until settled().
  [[nodiscard]] Real standard_deviation() const noexcept {
    return settled() ? std::sqrt(value().variance) : std::numeric_limits<Real>::infinity();
  }
  [[nodiscard]] bool settled() const noexcept { return known_once_ && since_ >= settling_; }
  /// How long ago the sweep passed described_hz(), in samples.
  [[nodiscard]] double lag_samples() const noexcept { return kStages * lag_; }
  [[nodiscard]] std::uint64_t samples() const noexcept { return raw_.samples(); }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return raw_.skipped_samples(); }

  /// Whether the model has a resonance that is known to 3 %.
  [[nodiscard]] bool ready() const noexcept { return settled() && resonance().frequency_hz > 0.0; }
  /// From torque to velocity, known delay left out; a part of a sample of it stays in.
  [[nodiscard]] DiscreteModel<Real, kOrder> model() const noexcept { return fit_.model().model(); }
  [[nodiscard]] ModelCovariance<Real, kOrder> covariance() const noexcept {
    return model_covariance<Real, kOrder>(fit_.covariance());
  }
  /// Lowest resonance; frequency 0 while none shows: passed by the sweep, known to 3 %, damped, and apart
  /// from its anti-resonance by far more than both are uncertain. Noise is fitted by pairs of a pole and a
  /// zero that nearly cancel.
  [[nodiscard]] DiscreteMode resonance() const noexcept { return modes().resonance; }
  /// Lowest anti-resonance, likewise; 0 where there is no resonance, or no anti-resonance known to a tenth.
  [[nodiscard]] DiscreteMode antiresonance() const noexcept { return modes().antiresonance; }
  /// The tracker without correction.
  [[nodiscard]] const ResponseTracker<Tracker>& uncorrected() const noexcept { return raw_; }
  /// Frequency that its response belongs to; its delay is taken out at its newest one.
  [[nodiscard]] double uncorrected_hz() const noexcept { return hz_before(raw_.lag_samples(0)); }
  [[nodiscard]] double known_delay_s() const noexcept {
    return static_cast<double>(delay_) / rate_hz_ + delay_rest_s_;
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return raw_.intact() && rows_.intact() && fit_.intact() && law_.intact() && positive(rate_hz_) &&
           lag_ >= 1.0 && delay_ <= kMaxDelay && newest_ < inputs_.size() && known_ <= delay_ + kOrder + 1 &&
           resonid::intact(quantity_, SweepQuantity::acceleration) && resonid::intact(offset_) &&
           resonid::intact(known_once_);
  }

 private:
  static constexpr std::size_t kChannels = 7;  // q d^2 u, q d u, q u, the same of y, d^3 y
  static constexpr double kStages = 3.0;
  static constexpr std::size_t kRowsPerSample = 4;
  static constexpr double kHighPass = 1.0;  // corner, in the sweep's lowest frequency
  using Filter = ChirpTracker<Real, kChannels>;

  SweepResponse(const SweepResponseConfig& config, const ResponseTracker<Tracker>& raw,
                const Filter& rows) noexcept
      : raw_(raw), rows_(rows), quantity_(config.quantity), offset_(config.chirp.offset) {
    const auto& c = config.chirp;
    rate_hz_ = c.sample_rate_hz;
    law_ = {c.from_hz, c.to_hz, c.duration_s, c.sweep};
    const double delay = config.known_delay_s * rate_hz_;
    delay_ = static_cast<std::size_t>(delay + 1e-6);
    delay_rest_s_ = (delay - static_cast<double>(delay_)) / rate_hz_;
    lag_ = std::max(1.0, rows.probe_lag_samples(Filter::kProbes / 2));
    part_ = static_cast<Real>(1.0 / (1.0 + lag_));
    fade_ = static_cast<Real>(1.0 / (kFadeIn * lag_));
    const double low = std::min(c.from_hz, c.to_hz), high = std::max(c.from_hz, c.to_hz);
    keep_ = static_cast<Real>(std::exp(-kTwoPi * kHighPass * low / rate_hz_));
    const double samples = c.duration_s * rate_hz_;
    spacing_ = static_cast<std::uint64_t>(
        std::ceil(std::max(kSpacing * lag_, samples / static_cast<double>(Rows - 1))));
    last_row_ = static_cast<std::uint64_t>(samples + kStages * lag_);
    settling_ = static_cast<std::uint64_t>(kSettling * lag_) + 1;
    fit_.configure(lag_, static_cast<double>(spacing_), kTwoPi * high / rate_hz_, kTwoPi * low / rate_hz_,
                   quantity_);
    reset();
  }
  static constexpr double kSpacing = 2.0 / 3.0;  // of rows, in lags of a stage: no more is to be had
  static constexpr Real kLeastKnown =
      Real(0.25);                           // variance over |G|^2 with which the response begins to count
  static constexpr double kFadeIn = 3.0;    // lags of a stage
  static constexpr double kSettling = 6.0;  // likewise

  void forget_signals() noexcept {
    since_ = known_ = 0;
    second_ = third_ = {};
    rows_.forget_signals();
  }

  /// High-pass of a new sample: (1-q)/(1 - keep q), for position and acceleration with one difference more or
  /// less, in units of a velocity.
  void filter(Real ru, Real u, Real y) noexcept {
    const Real rate = static_cast<Real>(rate_hz_);
    if (known_ == 0) {
      input_before_ = u - ru;  // what the machine takes to run as it does
      output_before_ = y;
      input_ = output_ = difference_before_ = Real(0);
      inputs_.fill(offset_ ? Real(0) : u);
      velocity_.fill(Real(0));
    }
    const Real step = y - output_before_;
    if (known_ == 1) difference_before_ = step;  // a constant velocity is nothing new
    Real v = Real(0);
    if (!offset_ && quantity_ == SweepQuantity::velocity) {
      v = y;
    } else {
      const Real driven = quantity_ == SweepQuantity::velocity   ? step
                          : quantity_ == SweepQuantity::position ? (step - difference_before_) * rate
                                                                 : y / rate;
      output_ = keep_ * output_ + driven;
      v = output_;
      input_ = keep_ * input_ + (u - input_before_);
    }
    const bool passed = !offset_ && quantity_ == SweepQuantity::velocity;
    input_before_ = u;
    output_before_ = y;
    difference_before_ = step;
    for (std::size_t i = velocity_.size(); i-- > 1;) velocity_[i] = velocity_[i - 1];
    velocity_[0] = v;
    newest_ = newest_ + 1 == inputs_.size() ? 0 : newest_ + 1;
    inputs_[newest_] = passed ? u : input_;
    if (known_ < delay_ + kOrder + 1) {
      ++known_;
      rows_.miss(1);
      return;
    }
    const auto& w = velocity_;
    const Real u1 = input(1), u2 = input(2), u3 = input(3);
    typename Filter::Sample terms{u1 - Real(2) * u2 + u3,
                                  u1 - u2,
                                  u1,
                                  w[1] - Real(2) * w[2] + w[3],
                                  w[1] - w[2],
                                  w[1],
                                  w[0] - Real(3) * (w[1] - w[2]) - w[3]};
    fade_in(terms);
    rows_.step(terms);
    const Complex turn = rows_.rotation();
    for (std::size_t i = 0; i < kChannels; ++i) {
      follow(second_[i], rows_.phasor(0, i), turn);
      follow(third_[i], second_[i], turn);
    }
    ++since_;
    const std::uint64_t k = raw_.samples();
    if (since_ >= settling_ && k >= next_row_ && k < last_row_) {
      if (raw_.settled(0)) fit_.set_start_density(start_density());
      const auto row = newest_row();
      fit_.add(row, output_factor(row.d));
      next_row_ = k + spacing_;
    }
  }
  /// Begun abruptly, differences of noise would stand at the beginning without their counterparts, and those
  /// are many times larger than what is left of them at the line.
  void fade_in(typename Filter::Sample& terms) const noexcept {
    const Real x = static_cast<Real>(since_) * fade_;
    if (!(x < Real(1))) return;
    const Real share = x * x * (Real(3) - Real(2) * x);
    for (Real& z : terms) z *= share;
  }
  [[nodiscard]] Real input(std::size_t back) const noexcept {
    const std::size_t i = delay_ + back;
    return inputs_[newest_ >= i ? newest_ - i : newest_ + inputs_.size() - i];
  }
  void follow(Complex& state, Complex target, Complex turn) const noexcept {
    const Real re = turn.real() * state.real() - turn.imag() * state.imag();
    const Real im = turn.imag() * state.real() + turn.real() * state.imag();
    state = {re + part_ * (target.real() - re), im + part_ * (target.imag() - im)};
  }

  struct Modes {
    DiscreteMode resonance{}, antiresonance{};
  };
  [[nodiscard]] Modes modes() const noexcept {
    constexpr double kKnown = 0.03, kRoughly = 0.1, kApart = 3.0;
    const SampledModes<kOrder> sampled(model(), rate_hz_);
    const auto p = covariance();
    const auto poles = sampled.resonances(p);
    const auto zeros = sampled.antiresonances(p);
    const auto known = [](const auto& m, double share) {
      return !m.empty() && m[0].damping_ratio > 0.0 && m[0].std_hz < share * m[0].frequency_hz;
    };
    if (!known(poles, kKnown) || !passed(poles[0].frequency_hz)) return {};
    const bool zero_known = known(zeros, kRoughly);
    const double between = zeros.empty() ? 0.0 : std::abs(poles[0].frequency_hz - zeros[0].frequency_hz);
    if (!zeros.empty() && between < kApart * (poles[0].std_hz + zeros[0].std_hz)) return {};
    return {poles[0], zero_known ? zeros[0] : DiscreteMode{}};
  }

  [[nodiscard]] bool passed(double hz) const noexcept {
    return (hz - law_.from_hz) * (hz - described_hz()) < 0.0;
  }
  [[nodiscard]] double hz_before(double samples) const noexcept {
    const double newest = static_cast<double>(raw_.samples()) - 1.0;
    return law_.frequency_hz(std::max(0.0, newest - samples) / rate_hz_);
  }
  [[nodiscard]] SweepRow<Real> newest_row() const noexcept {
    SweepRow<Real> row;
    const double half = 0.5 * kTwoPi * described_hz() / rate_hz_;
    row.d = Complex(2.0 * std::sin(half) * std::complex<double>(std::sin(half), std::cos(half)));
    for (std::size_t i = 0; i < 3; ++i) {
      row.u[i] = third_[i];
      row.y[i] = third_[3 + i];
    }
    row.lead = third_[6];
    return row;
  }
  /// Velocity over what is measured.
  [[nodiscard]] Complex output_factor(Complex d) const noexcept {
    const Real rate = static_cast<Real>(rate_hz_);
    if (quantity_ == SweepQuantity::position) return d * rate;
    if (quantity_ == SweepQuantity::acceleration) return Real(1) / (d * rate);
    return Complex(1);
  }
  [[nodiscard]] typename SweepFit<Real, Rows>::Value value() const noexcept {
    const auto row = newest_row();
    auto v = fit_.value(row, output_factor(row.d));
    v.response *= Complex(std::polar(1.0, kTwoPi * described_hz() * delay_rest_s_));
    return v;
  }
  /// What the noise beside the line says: in need until enough rows do.
  Real start_density() noexcept {
    const Real phasor = raw_.standard_deviation(0) * std::abs(raw_.input().phasor());
    const Real gain = static_cast<Real>(raw_.output().noise_gain());
    const Real density = phasor * phasor / (gain * gain);
    if (density < least_density_) least_density_ = density;
    return least_density_;
  }

  ResponseTracker<Tracker> raw_;
  Filter rows_;
  SweepFit<Real, Rows> fit_{};
  SweepLaw law_{};
  SweepQuantity quantity_;
  bool offset_;
  double rate_hz_ = 0.0, lag_ = 1.0, delay_rest_s_ = 0.0;
  Real part_{}, fade_{}, keep_{};
  std::size_t delay_ = 0, newest_ = 0, known_ = 0;
  std::uint64_t spacing_ = 1, last_row_ = 0, next_row_ = 0, since_ = 0, settling_ = 0;
  std::array<Complex, kChannels> second_{}, third_{};
  std::array<Real, 4> velocity_{};                     // newest first
  std::array<Real, kMaxDelay + kOrder + 1> inputs_{};  // a ring
  bool known_once_ = false;
  Real least_density_ = std::numeric_limits<Real>::max();  // what noise beside the line was told so far
  Real input_before_{}, output_before_{}, difference_before_{}, input_{}, output_{};
};

static_assert(std::is_trivially_copyable_v<SweepResponse<double>>);
static_assert(std::is_trivially_copyable_v<SweepResponse<float>>);

}  // namespace resonid::online
