// SPDX-License-Identifier: MIT
#include <resonid/c/safety.h>

#include <resonid/online/excitation/guarded_excitation.hpp>
#include <resonid/online/lines/encoder.hpp>

#include "handle.hpp"

namespace resonid::c {
namespace {

using Guard = online::GuardedExcitation<double>;
using Encoder = online::EncoderVelocity<double>;
using online::StopReason;
static_assert(static_cast<int>(StopReason::watchdog_silent) == RESONID_STOP_WATCHDOG_SILENT);
static_assert(static_cast<int>(StopReason::torque) == RESONID_STOP_TORQUE);
static_assert(static_cast<int>(StopReason::signal_lost) == RESONID_STOP_SIGNAL_LOST);

/// f(C field, C++ field) for all that the two configurations hold alike.
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

struct Guards : Variants<RESONID_FAMILY_GUARD, Guard> {
  using Config = resonid_guard_config;
  using Handle = resonid_guard;

  static Config defaults() noexcept {
    Config c{};
    const online::GuardedExcitationConfig g;
    for_each_number(c, g, [](double& to, const double& from) { to = from; });
    c.torque_is_total = g.torque_is_total ? 1 : 0;
    c.oscillation_signal = static_cast<std::uint32_t>(g.oscillation_signal);
    return c;
  }
  static Config defaults_for(const Config*) noexcept { return defaults(); }
  static expected<std::uint32_t, Error> variant(const Config&) noexcept { return 0U; }
  static std::size_t size(std::uint32_t variant) noexcept { return kSize[variant]; }
  static expected<void, Error> build(void* memory, std::uint32_t variant, const Config& c) noexcept {
    const auto signal =
        enumerator("oscillation_signal", c.oscillation_signal, online::OscillationSignal::torque);
    if (!signal) return unexpected<Error>(signal.error());
    online::GuardedExcitationConfig g;
    for_each_number(c, g, [](const double& from, double& to) { to = from; });
    g.torque_is_total = c.torque_is_total != 0;
    g.oscillation_signal = *signal;
    const auto made = Guard::create(g);
    if (!made) return unexpected<Error>(made.error());
    place(memory, kFamily, variant, *made);
    return {};
  }
};

struct Encoders : Variants<RESONID_FAMILY_ENCODER, Encoder> {
  using Config = resonid_encoder_config;
  using Handle = resonid_encoder;

  static Config defaults() noexcept {
    const online::EncoderConfig e;
    Config c{};
    c.kind = static_cast<std::uint32_t>(e.kind);
    c.travel_per_turn = e.travel_per_turn;
    c.bits = e.bits;
    return c;
  }
  static Config defaults_for(const Config*) noexcept { return defaults(); }
  static expected<std::uint32_t, Error> variant(const Config&) noexcept { return 0U; }
  static std::size_t size(std::uint32_t variant) noexcept { return kSize[variant]; }
  static expected<void, Error> build(void* memory, std::uint32_t variant, const Config& c) noexcept {
    const auto kind = enumerator("kind", c.kind, online::EncoderKind::absolute_turn);
    if (!kind) return unexpected<Error>(kind.error());
    online::EncoderConfig e;
    e.sample_rate_hz = c.sample_rate_hz;
    e.kind = *kind;
    e.bits = c.bits;
    e.counts_per_turn = c.counts_per_turn;
    e.travel_per_turn = c.travel_per_turn;
    e.reversed = c.reversed != 0;
    e.largest_velocity = c.largest_velocity;
    const auto made = Encoder::create(e);
    if (!made) return unexpected<Error>(made.error());
    place(memory, kFamily, variant, *made);
    return {};
  }
};

}  // namespace
}  // namespace resonid::c

using resonid::c::Encoders;
using resonid::c::Guards;

