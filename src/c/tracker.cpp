// SPDX-License-Identifier: MIT
#include <cmath>

#include "handle.hpp"
#include "tracker_config.hpp"

namespace resonid::c {

expected<TrackerType> tracker_type(const resonid_tracker_settings& s) noexcept {
  switch (s.head.kind) {
    case RESONID_KALMAN_BANK:
      return TrackerType::kalman_bank;
    case RESONID_SLIDING_DFT:
      return s.window_samples <= kShortWindow ? TrackerType::short_dft : TrackerType::long_dft;
    case RESONID_CHIRP_TRACKER:
      return TrackerType::chirp;
    default:
      return refuse("kind", "must be that of a tracker", s.head.kind);
  }
}

resonid_tracker_settings TrackerDefaults::defaults(std::uint32_t kind) noexcept {
  const online::KalmanBankConfig bank;
  const online::ChirpTrackerConfig chirp;
  const bool follows = kind == RESONID_CHIRP_TRACKER;
  resonid_tracker_settings s{};
  s.offset = (follows ? chirp.offset : bank.offset) ? 1 : 0;
  s.lambda = follows ? chirp.lambda : bank.lambda;
  s.pole_radius = bank.pole_radius;
  return s;
}

template <>
expected<KalmanBank> make_tracker(const resonid_tracker_settings& s) noexcept {
  const auto gain = enumerator("gain", s.gain, online::GainRule::placed_poles);
  if (!gain) return unexpected<Error>(gain.error());
  return KalmanBank::create(
      {s.sample_rate_hz, array(s.frequency_hz, s.lines), s.offset != 0, *gain, s.lambda, s.pole_radius});
}

namespace {

template <class Dft>
expected<Dft> make_dft(const resonid_tracker_settings& s) noexcept {
  const auto window = enumerator("window", s.window, online::DftWindow::hann);
  if (!window) return unexpected<Error>(window.error());
  return Dft::create({s.sample_rate_hz, s.window_samples, array(s.frequency_hz, s.lines), *window});
}

}  // namespace

template <>
expected<ShortDft> make_tracker(const resonid_tracker_settings& s) noexcept {
  return make_dft<ShortDft>(s);
}
template <>
expected<LongDft> make_tracker(const resonid_tracker_settings& s) noexcept {
  return make_dft<LongDft>(s);
}
template <>
expected<ChirpTracker> make_tracker(const resonid_tracker_settings& s) noexcept {
  const auto gain = enumerator("gain", s.gain, online::GainRule::placed_poles);
  if (!gain) return unexpected<Error>(gain.error());
  const auto sweep = enumerator("sweep", s.sweep, online::Sweep::logarithmic);
  if (!sweep) return unexpected<Error>(sweep.error());
  return ChirpTracker::create({s.sample_rate_hz, s.from_hz, s.to_hz, s.duration_s, *sweep, s.offset != 0,
                               *gain, s.lambda, s.pole_radius});
}

namespace {

struct Trackers : TrackerDefaults, Variants<Trackers, KalmanBank, ShortDft, LongDft, ChirpTracker> {
  using Results = resonid_tracker_results;
  static constexpr std::uint32_t kId = family_of(RESONID_KALMAN_BANK), kTypes = 3;
  static constexpr bool kNeedsU = false;

  static expected<std::uint32_t> variant(const Settings& s) noexcept {
    return tracker_type(s).map([](TrackerType type) { return static_cast<std::uint32_t>(type); });
  }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    return with_tracker(static_cast<TrackerType>(variant), s, [&](const auto& made) {
      place(memory, s.head.kind, variant, made);
      return expected<void>{};
    });
  }
  template <class Tracker>
  static void step(Tracker& tracker, double, double, double y) noexcept {
    tracker.step(y);
  }
  template <class Tracker>
  static void results(const Tracker& tracker, Results& r) noexcept {
    r.samples = tracker.samples();
    r.skipped_samples = tracker.skipped_samples();
    r.lines = static_cast<std::uint32_t>(tracker.lines());
    r.ready = tracker.ready() ? 1 : 0;
    r.innovation = kNoValue;
    if constexpr (requires { tracker.innovation(); }) r.innovation = tracker.innovation();
  }
};

}  // namespace

const Family kTracker = FamilyOf<Trackers>::kFamily;

}  // namespace resonid::c

using resonid::c::Trackers;

resonid_status resonid_phasors(const resonid_handle* handle, uint32_t channel, resonid_complex* phasor,
                               size_t count) noexcept {
  if (resonid::c::family_of(resonid_kind(handle)) == resonid::c::kLineBank.id)
    return resonid::c::line_bank_phasors(handle, channel, phasor, count);
  return Trackers::visit(handle, [&](const auto& tracker) -> resonid_status {
    if (channel != 0) return RESONID_ERROR_RANGE;
    if (const resonid_status status = resonid::c::check_array(phasor, count, tracker.lines())) return status;
    for (std::size_t i = 0; i < count; ++i) phasor[i] = resonid::c::plain(tracker.phasor(i));
    return RESONID_OK;
  });
}
resonid_status resonid_read_tracker_line(const resonid_handle* tracker, uint32_t line,
                                         resonid_tracker_line* info, size_t struct_size) noexcept {
  resonid_tracker_line found{};
  const resonid_status status = Trackers::visit(tracker, [&](const auto& t) -> resonid_status {
    if (line >= t.lines()) return RESONID_ERROR_RANGE;
    found.settled = t.settled(line) ? 1 : 0;
    found.frequency_hz = t.frequency_hz(line);
    found.phasor = resonid::c::plain(t.phasor(line));
    found.amplitude = resonid::c::plain(t.amplitude(line));
    found.noise_gain = t.noise_gain(line);
    found.lag_samples = t.lag_samples(line);
    found.settling_samples = t.settling_samples(line);
    return RESONID_OK;
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
