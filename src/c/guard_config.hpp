// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/c/detail/excitation.h>

#include <resonid/online/excitation/detail/guarded_excitation_config.hpp>

#include "handle.hpp"

namespace resonid::c {

/// f(C field, C++ field) for all numbers that both hold alike.
template <class C, class Config, class F>
void for_each_number(C& c, Config& g, F&& f) noexcept {
  f(c.sample_rate_hz, g.sample_rate_hz);
  f(c.amplitude, g.amplitude);
  f(c.ramp_in_s, g.ramp_in_s);
  f(c.ramp_out_s, g.ramp_out_s);
  f(c.trip_ramp_s, g.trip_ramp_s);
  f(c.duration_s, g.duration_s);
  f(c.margin, g.margin);
  f(c.torque_limit, g.torque_limit);
  f(c.velocity_limit, g.velocity_limit);
  f(c.position_low, g.position_low);
  f(c.position_high, g.position_high);
  f(c.deceleration, g.deceleration);
  f(c.largest_acceleration, g.largest_acceleration);
  f(c.reaction_s, g.reaction_s);
  f(c.oscillation_from_hz, g.oscillation_from_hz);
  f(c.oscillation_least, g.oscillation_least);
  f(c.oscillation_expected, g.oscillation_expected);
  f(c.oscillation_growth, g.oscillation_growth);
  f(c.oscillation_window_s, g.oscillation_window_s);
  f(c.oscillation_learn_s, g.oscillation_learn_s);
  f(c.lost_s, g.lost_s);
  f(c.watch_limit, g.watch_limit);
  f(c.watch_timeout_s, g.watch_timeout_s);
}

struct GuardDefaults {
  using Settings = resonid_guard_settings;
  static Settings defaults(std::uint32_t) noexcept {
    Settings s{};
    const online::GuardedExcitationConfig g;
    for_each_number(s, g, [](double& to, const double& from) { to = from; });
    s.torque_is_total = g.torque_is_total ? 1 : 0;
    s.oscillation_signal = static_cast<std::uint32_t>(g.oscillation_signal);
    return s;
  }
};

inline expected<online::GuardedExcitationConfig> guard_config(const resonid_guard_settings& s) noexcept {
  const auto signal =
      enumerator("oscillation_signal", s.oscillation_signal, online::OscillationSignal::torque);
  if (!signal) return unexpected<Error>(signal.error());
  online::GuardedExcitationConfig g;
  for_each_number(s, g, [](const double& from, double& to) { to = from; });
  g.torque_is_total = s.torque_is_total != 0;
  g.oscillation_signal = *signal;
  return g;
}

}  // namespace resonid::c
