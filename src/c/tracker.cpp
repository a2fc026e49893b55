// SPDX-License-Identifier: MIT
#include <cmath>

#include "handle.hpp"
#include "tracker_config.hpp"

namespace resonid::c {

expected<TrackerType, Error> tracker_type(const resonid_tracker_config& c) noexcept {
  switch (c.kind) {
    case RESONID_KALMAN_BANK:
      return TrackerType::kalman_bank;
    case RESONID_SLIDING_DFT:
      return c.window_samples <= kShortWindow ? TrackerType::short_dft : TrackerType::long_dft;
    case RESONID_CHIRP_TRACKER:
      return TrackerType::chirp;
    default:
      return refuse("kind", "must be one of its constants", c.kind);
  }
}

resonid_tracker_config tracker_defaults(std::uint32_t kind) noexcept {
  const online::KalmanBankConfig bank;
  const online::ChirpTrackerConfig chirp;
  const bool follows = kind == RESONID_CHIRP_TRACKER;
  resonid_tracker_config c{};
  c.kind = kind;
  c.offset = (follows ? chirp.offset : bank.offset) ? 1 : 0;
  c.lambda = follows ? chirp.lambda : bank.lambda;
  c.pole_radius = bank.pole_radius;
  return c;
}

template <>
expected<KalmanBank, Error> make_tracker(const resonid_tracker_config& c) noexcept {
  const auto gain = enumerator("gain", c.gain, online::GainRule::placed_poles);
  if (!gain) return unexpected<Error>(gain.error());
  return KalmanBank::create(
      {c.sample_rate_hz, array(c.frequency_hz, c.lines), c.offset != 0, *gain, c.lambda, c.pole_radius});
}

namespace {

template <class Dft>
expected<Dft, Error> make_dft(const resonid_tracker_config& c) noexcept {
  const auto window = enumerator("window", c.window, online::DftWindow::hann);
  if (!window) return unexpected<Error>(window.error());
  return Dft::create({c.sample_rate_hz, c.window_samples, array(c.frequency_hz, c.lines), *window});
}

}  // namespace

template <>
expected<ShortDft, Error> make_tracker(const resonid_tracker_config& c) noexcept {
  return make_dft<ShortDft>(c);
}
template <>
expected<LongDft, Error> make_tracker(const resonid_tracker_config& c) noexcept {
  return make_dft<LongDft>(c);
}
template <>
expected<ChirpTracker, Error> make_tracker(const resonid_tracker_config& c) noexcept {
  const auto gain = enumerator("gain", c.gain, online::GainRule::placed_poles);
  if (!gain) return unexpected<Error>(gain.error());
  const auto sweep = enumerator("sweep", c.sweep, online::Sweep::logarithmic);
  if (!sweep) return unexpected<Error>(sweep.error());
  return ChirpTracker::create({c.sample_rate_hz, c.from_hz, c.to_hz, c.duration_s, *sweep, c.offset != 0,
                               *gain, c.lambda, c.pole_radius});
}

namespace {

struct Trackers : Variants<RESONID_FAMILY_TRACKER, KalmanBank, ShortDft, LongDft, ChirpTracker> {
  using Config = resonid_tracker_config;
  using Handle = resonid_tracker;

  static Config defaults_for(const Config* given) noexcept { return tracker_defaults(second_field(given)); }
  static expected<std::uint32_t, Error> variant(const Config& c) noexcept {
    return tracker_type(c).map([](TrackerType type) { return static_cast<std::uint32_t>(type); });
  }
  static std::size_t size(std::uint32_t variant) noexcept { return kSize[variant]; }
  static expected<void, Error> build(void* memory, std::uint32_t variant, const Config& c) noexcept {
    return with_tracker(static_cast<TrackerType>(variant), c, [&](const auto& made) {
      place(memory, kFamily, variant, made);
      return expected<void, Error>{};
    });
  }
};

}  // namespace
}  // namespace resonid::c

