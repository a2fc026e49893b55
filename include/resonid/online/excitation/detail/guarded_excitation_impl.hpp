// SPDX-License-Identifier: MIT
#pragma once

// Definitions of guarded_excitation.hpp, which includes this.

namespace resonid::online {

template <class Real>
GuardedExcitation<Real>::GuardedExcitation(const GuardedExcitationConfig& c) noexcept {
  const auto real = [](double x) { return static_cast<Real>(x); };
  const auto samples = [&](double seconds) {
    return static_cast<std::uint64_t>(std::clamp(std::round(seconds * c.sample_rate_hz), 0.0, 1e15));
  };
  const auto phase_step = [&](double seconds) {
    const std::uint64_t n = std::max<std::uint64_t>(samples(seconds), 1);
    return (kFull + n - 1) / n;
  };
  sample_time_s_ = real(1.0 / c.sample_rate_hz);
  amplitude_ = real(c.amplitude);
  torque_limit_ = real(c.margin * c.torque_limit);
  velocity_limit_ = real(c.margin * c.velocity_limit);
  const double middle = 0.5 * (c.position_low + c.position_high);
  const double half = 0.5 * c.margin * (c.position_high - c.position_low);
  position_low_ = real(middle - half);
  position_high_ = real(middle + half);
  deceleration_ = real(c.deceleration);
  acceleration_ = real(c.largest_acceleration);
  reaction_s_ = real(c.reaction_s + c.trip_ramp_s + 1.0 / c.sample_rate_hz);
  watch_limit_ = real(c.margin * c.watch_limit);
  in_step_ = phase_step(c.ramp_in_s);
  out_step_ = phase_step(c.ramp_out_s);
  trip_step_ = phase_step(c.trip_ramp_s);
  last_full_ = c.duration_s > 0.0 ? std::max<std::uint64_t>(samples(c.duration_s - c.ramp_out_s), 1) : 0;
  learn_ = samples(c.ramp_in_s + c.oscillation_learn_s);
  lost_ = samples(c.lost_s);
  timeout_ = c.watch_timeout_s > 0.0 ? std::max<std::uint64_t>(samples(c.watch_timeout_s), 1) : 0;
  torque_is_total_ = c.torque_is_total;
  oscillation_on_ = c.oscillation_from_hz > 0.0;
  oscillation_of_torque_ = c.oscillation_signal == OscillationSignal::torque;
  torque_.watched = c.torque_limit > 0.0 || (oscillation_on_ && oscillation_of_torque_);
  velocity_.watched =
      c.velocity_limit > 0.0 || c.has_window() || (oscillation_on_ && !oscillation_of_torque_);
  position_.watched = c.has_window();
  if (oscillation_on_) growth_ = OscillationGrowth<Real>(c);
}

template <class Real>
Real GuardedExcitation<Real>::step(Real excitation, const Sample& now) noexcept {
  measure(now);
  if (!stopped()) {
    look_at_signals();
    started_ = started_ || all_seen();
    if (started_) look_at_limits();
  }
  advance_ramp();
  if (phase_ == 0) {
    injected_ = Real(0);
  } else {
    const Real x = std::isfinite(excitation) ? std::clamp(excitation, -amplitude_, amplitude_) : Real(0);
    injected_ = within_torque(ramp(phase_) * x);
  }
  if (started_) {
    ++running_;
    ++silent_;
  }
  ++samples_;
  return injected_;
}

template <class Real>
void GuardedExcitation<Real>::measure(const Sample& now) noexcept {
  torque_.take(torque_is_total_ ? now.torque - injected_ : now.torque);
  velocity_.take(now.velocity);
  position_.take(now.position);
  const bool missing = (torque_.watched && torque_.age > 0) || (velocity_.watched && velocity_.age > 0) ||
                       (position_.watched && position_.age > 0);
  if (missing) ++skipped_;
}

template <class Real>
void GuardedExcitation<Real>::look_at_signals() noexcept {
  for (const Measured* signal : {&torque_, &velocity_, &position_})
    if (signal->watched && signal->age > lost_)
      end(StopReason::signal_lost, static_cast<Real>(signal->age) * sample_time_s_,
          static_cast<Real>(lost_) * sample_time_s_);
  if (started_ && timeout_ > 0 && silent_ > timeout_)
    end(StopReason::watchdog_silent, static_cast<Real>(silent_) * sample_time_s_,
        static_cast<Real>(timeout_) * sample_time_s_);
}

template <class Real>
void GuardedExcitation<Real>::look_at_limits() noexcept {
  if (torque_limit_ > Real(0) && std::abs(torque_.value) > torque_limit_)
    end(StopReason::torque, torque_.value, std::copysign(torque_limit_, torque_.value));
  if (velocity_limit_ > Real(0)) {
    const Real reached = std::abs(velocity_.value) + acceleration_ * reaction(velocity_.age);
    if (reached > velocity_limit_)
      end(StopReason::velocity, std::copysign(reached, velocity_.value),
          std::copysign(velocity_limit_, velocity_.value));
  }
  if (position_.watched) look_at_position();
  if (oscillation_on_) {
    const Measured& signal = oscillation_of_torque_ ? torque_ : velocity_;
    const bool learning = reason() == StopReason::none && running_ < learn_;
    if (signal.age == 0 && growth_.step(signal.value, injected_, learning))
      end(StopReason::oscillation, growth_.rms(), growth_.threshold());
  }
  if (last_full_ > 0 && running_ >= last_full_ && reason() == StopReason::none)
    end(StopReason::finished, static_cast<Real>(running_) * sample_time_s_,
        static_cast<Real>(last_full_) * sample_time_s_);
}

template <class Real>
void GuardedExcitation<Real>::look_at_position() noexcept {
  const Real time = reaction(std::max(position_.age, velocity_.age));
  const auto travel = [&](Real velocity) {  // towards one end until it stands
    const Real last = velocity + acceleration_ * time;
    if (!(last > Real(0))) return Real(0);
    const Real until = velocity * time + Real(0.5) * acceleration_ * time * time;
    return std::max(until, Real(0)) + last * last / (Real(2) * deceleration_);
  };
  const Real up = position_.value + travel(velocity_.value);
  const Real down = position_.value - travel(-velocity_.value);
  if (up > position_high_) end(StopReason::position, up, position_high_);
  if (down < position_low_) end(StopReason::position, down, position_low_);
}

template <class Real>
void GuardedExcitation<Real>::advance_ramp() noexcept {
  if (reason() == StopReason::none) {
    if (started_) phase_ = kFull - phase_ > in_step_ ? phase_ + in_step_ : kFull;
    return;
  }
  phase_ -= std::min(phase_, tripped() ? trip_step_ : out_step_);
}

template <class Real>
Real GuardedExcitation<Real>::within_torque(Real x) noexcept {
  const Real command = torque_.value;
  if (!(torque_limit_ > Real(0)) || std::abs(command + x) <= torque_limit_) return x;
  end(StopReason::torque, command + x, std::copysign(torque_limit_, command + x));
  if (trip_step_ == kFull) {
    phase_ = 0;
    return Real(0);
  }
  return std::clamp(x, std::min(-torque_limit_ - command, Real(0)),
                    std::max(torque_limit_ - command, Real(0)));
}

/// The first limit stands, and goes before a request and the end of the plan.
template <class Real>
void GuardedExcitation<Real>::end(StopReason reason, Real value, Real limit) noexcept {
  if (tripped() || (report_.reason != StopReason::none && !is_trip(reason))) return;
  report_ = {reason, samples_, value, limit};
}

template <class Real>
void GuardedExcitation<Real>::miss(std::uint64_t count) noexcept {
  samples_ += count;
  const auto older = [count](std::uint64_t& age) { age = age > ~count ? ~std::uint64_t{0} : age + count; };
  for (Measured* signal : {&torque_, &velocity_, &position_}) older(signal->age);
  if (torque_.watched || velocity_.watched || position_.watched) skipped_ += count;
  if (started_) older(silent_);
  if (!stopped()) look_at_signals();
}

template <class Real>
void GuardedExcitation<Real>::watch(Real amplitude) noexcept {
  if (!std::isfinite(amplitude)) return;
  silent_ = 0;
  if (started_ && !stopped() && watch_limit_ > Real(0) && std::abs(amplitude) > watch_limit_)
    end(StopReason::watchdog_amplitude, std::abs(amplitude), watch_limit_);
}

template <class Real>
void GuardedExcitation<Real>::stop() noexcept {
  end(StopReason::requested, Real(0), Real(0));
}

template <class Real>
bool GuardedExcitation<Real>::acknowledge() noexcept {
  if (!stopped()) return false;
  report_ = {};
  growth_.reset();
  injected_ = Real(0);
  phase_ = running_ = silent_ = 0;
  started_ = false;
  return true;
}

template <class Real>
void GuardedExcitation<Real>::reset() noexcept {
  report_ = {};
  growth_.reset();
  injected_ = Real(0);
  phase_ = running_ = silent_ = samples_ = skipped_ = 0;
  started_ = false;
  for (Measured* signal : {&torque_, &velocity_, &position_}) {
    signal->value = Real(0);
    signal->age = 0;
    signal->seen = false;
  }
}

static_assert(std::is_trivially_copyable_v<GuardedExcitation<double>>);
static_assert(std::is_trivially_copyable_v<GuardedExcitation<float>>);

}  // namespace resonid::online
