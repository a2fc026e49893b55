// SPDX-License-Identifier: MIT
#pragma once

// IWYU pragma: private, include <resonid/online/axis.hpp>
#include <resonid/online/axis.hpp>

namespace resonid::online {
namespace detail {

/// Why a configuration is refused, apart from what estimators say.
[[nodiscard]] std::optional<Error> fault_of(const AxisConfig& config, bool takes_velocity) noexcept;
/// The same with the field's name in AxisConfig.
[[nodiscard]] Error of_axis(Error error) noexcept;

}  // namespace detail

template <class Room, class... Estimators>
template <class First, class... Rest>
expected<void, Error> BasicAxis<Room, Estimators...>::make_estimator(const AxisConfig& c) noexcept {
  if (First::serves(c)) {
    if (auto fault = detail::fault_of(c, First::kTakesVelocity)) return unexpected<Error>(std::move(*fault));
    if (auto made = First::create_in(estimator_.template place_for<First>(), c); !made)
      return unexpected<Error>(detail::of_axis(made.error()));
    return {};
  }
  if constexpr (sizeof...(Rest) > 0)
    return make_estimator<Rest...>(c);
  else
    return refuse("method", "must be one that this axis was built with");
}

template <class Room, class... Estimators>
expected<void, Error> BasicAxis<Room, Estimators...>::configure(const AxisConfig& c) noexcept {
  if (auto made = make_estimator<Estimators...>(c); !made) return made;
  const auto injector = Injector::create(c);
  if (!injector) return unexpected<Error>(detail::of_axis(injector.error()));
  const auto baseline = Baseline::create(c);
  if (!baseline) return unexpected<Error>(baseline.error());
  const auto watch = Watch::create(c);
  if (!watch) return unexpected<Error>(watch.error());
  const auto check = Check::create(c);
  if (!check) return unexpected<Error>(check.error());
  injector_ = *injector;
  baseline_ = *baseline;
  watch_ = *watch;
  check_ = *check;
  sample_rate_hz_ = c.sample_rate_hz;
  every_ = c.row_every_samples;
  spread_ = c.spread_samples;
  output_ = c.output;
  has_excitation_ = c.has_excitation;
  criteria_ = c.criteria;
  loop_ = detail::AxisLoopFigures(c);
  if (baseline_.known()) loop_.scale_by(baseline_);
  gates_ =
      detail::AxisGatekeeper<Real>(c.sample_rate_hz, detail::axis_centre_hz(c), c.sweep.duration_s > 0.0);
  forget();
  return {};
}

template <class Room, class... Estimators>
auto BasicAxis<Room, Estimators...>::create(const AxisConfig& c) noexcept -> expected<BasicAxis, Error> {
  expected<BasicAxis, Error> axis(tl::in_place, Key{});
  if (auto done = axis->configure(c); !done) axis = unexpected<Error>(done.error());
  return axis;
}

template <class Room, class... Estimators>
auto BasicAxis<Room, Estimators...>::create_in(void* memory, const AxisConfig& c) noexcept
    -> expected<BasicAxis*, Error> {
  auto* axis = ::new (memory) BasicAxis(Key{});
  if (auto done = axis->configure(c); !done) return unexpected<Error>(done.error());
  return axis;
}

template <class Room, class... Estimators>
void BasicAxis<Room, Estimators...>::forget() noexcept {
  estimator_.visit([](auto& e) { e.reset(); });
  gates_.reset();
  watch_.reset();
  check_.reset();
  result_ = {};
  result_.settled = !injector_.started();
  last_output_ = std::numeric_limits<Real>::quiet_NaN();
  steady_samples_ = 0;
  reading_ = {};
  known_ = {};
  stage_ = Stage::done;
  unit_ = 0;
  phase_ = 0;
}

template <class Room, class... Estimators>
void BasicAxis<Room, Estimators...>::reset() noexcept {
  injector_.reset();
  injected_ = Real(0);
  steady_after_ = 0;
  needs_steady_ = false;
  estimator_.visit([](auto& e) {
    if constexpr (requires { e.average_as_told(); }) e.average_as_told();
  });
  forget();
}

template <class Room, class... Estimators>
expected<void, Error> BasicAxis<Room, Estimators...>::start(const AxisInjection& what) noexcept {
  reset();
  if (auto started = injector_.start(what); !started) return started;
  using Injected = AxisInjection::Kind;
  estimator_.visit([&](auto& e) {
    if constexpr (requires { e.settling_samples(); }) {
      if (what.kind == Injected::chirp || what.kind == Injected::prbs)
        e.average(true, what.kind == Injected::chirp ? what.sweep_s * sample_rate_hz_ : 0.0);
      steady_after_ = e.settling_samples();
      needs_steady_ = true;
    }
  });
  result_.settled = !needs_steady_;
  result_.injecting = true;
  return {};
}

template <class Room, class... Estimators>
auto BasicAxis<Room, Estimators...>::excite(const MachineSample<Real>& now, Real given) noexcept -> Real {
  injected_ = injector_.excite(now, given);
  result_.injecting = injector_.active();
  result_.stop_reason = injector_.reason();
  if (injector_.tripped()) {
    result_.row.trusted = false;
    result_.row.verdict = AxisVerdict::stopped;
  }
  return injected_;
}

template <class Room, class... Estimators>
auto BasicAxis<Room, Estimators...>::velocity_of(Real output) noexcept -> Real {
  if (output_ != AxisOutput::position) return output;
  const Real velocity = (output - last_output_) * static_cast<Real>(sample_rate_hz_);
  last_output_ = output;
  return velocity;
}

/// Rows are made while what the trackers hold is the steady excitation.
template <class Room, class... Estimators>
void BasicAxis<Room, Estimators...>::settle() noexcept {
  if (!injector_.started()) return;
  steady_samples_ = injector_.steady() ? steady_samples_ + 1 : 0;
  result_.settled = needs_steady_ ? steady_samples_ > steady_after_ : injector_.active();
}

template <class Room, class... Estimators>
bool BasicAxis<Room, Estimators...>::step(const Sample& s) noexcept {
  const Real ru = s.excitation, u = s.torque;
  ++result_.samples;
  const bool missing = !std::isfinite(u) || !std::isfinite(s.output) || !std::isfinite(ru);
  Real residual = std::numeric_limits<Real>::quiet_NaN();
  estimator_.visit([&](auto& e) {
    constexpr bool kVelocity = std::decay_t<decltype(e)>::kTakesVelocity;
    e.step(ru, u, kVelocity ? velocity_of(s.output) : s.output);
    residual = e.residual();
  });
  if (missing) ++result_.skipped_samples;
  gates_.sample(has_excitation_ ? ru : u, residual, missing);
  check_.step(ru, u, s.output);
  settle();
  return work();
}

template <class Room, class... Estimators>
void BasicAxis<Room, Estimators...>::miss(std::uint64_t count) noexcept {
  if (count == 0) return;
  estimator_.visit([count](auto& e) { e.miss(count); });
  injector_.miss(count);
  gates_.miss(count);
  check_.miss(count);
  result_.samples += count;
  result_.skipped_samples += count;
  last_output_ = std::numeric_limits<Real>::quiet_NaN();
  steady_samples_ += injector_.steady() ? count : 0;
  phase_ = (phase_ + count) % every_;
  stage_ = Stage::done;
}

template <class Room, class... Estimators>
std::size_t BasicAxis<Room, Estimators...>::line_units() const noexcept {
  return estimator_.visit([](const auto& e) -> std::size_t {
    if constexpr (requires { e.units(); })
      return e.units();
    else
      return 0;
  });
}

/// The part of a row's work that falls to this sample; true when it was the last. While an excitation ramps,
/// lines are read for the guard, but no row is made: what was found stays.
template <class Room, class... Estimators>
bool BasicAxis<Room, Estimators...>::work() noexcept {
  const bool begins = phase_ == every_ - spread_;
  phase_ = phase_ + 1 == every_ ? 0 : phase_ + 1;
  if (begins && (result_.settled || injector_.active())) {
    stage_ = Stage::lines;
    unit_ = 0;
  }
  if (stage_ == Stage::done) return false;
  const std::uint64_t rows = result_.counts.rows;
  const std::size_t points = loop_.scans_model() ? detail::AxisLoopFigures::kMostPoints : 0;
  const std::size_t all = line_units() + 2 + points;
  const bool last = phase_ == 0;  // whatever is left is done now
  for (std::size_t n = (all + spread_ - 1) / spread_; (last || n > 0) && stage_ != Stage::done; --n)
    do_unit();
  return result_.counts.rows != rows;
}

template <class Room, class... Estimators>
void BasicAxis<Room, Estimators...>::do_unit() noexcept {
  switch (stage_) {
    case Stage::lines:
      if (unit_ < line_units()) {
        estimator_.visit([this](auto& e) {
          if constexpr (requires { e.units(); }) e.read_line(unit_, result_.settled, loop_, baseline_);
        });
        ++unit_;
        return;
      }
      stage_ = result_.settled ? Stage::model : Stage::done;
      read();
      return;
    case Stage::model: {
      const double hz = loop_.next_hz();
      if (!std::isnan(hz)) {
        loop_.point(baseline_.at(hz));
        return;
      }
      if (result_.settled) conclude();
      stage_ = Stage::done;
      return;
    }
    case Stage::done:
      return;
  }
}

template <class Room, class... Estimators>
void BasicAxis<Room, Estimators...>::read() noexcept {
  estimator_.visit([this](const auto& e) {
    if constexpr (requires { e.largest_amplitude(); }) injector_.watch(e.largest_amplitude());
  });
  if (!result_.settled) return;
  reading_ = {};
  reading_.sample = result_.samples - 1;
  reading_.wants_covariance = loop_.wanted();
  if (line_units() == 0) loop_.begin_lines();
  estimator_.visit([this](auto& e) {
    e.read(reading_, criteria_);
    e.watch(result_.stability);
  });
  loop_.begin_model(reading_);
}

template <class Room, class... Estimators>
void BasicAxis<Room, Estimators...>::conclude() noexcept {
  AxisRow row;
  row.sample = reading_.sample;
  row.lag_samples = reading_.lag_samples;
  row.parameter = reading_.parameter;
  row.resonance_hz = reading_.resonance_hz;
  row.antiresonance_hz = reading_.antiresonance_hz;
  row.resonance_damping = reading_.resonance_damping;
  row.antiresonance_damping = reading_.antiresonance_damping;
  row.driven_inertia = reading_.driven_inertia;
  row.load_inertia = reading_.load_inertia;
  row.stiffness = reading_.stiffness;
  row.coherence = reading_.coherence;
  loop_.conclude(reading_, row);
  check_.read(row);
  gates_.judge(reading_, criteria_, row, result_);
  known_ = reading_;
  result_.row = row;
  watch_.step(row, result_);
}

template <class Room, class... Estimators>
std::size_t BasicAxis<Room, Estimators...>::lines() const noexcept {
  return estimator_.visit([](const auto& e) -> std::size_t {
    if constexpr (requires { e.lines(); })
      return e.lines();
    else
      return 0;
  });
}

template <class Room, class... Estimators>
AxisLine BasicAxis<Room, Estimators...>::line(std::size_t i) const noexcept {
  return estimator_.visit([i](const auto& e) -> AxisLine {
    if constexpr (requires { e.line(i); })
      return e.line(i);
    else
      return {};
  });
}

template <class Room, class... Estimators>
bool BasicAxis<Room, Estimators...>::intact() const noexcept {
  const AxisRow& row = result_.row;
  const AxisGates& g = row.gates;
  return estimator_.holds_one() && estimator_.intact() && injector_.intact() && baseline_.intact() &&
         loop_.intact() && gates_.intact() && watch_.intact() && check_.intact() && reading_.intact() &&
         known_.intact() && every_ >= 1 && spread_ >= 1 && spread_ <= every_ && phase_ < every_ &&
         resonid::intact(output_, AxisOutput::acceleration) && resonid::intact(stage_, Stage::done) &&
         resonid::intact(row.verdict, AxisVerdict::residual_grown) &&
         resonid::intact(result_.stop_reason, StopReason::watchdog_silent) &&
         intact_flags(has_excitation_, needs_steady_, criteria_.inside_lines, result_.changed,
                      result_.injecting, result_.settled, row.controller_differs, row.trusted, g.ready,
                      g.excited, g.converged, g.physical, g.residual, g.complete, g.covered);
}

template <class Room, class... Estimators>
void BasicAxis<Room, Estimators...>::set_loop(const AxisController& controller, AxisLoop loop,
                                              double known_delay_s) noexcept {
  loop_.set_loop(controller, loop, known_delay_s);
  estimator_.visit([known_delay_s](auto& e) {
    if constexpr (requires { e.set_known_delay(known_delay_s); }) e.set_known_delay(known_delay_s);
  });
}

template <class Room, class... Estimators>
void BasicAxis<Room, Estimators...>::set_stiffness_drift(double per_s) noexcept {
  estimator_.visit([per_s](auto& e) {
    if constexpr (requires { e.set_stiffness_drift(per_s); }) e.set_stiffness_drift(per_s);
  });
}

}  // namespace resonid::online
