// SPDX-License-Identifier: MIT
#include <resonid/c/excitation.h>

#include <resonid/online/excitation/chirp.hpp>
#include <resonid/online/excitation/multisine.hpp>
#include <resonid/online/excitation/prbs.hpp>
#include <resonid/online/excitation/stepped_sine.hpp>

#include "handle.hpp"

namespace resonid::c {
namespace {

using online::Chirp;
using online::Prbs;
using Multisine = online::Multisine<RESONID_EXCITATION_MAX_LINES>;
using SteppedSine = online::SteppedSine<RESONID_EXCITATION_MAX_LINES>;

resonid_excitation_config excitation_defaults(std::uint32_t kind) noexcept {
  resonid_excitation_config c{};
  c.kind = kind;
  c.amplitude = 1.0;
  c.register_length = 10;
  c.clock_divider = 1;
  c.start_state = 1;
  c.phases = RESONID_PHASES_SCHROEDER;
  c.sweep = RESONID_SWEEP_LINEAR;
  c.seed = 1;
  c.first_phase_rad = online::kSchroederStart;
  const online::SteppedSineConfig stepped;
  c.settle_periods = stepped.settle_periods;
  c.measure_periods = stepped.measure_periods;
  return c;
}

struct Excitations : Variants<RESONID_FAMILY_EXCITATION, Prbs, Multisine, Chirp, SteppedSine> {
  using Config = resonid_excitation_config;
  using Handle = resonid_excitation;

  static Config defaults_for(const Config* given) noexcept {
    return excitation_defaults(second_field(given));
  }
  static expected<std::uint32_t, Error> variant(const Config& c) noexcept {
    if (c.kind >= kCount) return refuse("kind", "must be one of its constants", c.kind);
    return c.kind;
  }
  static std::size_t size(std::uint32_t variant) noexcept { return kSize[variant]; }
  static expected<void, Error> build(void* memory, std::uint32_t kind, const Config& c) noexcept {
    switch (kind) {
      case RESONID_PRBS:
        return put(
            memory, kind,
            Prbs::create({c.sample_rate_hz, c.amplitude, c.register_length, c.clock_divider, c.start_state}));
      case RESONID_MULTISINE:
        return multisine(memory, c);
      case RESONID_CHIRP:
        return chirp(memory, c);
      default:
        return put(memory, kind,
                   SteppedSine::create({c.sample_rate_hz, array(c.lines_hz, c.lines), c.amplitude,
                                        c.settle_periods, c.measure_periods}));
    }
  }

 private:
  template <class T>
  static expected<void, Error> put(void* memory, std::uint32_t kind,
                                   const expected<T, Error>& made) noexcept {
    if (!made) return unexpected<Error>(made.error());
    place(memory, kFamily, kind, *made);
    return {};
  }
  static expected<void, Error> chirp(void* memory, const Config& c) noexcept {
    const auto sweep = enumerator("sweep", c.sweep, online::Sweep::logarithmic);
    if (!sweep) return unexpected<Error>(sweep.error());
    return put(memory, RESONID_CHIRP,
               Chirp::create({c.sample_rate_hz, c.amplitude, c.from_hz, c.to_hz, c.duration_s, *sweep,
                              c.repeat != 0, c.phase_rad}));
  }
  static expected<void, Error> multisine(void* memory, const Config& c) noexcept {
    const auto phases = enumerator("phases", c.phases, online::Phases::given);
    if (!phases) return unexpected<Error>(phases.error());
    online::MultisineConfig m;
    m.sample_rate_hz = c.sample_rate_hz;
    m.frequency_hz = array(c.lines_hz, c.lines);
    m.amplitude = c.line_amplitudes != nullptr ? array(c.line_amplitudes, c.lines) : array(&c.amplitude, 1);
    m.phases = *phases;
    m.phase_rad = array(c.phases_rad, c.lines);
    m.seed = c.seed;
    m.first_phase_rad = c.first_phase_rad;
    auto made = Multisine::create(m);
    if (!made && made.error().field == "phase_rad") made.error().field = "phases_rad";
    if (!made && made.error().field == "amplitude" && c.line_amplitudes != nullptr)
      made.error().field = "line_amplitudes";
    return put(memory, RESONID_MULTISINE, made);
  }
};

void describe(const Prbs& g, resonid_excitation_info& info) noexcept {
  info.length_samples = info.period_samples = g.period_samples();
}
void describe(const Multisine& g, resonid_excitation_info& info) noexcept {
  info.lines = static_cast<std::uint32_t>(g.lines());
  info.length_samples = info.period_samples = g.period_samples();
}
void describe(const Chirp& g, resonid_excitation_info& info) noexcept {
  info.length_samples = g.length_samples();
  info.period_samples = g.config().repeat ? g.length_samples() : 0;
}
void describe(const SteppedSine& g, resonid_excitation_info& info) noexcept {
  info.lines = static_cast<std::uint32_t>(g.lines());
  info.length_samples = g.length_samples();
  info.line = static_cast<std::uint32_t>(g.line());
  info.measuring = g.measuring() ? 1 : 0;
}

}  // namespace
}  // namespace resonid::c

using resonid::c::Excitations;

resonid_status resonid_excitation_defaults(resonid_excitation_config* config, size_t struct_size,
                                           uint32_t kind) noexcept {
  if (kind >= Excitations::kCount) return RESONID_ERROR_RANGE;
  return resonid::c::give_defaults(resonid::c::excitation_defaults(kind), config, struct_size);
}
size_t resonid_excitation_size(const resonid_excitation_config* config) noexcept {
  return resonid::c::size_of<Excitations>(config);
}
resonid_status resonid_excitation_init(void* memory, size_t size, const resonid_excitation_config* config,
                                       resonid_excitation** handle, resonid_error* error) noexcept {
  return resonid::c::init<Excitations>(memory, size, config, handle, error);
}
resonid_status resonid_excitation_create(const resonid_excitation_config* config, resonid_excitation** handle,
                                         resonid_error* error) noexcept {
  return resonid::c::create<Excitations>(config, handle, error);
}
resonid_status resonid_excitation_step(resonid_excitation* handle, double* sample) noexcept {
  if (sample == nullptr) return RESONID_ERROR_NULL;
  return Excitations::visit(handle, [&](auto& generator) { *sample = generator.step(); });
}
resonid_status resonid_excitation_fill(resonid_excitation* handle, double* samples, size_t count) noexcept {
  if (samples == nullptr && count > 0) return RESONID_ERROR_NULL;
  return Excitations::visit(handle, [&](auto& generator) { generator.fill({samples, count}); });
}
resonid_status resonid_excitation_reset(resonid_excitation* handle) noexcept {
  return Excitations::visit(handle, [](auto& generator) { generator.reset(); });
}
resonid_status resonid_excitation_get_info(const resonid_excitation* handle, resonid_excitation_info* info,
                                           size_t struct_size) noexcept {
  resonid_excitation_info found{};
  const resonid_status status = Excitations::visit(handle, [&](const auto& generator) {
    resonid::c::describe(generator, found);
    found.low_hz = generator.band().low_hz;
    found.high_hz = generator.band().high_hz;
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