resonid_status resonid_guard_defaults(resonid_guard_config* config, size_t struct_size) noexcept {
  return resonid::c::give_defaults(Guards::defaults(), config, struct_size);
}
size_t resonid_guard_size(const resonid_guard_config* config) noexcept {
  return resonid::c::size_of<Guards>(config);
}
resonid_status resonid_guard_init(void* memory, size_t size, const resonid_guard_config* config,
                                  resonid_guard** handle, resonid_error* error) noexcept {
  return resonid::c::init<Guards>(memory, size, config, handle, error);
}
resonid_status resonid_guard_create(const resonid_guard_config* config, resonid_guard** handle,
                                    resonid_error* error) noexcept {
  return resonid::c::create<Guards>(config, handle, error);
}
resonid_status resonid_guard_step(resonid_guard* handle, double excitation, double torque, double velocity,
                                  double position, double* injected) noexcept {
  if (injected == nullptr) return RESONID_ERROR_NULL;
  *injected = 0.0;  // whatever is wrong, nothing is injected
  return Guards::visit(handle, [&](auto& guard) {
    *injected = guard.step(excitation, {torque, velocity, position});
  });
}
resonid_status resonid_guard_miss(resonid_guard* handle, uint64_t count) noexcept {
  return Guards::visit(handle, [&](auto& guard) { guard.miss(count); });
}
resonid_status resonid_guard_watch(resonid_guard* handle, double amplitude) noexcept {
  return Guards::visit(handle, [&](auto& guard) { guard.watch(amplitude); });
}
resonid_status resonid_guard_stop(resonid_guard* handle) noexcept {
  return Guards::visit(handle, [](auto& guard) { guard.stop(); });
}
resonid_status resonid_guard_acknowledge(resonid_guard* handle, uint32_t* accepted) noexcept {
  if (accepted == nullptr) return RESONID_ERROR_NULL;
  return Guards::visit(handle, [&](auto& guard) { *accepted = guard.acknowledge() ? 1 : 0; });
}
resonid_status resonid_guard_reset(resonid_guard* handle) noexcept {
  return Guards::visit(handle, [](auto& guard) { guard.reset(); });
}
resonid_status resonid_guard_get_info(const resonid_guard* handle, resonid_guard_info* info,
                                      size_t struct_size) noexcept {
  resonid_guard_info found{};
  const resonid_status status = Guards::visit(handle, [&](const auto& guard) {
    found.reason = static_cast<std::uint32_t>(guard.reason());
    found.tripped = guard.tripped() ? 1 : 0;
    found.stopped = guard.stopped() ? 1 : 0;
    found.steady = guard.steady() ? 1 : 0;
    found.stop_sample = guard.report().sample;
    found.stop_value = guard.report().value;
    found.stop_limit = guard.report().limit;
    found.gain = guard.gain();
    found.injected = guard.injected();
    found.oscillation = guard.oscillation();
    found.oscillation_threshold = guard.oscillation_threshold();
    found.samples = guard.samples();
    found.skipped_samples = guard.skipped_samples();
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
const char* resonid_stop_reason_string(uint32_t reason) noexcept {
  if (reason > RESONID_STOP_WATCHDOG_SILENT) return "unknown";
  return to_words(static_cast<resonid::online::StopReason>(reason)).data();  // of literals
}

resonid_status resonid_encoder_defaults(resonid_encoder_config* config, size_t struct_size) noexcept {
  return resonid::c::give_defaults(Encoders::defaults(), config, struct_size);
}
size_t resonid_encoder_size(const resonid_encoder_config* config) noexcept {
  return resonid::c::size_of<Encoders>(config);
}
resonid_status resonid_encoder_init(void* memory, size_t size, const resonid_encoder_config* config,
                                    resonid_encoder** handle, resonid_error* error) noexcept {
  return resonid::c::init<Encoders>(memory, size, config, handle, error);
}
resonid_status resonid_encoder_create(const resonid_encoder_config* config, resonid_encoder** handle,
                                      resonid_error* error) noexcept {
  return resonid::c::create<Encoders>(config, handle, error);
}
resonid_status resonid_encoder_step(resonid_encoder* handle, uint64_t raw, double* velocity) noexcept {
  return Encoders::visit(handle, [&](auto& encoder) {
    encoder.step(raw);
    if (velocity != nullptr) *velocity = encoder.velocity();
  });
}
resonid_status resonid_encoder_miss(resonid_encoder* handle, uint64_t count) noexcept {
  return Encoders::visit(handle, [&](auto& encoder) { encoder.miss(count); });
}
resonid_status resonid_encoder_set_position(resonid_encoder* handle, int64_t counts) noexcept {
  return Encoders::visit(handle, [&](auto& encoder) { encoder.set_position_counts(counts); });
}
resonid_status resonid_encoder_reset(resonid_encoder* handle) noexcept {
  return Encoders::visit(handle, [](auto& encoder) { encoder.reset(); });
}
resonid_status resonid_encoder_get_info(const resonid_encoder* handle, resonid_encoder_info* info,
                                        size_t struct_size) noexcept {
  resonid_encoder_info found{};
  const resonid_status status = Encoders::visit(handle, [&](const auto& encoder) {
    found.certain = encoder.certain() ? 1 : 0;
    found.position_counts = encoder.position_counts();
    found.position = encoder.position();
    found.velocity = encoder.velocity();
    found.held_velocity = encoder.held_velocity();
    found.resolution = encoder.resolution();
    found.samples = encoder.samples();
    found.skipped_samples = encoder.skipped_samples();
    found.implausible_samples = encoder.implausible_samples();
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