using resonid::c::Trackers;

resonid_status resonid_tracker_defaults(resonid_tracker_config* config, size_t struct_size,
                                        uint32_t kind) noexcept {
  if (kind > RESONID_CHIRP_TRACKER) return RESONID_ERROR_RANGE;
  return resonid::c::give_defaults(resonid::c::tracker_defaults(kind), config, struct_size);
}
size_t resonid_tracker_size(const resonid_tracker_config* config) noexcept {
  return resonid::c::size_of<Trackers>(config);
}
resonid_status resonid_tracker_init(void* memory, size_t size, const resonid_tracker_config* config,
                                    resonid_tracker** handle, resonid_error* error) noexcept {
  return resonid::c::init<Trackers>(memory, size, config, handle, error);
}
resonid_status resonid_tracker_create(const resonid_tracker_config* config, resonid_tracker** handle,
                                      resonid_error* error) noexcept {
  return resonid::c::create<Trackers>(config, handle, error);
}
resonid_status resonid_tracker_step(resonid_tracker* handle, double sample) noexcept {
  return Trackers::visit(handle, [&](auto& tracker) { tracker.step(sample); });
}
resonid_status resonid_tracker_run(resonid_tracker* handle, const double* samples, size_t count) noexcept {
  if (samples == nullptr && count > 0) return RESONID_ERROR_NULL;
  return Trackers::visit(handle, [&](auto& tracker) {
    for (std::size_t k = 0; k < count; ++k) tracker.step(samples[k]);
  });
}
resonid_status resonid_tracker_miss(resonid_tracker* handle, uint64_t count) noexcept {
  return Trackers::visit(handle, [&](auto& tracker) { tracker.miss(count); });
}
resonid_status resonid_tracker_reset(resonid_tracker* handle) noexcept {
  return Trackers::visit(handle, [](auto& tracker) { tracker.reset(); });
}
resonid_status resonid_tracker_phasors(const resonid_tracker* handle, resonid_complex* phasor,
                                       size_t count) noexcept {
  return Trackers::visit(handle, [&](const auto& tracker) -> resonid_status {
    if (const resonid_status status = resonid::c::check_array(phasor, count, tracker.lines())) return status;
    for (std::size_t i = 0; i < count; ++i) phasor[i] = resonid::c::plain(tracker.phasor(i));
    return RESONID_OK;
  });
}
resonid_status resonid_tracker_get_line(const resonid_tracker* handle, uint32_t line,
                                        resonid_tracker_line* info, size_t struct_size) noexcept {
  resonid_tracker_line found{};
  const resonid_status status = Trackers::visit(handle, [&](const auto& tracker) -> resonid_status {
    if (line >= tracker.lines()) return RESONID_ERROR_RANGE;
    found.settled = tracker.settled(line) ? 1 : 0;
    found.frequency_hz = tracker.frequency_hz(line);
    found.phasor = resonid::c::plain(tracker.phasor(line));
    found.amplitude = resonid::c::plain(tracker.amplitude(line));
    found.noise_gain = tracker.noise_gain(line);
    found.lag_samples = tracker.lag_samples(line);
    found.settling_samples = tracker.settling_samples(line);
    return RESONID_OK;
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
resonid_status resonid_tracker_get_info(const resonid_tracker* handle, resonid_tracker_info* info,
                                        size_t struct_size) noexcept {
  resonid_tracker_info found{};
  const resonid_status status = Trackers::visit(handle, [&](const auto& tracker) {
    found.lines = static_cast<std::uint32_t>(tracker.lines());
    found.ready = tracker.ready() ? 1 : 0;
    found.samples = tracker.samples();
    found.skipped_samples = tracker.skipped_samples();
    found.innovation = resonid::c::kNoValue;
    if constexpr (requires { tracker.innovation(); }) found.innovation = tracker.innovation();
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
