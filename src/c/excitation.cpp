// SPDX-License-Identifier: MIT
#include <resonid/c/detail/excitation.h>

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

void describe(const Prbs& g, resonid_excitation_results& r) noexcept {
  r.length_samples = r.period_samples = g.period_samples();
}
void describe(const Multisine& g, resonid_excitation_results& r) noexcept {
  r.lines = static_cast<std::uint32_t>(g.lines());
  r.length_samples = r.period_samples = g.period_samples();
}
void describe(const Chirp& g, resonid_excitation_results& r) noexcept {
  r.length_samples = g.length_samples();
  r.period_samples = g.config().repeat ? g.length_samples() : 0;
}
void describe(const SteppedSine& g, resonid_excitation_results& r) noexcept {
  r.lines = static_cast<std::uint32_t>(g.lines());
  r.length_samples = g.length_samples();
  r.line = static_cast<std::uint32_t>(g.line());
  r.measuring = g.measuring() ? 1 : 0;
}

struct Excitations : Variants<Excitations, Prbs, Multisine, Chirp, SteppedSine> {
  using Settings = resonid_excitation_settings;
  using Results = resonid_excitation_results;
  static constexpr std::uint32_t kId = family_of(RESONID_PRBS), kTypes = 4;

  static Settings defaults(std::uint32_t) noexcept {
    const online::SteppedSineConfig stepped;
    Settings s{};
    s.amplitude = 1.0;
    s.register_length = 10;
    s.clock_divider = 1;
    s.start_state = 1;
    s.phases = RESONID_PHASES_SCHROEDER;
    s.sweep = RESONID_SWEEP_LINEAR;
    s.seed = 1;
    s.first_phase_rad = online::kSchroederStart;
    s.settle_periods = stepped.settle_periods;
    s.measure_periods = stepped.measure_periods;
    return s;
  }
  static expected<std::uint32_t> variant(const Settings& s) noexcept { return type_of(s.head.kind); }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    const std::uint32_t kind = s.head.kind;
    switch (kind) {
      case RESONID_PRBS:
        return place(
            memory, kind, variant,
            Prbs::create({s.sample_rate_hz, s.amplitude, s.register_length, s.clock_divider, s.start_state}));
      case RESONID_MULTISINE:
        return multisine(memory, variant, s);
      case RESONID_CHIRP:
        return chirp(memory, variant, s);
      default:
        return place(memory, kind, variant,
                     SteppedSine::create({s.sample_rate_hz, array(s.lines_hz, s.lines), s.amplitude,
                                          s.settle_periods, s.measure_periods}));
    }
  }
  template <class Generator>
  static void results(const Generator& generator, Results& r) noexcept {
    describe(generator, r);
    r.low_hz = generator.band().low_hz;
    r.high_hz = generator.band().high_hz;
  }

 private:
  static expected<void> chirp(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    const auto sweep = enumerator("sweep", s.sweep, online::Sweep::logarithmic);
    if (!sweep) return unexpected<Error>(sweep.error());
    return place(memory, s.head.kind, variant,
                 Chirp::create({s.sample_rate_hz, s.amplitude, s.from_hz, s.to_hz, s.duration_s, *sweep,
                                s.repeat != 0, s.phase_rad}));
  }
  static expected<void> multisine(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    const auto phases = enumerator("phases", s.phases, online::Phases::given);
    if (!phases) return unexpected<Error>(phases.error());
    online::MultisineConfig m;
    m.sample_rate_hz = s.sample_rate_hz;
    m.frequency_hz = array(s.lines_hz, s.lines);
    m.amplitude = s.line_amplitudes != nullptr ? array(s.line_amplitudes, s.lines) : array(&s.amplitude, 1);
    m.phases = *phases;
    m.phase_rad = array(s.phases_rad, s.lines);
    m.seed = s.seed;
    m.first_phase_rad = s.first_phase_rad;
    auto made = Multisine::create(m);
    if (!made && made.error().field == "phase_rad") made.error().field = "phases_rad";
    if (!made && made.error().field == "amplitude" && s.line_amplitudes != nullptr)
      made.error().field = "line_amplitudes";
    return place(memory, s.head.kind, variant, made);
  }
};

}  // namespace

const Family kExcitation = FamilyOf<Excitations>::kFamily;

}  // namespace resonid::c

resonid_status resonid_generate(resonid_handle* excitation, double* samples, size_t count) noexcept {
  if (samples == nullptr && count > 0) return RESONID_ERROR_NULL;
  return resonid::c::Excitations::visit(excitation, [&](auto& generator) {
    generator.fill({samples, count});
  });
}
