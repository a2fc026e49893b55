// SPDX-License-Identifier: MIT
#include <resonid/c/excitation.h>

#include <resonid/online/excitation/guarded_excitation.hpp>

#include "handle.hpp"

namespace resonid::c {
namespace {

using Guard = online::GuardedExcitation<double>;
using online::StopReason;
static_assert(static_cast<int>(StopReason::watchdog_silent) == RESONID_STOP_WATCHDOG_SILENT);
static_assert(static_cast<int>(StopReason::torque) == RESONID_STOP_TORQUE);
static_assert(static_cast<int>(StopReason::signal_lost) == RESONID_STOP_SIGNAL_LOST);

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

struct Guards : Variants<Guards, Guard> {
  using Settings = resonid_guard_settings;
  using Results = resonid_guard_results;
  static constexpr std::uint32_t kId = family_of(RESONID_GUARD), kTypes = 1;

  static Settings defaults(std::uint32_t) noexcept {
    Settings s{};
    const online::GuardedExcitationConfig g;
    for_each_number(s, g, [](double& to, const double& from) { to = from; });
    s.torque_is_total = g.torque_is_total ? 1 : 0;
    s.oscillation_signal = static_cast<std::uint32_t>(g.oscillation_signal);
    return s;
  }
  static expected<std::uint32_t> variant(const Settings&) noexcept { return 0U; }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    const auto signal =
        enumerator("oscillation_signal", s.oscillation_signal, online::OscillationSignal::torque);
    if (!signal) return unexpected<Error>(signal.error());
    online::GuardedExcitationConfig g;
    for_each_number(s, g, [](const double& from, double& to) { to = from; });
    g.torque_is_total = s.torque_is_total != 0;
    g.oscillation_signal = *signal;
    return place(memory, s.head.kind, variant, Guard::create(g));
  }
  static void results(const Guard& guard, Results& r) noexcept {
    r.samples = guard.samples();
    r.skipped_samples = guard.skipped_samples();
    r.reason = static_cast<std::uint32_t>(guard.reason());
    r.tripped = guard.tripped() ? 1 : 0;
    r.stopped = guard.stopped() ? 1 : 0;
    r.steady = guard.steady() ? 1 : 0;
    r.stop_sample = guard.report().sample;
    r.stop_value = guard.report().value;
    r.stop_limit = guard.report().limit;
    r.gain = guard.gain();
    r.injected = guard.injected();
    r.oscillation = guard.oscillation();
    r.oscillation_threshold = guard.oscillation_threshold();
  }
};

}  // namespace

const Family kGuard = FamilyOf<Guards>::kFamily;

}  // namespace resonid::c

using resonid::c::Guards;

resonid_status resonid_guard_step(resonid_handle* guard, double excitation, double torque, double velocity,
                                  double position, double* injected) noexcept {
  if (injected == nullptr) return RESONID_ERROR_NULL;
  *injected = 0.0;  // whatever is wrong, nothing is injected
  return Guards::visit(guard, [&](auto& g) { *injected = g.step(excitation, {torque, velocity, position}); });
}
resonid_status resonid_watch(resonid_handle* guard, double amplitude) noexcept {
  return Guards::visit(guard, [&](auto& g) { g.watch(amplitude); });
}
resonid_status resonid_stop(resonid_handle* guard) noexcept {
  return Guards::visit(guard, [](auto& g) { g.stop(); });
}
resonid_status resonid_acknowledge(resonid_handle* guard, uint32_t* accepted) noexcept {
  if (accepted == nullptr) return RESONID_ERROR_NULL;
  return Guards::visit(guard, [&](auto& g) { *accepted = g.acknowledge() ? 1 : 0; });
}
const char* resonid_stop_reason_string(uint32_t reason) noexcept {
  if (reason > RESONID_STOP_WATCHDOG_SILENT) return "unknown";
  return to_words(static_cast<resonid::online::StopReason>(reason)).data();  // of literals
}
