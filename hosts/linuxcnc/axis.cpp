// SPDX-License-Identifier: MIT
#include "axis.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace resonid::linuxcnc {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

/// LinuxCNC's pid: P + I Ts/(1 - z^-1) + D (1 - z^-1)/Ts.
online::AxisController pid(const resonid_axis_settings& s, double period_s) noexcept {
  const double i = s.igain * period_s, d = s.dgain / period_s;
  const std::array<double, 3> numerator{s.pgain + i + d, -s.pgain - 2.0 * d, d};
  const std::array<double, 2> denominator{1.0, -1.0};
  return *online::AxisController::create(numerator, denominator, s.loop == RESONID_LOOP_POSITION_PID);
}

bool same_loop(const resonid_axis_settings& a, const resonid_axis_settings& b) noexcept {
  return a.loop == b.loop && a.pgain == b.pgain && a.igain == b.igain && a.dgain == b.dgain &&
         a.delay_s == b.delay_s;
}

}  // namespace

expected<Axis, Error> Axis::create(const resonid_axis_shape& shape) {
  if (!(shape.period_s > 0.0)) return refuse("period", "must be > 0", shape.period_s);
  if (shape.lines < 3 || shape.lines > RESONID_MAX_LINES)
    return refuse("lines", "must be 3 to 40 of them", shape.lines);
  if (!(shape.last_hz > shape.first_hz))
    return refuse("lines", "must end above where they begin", shape.last_hz);
  const auto lines = static_cast<std::size_t>(shape.lines);
  std::array<double, RESONID_MAX_LINES> frequency{};
  for (std::size_t i = 0; i < lines; ++i)
    frequency[i] = shape.first_hz +
                   (shape.last_hz - shape.first_hz) * static_cast<double>(i) / static_cast<double>(lines - 1);
  // A line of the bank forgets as (1 - K/2)^k with K = 1/(lines + 1 + lambda).
  const double memory_samples = shape.memory_s / shape.period_s;
  const double states = static_cast<double>(lines + 1);
  if (!(memory_samples > states))
    return refuse("memory", "must be longer than a period per line", shape.memory_s);
  online::AxisConfig c;
  c.sample_rate_hz = 1.0 / shape.period_s;
  c.method = online::AxisMethod::lines;
  c.lines_hz = std::span(frequency).first(lines);
  c.lambda = 0.5 * memory_samples - states;
  c.loop = online::AxisLoop::measured;
  c.row_every_samples = c.spread_samples = lines + 2;
  c.criteria.inside_lines = true;
  c.injects = true;
  const auto engine = Engine::create(c);
  if (!engine) return unexpected<Error>(engine.error());
  if (!engine->settles()) return refuse("memory", "is too long for trackers to settle", shape.memory_s);
  return Axis(shape, *engine);
}

Axis::Axis(const resonid_axis_shape& shape, const Engine& engine) noexcept : shape_(shape), engine_(engine) {
  forget();
}

void Axis::forget() noexcept {
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
}

double Axis::excite(const resonid_axis_settings& settings, const resonid_axis_sample& sample) noexcept {
  const bool enable = sample.enable != 0, reset = sample.reset != 0;
  if (reset && !was_reset_) {
    engine_.reset();
    forget();
  }
  const bool tripped = online::is_trip(engine_.result().stop_reason);
  const bool ramping_out = engine_.injecting() && engine_.result().stop_reason != online::StopReason::none;
  if (enable && !was_enabled_ && !engine_.injecting() && !tripped) start(settings);
  if (!enable) engine_.stop();
  // Enabled again while it still ramps out: that waits for the end of the ramp.
  was_enabled_ = enable && (was_enabled_ || !ramping_out || tripped);
  was_reset_ = reset;
  const bool valid = sample.valid != 0;
  const double excitation = engine_.excite({.torque = sample.control,
                                            .velocity = valid ? sample.velocity : kAbsent,
                                            .position = valid ? sample.position : kAbsent});
  results_.running = engine_.injecting() ? 1 : 0;
  results_.stop_reason = static_cast<int>(engine_.result().stop_reason);
  return excitation;
}

