// SPDX-License-Identifier: MIT
#include "axis.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <resonid/base/approach.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/online/models/modes.hpp>
#include <span>

namespace resonid::linuxcnc {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
constexpr double kMostMissing = 0.05;       // of the samples within the trackers' memory
constexpr double kAveragedMemories = 30.0;  // of the trackers, without a steady line
constexpr double kNarrower = 3.0;           // their second filter, against the trackers
constexpr double kMostDamping = 0.9;        // of what is called a resonance

}  // namespace

expected<Axis, Error> Axis::create(const resonid_axis_shape& shape) {
  if (!(shape.period_s > 0.0)) return refuse("period", "must be > 0", shape.period_s);
  if (shape.lines < 3 || shape.lines > RESONID_MAX_LINES)
    return refuse("lines", "must be 3 to 40 of them", shape.lines);
  if (!(shape.last_hz > shape.first_hz))
    return refuse("lines", "must end above where they begin", shape.last_hz);
  const auto lines = static_cast<std::size_t>(shape.lines);
  std::array<double, kMaxLines> frequency{};
  for (std::size_t i = 0; i < lines; ++i)
    frequency[i] = shape.first_hz +
                   (shape.last_hz - shape.first_hz) * static_cast<double>(i) / static_cast<double>(lines - 1);
  const std::span<const double> hz(frequency.data(), lines);
  const double rate_hz = 1.0 / shape.period_s;

  // A line of the bank forgets as (1 - K/2)^k with K = 1/(lines + 1 + lambda).
  const double memory_samples = shape.memory_s * rate_hz;
  const double states = static_cast<double>(lines + 1);
  if (!(memory_samples > states))
    return refuse("memory", "must be longer than a period per line", shape.memory_s);
  const auto bank = online::KalmanBank<double, kMaxLines>::create(
      {.sample_rate_hz = rate_hz, .frequency_hz = hz, .lambda = 0.5 * memory_samples - states});
  if (!bank) return unexpected<Error>(bank.error());
  if (!bank->settled(0) && bank->settling_samples(0) == online::kNeverSettles)
    return refuse("memory", "is too long for trackers to settle", shape.memory_s);
  const auto tracker = Tracker::create(*bank, {});
  if (!tracker) return unexpected<Error>(tracker.error());
  const auto fit = Fit::create({.sample_rate_hz = rate_hz,
                                .frequency_hz = hz,
                                .memory_steps = std::max(4.0 * static_cast<double>(lines), memory_samples),
                                .correlated_steps = memory_samples});
  if (!fit) return unexpected<Error>(fit.error());
  const auto generator = Generator::create(hz, rate_hz);
  if (!generator) return unexpected<Error>(generator.error());
  return Axis(shape, *tracker, *fit, *generator);
}

Axis::Axis(const resonid_axis_shape& shape, const Tracker& tracker, const Fit& fit,
           const Generator& generator) noexcept
    : shape_(shape), tracker_(tracker), fit_(fit), generator_(generator) {
  for (std::size_t i = 0; i < tracker_.lines(); ++i)
    settling_samples_ = std::max(settling_samples_, tracker_.output().settling_samples(i));
  forget();
}

void Axis::forget() noexcept {
  tracker_.reset();
  fit_.reset();
  averages_.reset();
  scan_.reset();
  results_ = {};
  for (double* x :
       {&results_.resonance_hz, &results_.resonance_std_hz, &results_.resonance_damping,
        &results_.antiresonance_hz, &results_.antiresonance_std_hz, &results_.antiresonance_damping,
        &results_.motor_inertia, &results_.load_inertia, &results_.stiffness, &results_.crossover_hz,
        &results_.phase_margin_deg, &results_.phase_margin_std_deg, &results_.worst_phase_margin_deg,
        &results_.modulus_margin, &results_.modulus_margin_std, &results_.modulus_margin_hz,
        &results_.gain_margin_db, &results_.gain_margin_hz})
    *x = kAbsent;
  results_.trust_reason = RESONID_NOT_MEASURED;
  coherence_sum_ = missing_ = excitation_ = largest_line_velocity_ = 0.0;
  steady_samples_ = 0;
  slot_ = 0;
}

bool Axis::active() const noexcept { return guard_ && !guard_->stopped(); }

double Axis::excite(const resonid_axis_settings& settings, const resonid_axis_sample& sample) noexcept {
  const bool enable = sample.enable != 0, reset = sample.reset != 0;
  if (reset && !was_reset_) {
    guard_.reset();
    forget();
  }
  const bool tripped = guard_ && guard_->tripped();
  const bool ramping_out = active() && guard_->reason() != online::StopReason::none;
  if (enable && !was_enabled_ && !active() && !tripped) start(settings);
  if (!enable && guard_) guard_->stop();
  // Enabled again while it still ramps out: that waits for the end of the ramp.
  was_enabled_ = enable && (was_enabled_ || !ramping_out || tripped);
  was_reset_ = reset;
  excitation_ = 0.0;
  if (active()) {
    const bool valid = sample.valid != 0;
    excitation_ = guard_->step(generator_.step(), {.torque = sample.control,
                                                   .velocity = valid ? sample.velocity : kAbsent,
                                                   .position = valid ? sample.position : kAbsent});
  }
  results_.running = active() ? 1 : 0;
  results_.stop_reason = guard_ ? static_cast<int>(guard_->reason()) : 0;
  return excitation_;
}

