// SPDX-License-Identifier: MIT
#include <resonid/c/detail/excitation.h>

#include <resonid/online/excitation/guarded_excitation.hpp>

#include "guard_config.hpp"
#include "handle.hpp"

namespace resonid::c {
namespace {

using Guard = online::GuardedExcitation<double>;
using online::StopReason;
static_assert(static_cast<int>(StopReason::watchdog_silent) == RESONID_STOP_WATCHDOG_SILENT);
static_assert(static_cast<int>(StopReason::torque) == RESONID_STOP_TORQUE);
static_assert(static_cast<int>(StopReason::signal_lost) == RESONID_STOP_SIGNAL_LOST);

struct Guards : Variants<Guards, Guard> {
  using Settings = resonid_guard_settings;
  using Results = resonid_guard_results;
  static constexpr std::uint32_t kId = family_of(RESONID_GUARD), kTypes = 1;

  static Settings defaults(std::uint32_t kind) noexcept { return GuardDefaults::defaults(kind); }
  static expected<std::uint32_t> variant(const Settings&) noexcept { return 0U; }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    const auto g = guard_config(s);
    if (!g) return unexpected<Error>(g.error());
    return place(memory, s.head.kind, variant, Guard::create(*g));
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
  if (resonid::c::family_of(resonid_kind(guard)) == resonid::c::family_of(RESONID_AXIS_ARX))
    return resonid::c::stop_axis(guard);
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