/// A refusal leaves no guard, and so no excitation.
void Axis::start(const resonid_axis_settings& settings) noexcept {
  using Kind = online::AxisInjection::Kind;
  forget();
  online::AxisInjection what;
  what.kind = settings.excitation == RESONID_CHIRP  ? Kind::chirp
              : settings.excitation == RESONID_PRBS ? Kind::prbs
                                                    : Kind::multisine;
  what.sweep_s = settings.sweep_s;
  what.guard = {.amplitude = settings.amplitude,
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
                .watch_limit = settings.max_line_velocity};
  const bool known_kind = settings.excitation >= RESONID_MULTISINE && settings.excitation <= RESONID_PRBS;
  if (!known_kind || !engine_.start(what)) {
    engine_.reset();
    results_.trust_reason = RESONID_REFUSED;
  }
}

/// What may be set at any time.
void Axis::follow(const resonid_axis_settings& settings) noexcept {
  online::AxisCriteria criteria;
  criteria.inside_lines = true;
  criteria.resonance_std = settings.max_std;
  criteria.antiresonance_std = 2.0 * settings.max_std;
  engine_.set_criteria(criteria);
  if (same_loop(settings, followed_)) return;
  followed_ = settings;
  engine_.set_loop(pid(settings, shape_.period_s),
                   settings.loop == RESONID_LOOP_MEASURED ? online::AxisLoop::measured
                                                          : online::AxisLoop::controller_at_lines,
                   settings.delay_s);
}

void Axis::identify(const resonid_axis_settings& settings, const resonid_axis_sample& sample) noexcept {
  if (!engine_.injecting()) {
    results_.settled = 0;
    if (online::is_trip(engine_.result().stop_reason)) {
      results_.trusted = 0;
      results_.trust_reason = RESONID_STOPPED;
    }
    return;  // what was found stays
  }
  follow(settings);
  const bool valid = sample.valid != 0 && std::isfinite(sample.torque) && std::isfinite(sample.velocity);
  if (engine_.step({engine_.injected(), valid ? sample.torque : kAbsent, valid ? sample.velocity : kAbsent}))
    take_row();
  const auto& r = engine_.result();
  results_.samples = static_cast<std::uint32_t>(r.samples);
  results_.skipped_samples = static_cast<std::uint32_t>(r.skipped_samples);
  results_.settled = r.settled ? 1 : 0;
  if (results_.updates == 0) results_.trust_reason = RESONID_NOT_SETTLED;
}

void Axis::take_row() noexcept {
  const auto& row = engine_.row();
  resonid_axis_results& r = results_;
  r.resonance_hz = row.resonance_hz.value;
  r.resonance_std_hz = row.resonance_hz.std;
  r.resonance_damping = row.resonance_damping;
  r.antiresonance_hz = row.antiresonance_hz.value;
  r.antiresonance_std_hz = row.antiresonance_hz.std;
  r.antiresonance_damping = row.antiresonance_damping;
  r.motor_inertia = row.driven_inertia;
  r.load_inertia = row.load_inertia;
  r.stiffness = row.stiffness;
  r.crossover_hz = row.crossover_hz.value;
  r.phase_margin_deg = row.phase_margin_deg.value;
  r.phase_margin_std_deg = row.phase_margin_deg.std;
  r.worst_phase_margin_deg = row.worst_phase_margin_deg;
  r.modulus_margin = row.modulus_margin.value;
  r.modulus_margin_std = row.modulus_margin.std;
  r.modulus_margin_hz = row.modulus_margin_hz;
  r.gain_margin_db = row.gain_margin_db;
  r.gain_margin_hz = row.gain_margin_hz;
  r.coherence = row.coherence;
  r.updates = static_cast<std::uint32_t>(engine_.result().counts.rows);
  r.trust_reason = verdict();
  r.trusted = r.trust_reason == RESONID_TRUSTED ? 1 : 0;
}

resonid_trust Axis::verdict() const noexcept {
  const auto& row = engine_.row();
  if (!row.gates.complete) return RESONID_SAMPLES_MISSING;
  if (!(row.resonance_damping > 0.0) || !(row.resonance_hz.value > row.antiresonance_hz.value))
    return RESONID_NO_RESONANCE;
  if (!row.gates.covered) return RESONID_OUTSIDE_THE_LINES;
  return row.trusted ? RESONID_TRUSTED : RESONID_UNCERTAIN;
}

}  // namespace resonid::linuxcnc