/// A refusal leaves no guard, and so no excitation.
void Axis::start(const resonid_axis_settings& settings) noexcept {
  forget();
  guard_.reset();
  const double rate_hz = 1.0 / shape_.period_s;
  kind_ = settings.excitation;
  const auto guard =
      Guard::create({.sample_rate_hz = rate_hz,
                     .amplitude = settings.amplitude,
                     .ramp_in_s = settings.ramp_s,
                     .ramp_out_s = settings.ramp_s,
                     .margin = settings.margin,
                     .torque_limit = settings.max_torque,
                     .velocity_limit = settings.max_velocity,
                     .position_low = settings.position_low,
                     .position_high = settings.position_high,
                     .deceleration = settings.deceleration,
                     .oscillation_from_hz = settings.max_growth > 0.0 ? shape_.first_hz : 0.0,
                     .oscillation_least = settings.least_oscillation,
                     .oscillation_growth = settings.max_growth > 0.0 ? settings.max_growth : 2.0,
                     .watch_limit = settings.max_line_velocity});
  if (!guard || !generator_.start(kind_, settings.amplitude, settings.sweep_s)) {
    results_.trust_reason = RESONID_REFUSED;
    return;
  }
  guard_.emplace(*guard);
  // Until then the start, or the part of a sweep that has not been, shows in the response.
  steady_after_ = settling_samples_;
  if (kind_ == RESONID_MULTISINE) return;
  const double turn = static_cast<double>(tracker_.lines() + 2);
  const double sweep = kind_ == RESONID_CHIRP ? settings.sweep_s * rate_hz : 0.0;
  const double tracked = shape_.memory_s * rate_hz;
  const double memory = std::max(kAveragedMemories * tracked, 3.0 * sweep);
  averages_.configure(memory / turn, kNarrower * tracked / turn, tracked / turn);
  steady_after_ += static_cast<std::uint64_t>(std::max(sweep, 0.3 * memory));
}

void Axis::identify(const resonid_axis_settings& settings, const resonid_axis_sample& sample) noexcept {
  if (!active()) {
    results_.settled = 0;
    if (guard_ && guard_->tripped()) {
      results_.trusted = 0;
      results_.trust_reason = RESONID_STOPPED;
    }
    return;  // what was found stays
  }
  const bool valid = sample.valid != 0 && std::isfinite(sample.torque) && std::isfinite(sample.velocity);
  tracker_.step(excitation_, valid ? sample.torque : kAbsent, sample.velocity);
  missing_ += ((valid ? 0.0 : 1.0) - missing_) * shape_.period_s / shape_.memory_s;
  results_.samples = static_cast<std::uint32_t>(tracker_.samples());
  results_.skipped_samples = static_cast<std::uint32_t>(tracker_.skipped_samples());
  steady_samples_ = guard_->steady() ? steady_samples_ + 1 : 0;
  results_.settled = steady_samples_ > steady_after_ ? 1 : 0;

  const std::size_t lines = tracker_.lines();
  if (slot_ < lines)
    take_line(settings, slot_);
  else if (slot_ == lines)
    take_modes();
  else
    conclude(settings);
  slot_ = slot_ == lines + 1 ? 0 : slot_ + 1;
}

Axis::Line Axis::measure(std::size_t line) noexcept {
  const Complex ru = tracker_.excitation().phasor(line), u = tracker_.input().phasor(line);
  if (kind_ == RESONID_MULTISINE)
    return {tracker_.response(line, Approach::joint), ru / u - 1.0, tracker_.standard_deviation(line)};
  averages_.step(line, tracker_.excitation().amplitude(line), tracker_.input().amplitude(line),
                 tracker_.output().amplitude(line));
  return {averages_.response(line), averages_.loop(line), averages_.standard_deviation(line)};
}

void Axis::take_line(const resonid_axis_settings& settings, std::size_t line) noexcept {
  Line now = measure(line);
  largest_line_velocity_ = std::max(largest_line_velocity_, std::abs(tracker_.output().phasor(line)));
  if (results_.settled == 0) return;
  const double hz = tracker_.frequency_hz(line);
  const double relative_std = now.std / std::abs(now.response);
  coherence_sum_ += std::isfinite(relative_std) ? 1.0 / (1.0 + relative_std * relative_std) : 0.0;
  if (settings.loop != RESONID_LOOP_MEASURED) now.loop = pid(settings, hz) * now.response;
  take_margins(hz, now.loop, relative_std * std::abs(now.loop));
  if (fit_.next_line() == line) fit_.step(now.response * std::polar(1.0, kTwoPi * hz * settings.delay_s));
}

/// Its error is that of the lines on either side: L is off by the relative error of Gd.
void Axis::take_margins(double frequency_hz, Complex loop, double std) noexcept {
  const double before_hz = scan_.margins().modulus_margin_hz;
  const bool first = std::isnan(scan_.margins().crossover_hz);
  const double larger = std::max(std, last_std_) / std::numbers::sqrt2;  // one of two directions
  if (scan_.step(frequency_hz, loop) && first) phase_margin_std_ = larger * 180.0 / kPi;
  if (scan_.margins().modulus_margin_hz != before_hz) modulus_margin_std_ = larger;
  last_std_ = std;
}

/// LinuxCNC's pid: P + I Ts/(1 - z^-1) + D (1 - z^-1)/Ts; of a position, that over jw.
Axis::Complex Axis::pid(const resonid_axis_settings& settings, double frequency_hz) const noexcept {
  const double omega = kTwoPi * frequency_hz;
  const Complex difference = 1.0 - std::polar(1.0, -omega * shape_.period_s);
  const Complex gain = settings.pgain + settings.igain * shape_.period_s / difference +
                       settings.dgain * difference / shape_.period_s;
  return settings.loop == RESONID_LOOP_POSITION_PID ? gain / Complex(0.0, omega) : gain;
}

void Axis::take_modes() noexcept {
  if (results_.settled == 0 || !fit_.ready()) return;
  const auto covariance = fit_.covariance();
  const online::SampledModes<3> modes(fit_.model(), 1.0 / shape_.period_s);
  const auto poles = modes.resonances(covariance);
  const auto zeros = modes.antiresonances(covariance);
  const auto take = [](const auto& found, double& hz, double& std_hz, double& damping) {
    const bool there = !found.empty() && std::abs(found[0].damping_ratio) < kMostDamping;
    hz = there ? found[0].frequency_hz : kAbsent;
    std_hz = there ? found[0].std_hz : kAbsent;
    damping = there ? found[0].damping_ratio : kAbsent;
  };
  take(poles, results_.resonance_hz, results_.resonance_std_hz, results_.resonance_damping);
  take(zeros, results_.antiresonance_hz, results_.antiresonance_std_hz, results_.antiresonance_damping);
  take_masses();
}

/// J1 + J2 from the residue at z = 1, G -> (Ts/J)/(z - 1); J2/J1 = (w_res/w_ares)^2 - 1.
void Axis::take_masses() noexcept {
  const auto model = fit_.model();
  const double slope =
      2.0 + model.a[0] - model.a[2];  // of A at z = 1, which is (z - 1)(z^2 + (a1 + 1) z - a3)
  const double inertia = shape_.period_s * slope / (model.b[0] + model.b[1] + model.b[2]);
  const double ratio = results_.resonance_hz / results_.antiresonance_hz;
  const double omega = kTwoPi * results_.antiresonance_hz;
  const bool there = ratio > 1.0 && inertia > 0.0;
  results_.motor_inertia = there ? inertia / (ratio * ratio) : kAbsent;
  results_.load_inertia = there ? inertia - results_.motor_inertia : kAbsent;
  results_.stiffness = there ? results_.load_inertia * omega * omega : kAbsent;
}

void Axis::conclude(const resonid_axis_settings& settings) noexcept {
  if (results_.settled != 0) {
    const auto& m = scan_.margins();
    results_.crossover_hz = m.crossover_hz;
    results_.phase_margin_deg = m.phase_margin_deg;
    results_.phase_margin_std_deg = std::isnan(m.crossover_hz) ? kAbsent : phase_margin_std_;
    results_.worst_phase_margin_deg = m.worst_phase_margin_deg;
    results_.modulus_margin = m.modulus_margin;
    results_.modulus_margin_std = modulus_margin_std_;
    results_.modulus_margin_hz = m.modulus_margin_hz;
    results_.gain_margin_db = m.gain_margin_db;
    results_.gain_margin_hz = m.gain_margin_hz;
    results_.coherence = coherence_sum_ / static_cast<double>(tracker_.lines());
    ++results_.updates;
  }
  guard_->watch(largest_line_velocity_);
  scan_.reset();
  last_std_ = coherence_sum_ = largest_line_velocity_ = 0.0;
  if (results_.settled == 0 && results_.updates > 0) return;  // ramping out: what was found stays
  results_.trust_reason = verdict(settings);
  results_.trusted = results_.trust_reason == RESONID_TRUSTED ? 1 : 0;
}

resonid_trust Axis::verdict(const resonid_axis_settings& settings) const noexcept {
  if (results_.updates == 0 || results_.settled == 0) return RESONID_NOT_SETTLED;
  if (missing_ > kMostMissing) return RESONID_SAMPLES_MISSING;
  const auto& r = results_;
  if (!(r.resonance_damping > 0.0) || !(r.resonance_hz > r.antiresonance_hz)) return RESONID_NO_RESONANCE;
  if (r.antiresonance_hz < shape_.first_hz || r.resonance_hz > shape_.last_hz)
    return RESONID_OUTSIDE_THE_LINES;
  const bool certain = r.resonance_std_hz < settings.max_std * r.resonance_hz &&
                       r.antiresonance_std_hz < 2.0 * settings.max_std * r.antiresonance_hz;
  return certain ? RESONID_TRUSTED : RESONID_UNCERTAIN;
}

}  // namespace resonid::linuxcnc
