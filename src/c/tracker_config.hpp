// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/c/detail/lines.h>

#include <complex>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/sliding_dft.hpp>

#include "handle.hpp"

namespace resonid::c {

template <class Real>
resonid_complex plain(std::complex<Real> z) noexcept {
  return {static_cast<double>(z.real()), static_cast<double>(z.imag())};
}

// A sliding DFT holds its whole window: the short one serves most, in an eighth of the memory.
inline constexpr std::size_t kShortWindow = 512;
using KalmanBank = online::KalmanBank<double, RESONID_TRACKER_MAX_LINES>;
using ShortDft = online::SlidingDft<double, RESONID_TRACKER_MAX_LINES, kShortWindow>;
using LongDft = online::SlidingDft<double, RESONID_TRACKER_MAX_LINES, RESONID_TRACKER_MAX_WINDOW>;
using ChirpTracker = online::ChirpTracker<double>;

/// Which of these four, in this order, the settings ask for.
enum class TrackerType : std::uint32_t { kalman_bank, short_dft, long_dft, chirp };
expected<TrackerType> tracker_type(const resonid_tracker_settings& settings) noexcept;

struct TrackerDefaults {
  using Settings = resonid_tracker_settings;
  static Settings defaults(std::uint32_t kind) noexcept;
};

template <class Tracker>
expected<Tracker> make_tracker(const resonid_tracker_settings& settings) noexcept;

/// resonid_phasors() of a line bank.
resonid_status line_bank_phasors(const resonid_handle* handle, std::uint32_t channel, resonid_complex* phasor,
                                 std::size_t count) noexcept;

/// f(tracker) with a tracker of one type. Not inline: else the stack of a small one were that of the largest.
template <class Tracker, class F>
[[gnu::noinline]] expected<void> with_one_tracker(const resonid_tracker_settings& settings, F& f) noexcept {
  const auto made = make_tracker<Tracker>(settings);
  if (!made) return unexpected<Error>(made.error());
  return f(*made);
}

/// f(tracker) with the tracker of the type; gives an error of it or of f.
template <class F>
expected<void> with_tracker(TrackerType type, const resonid_tracker_settings& settings, F&& f) noexcept {
  switch (type) {
    case TrackerType::kalman_bank:
      return with_one_tracker<KalmanBank>(settings, f);
    case TrackerType::short_dft:
      return with_one_tracker<ShortDft>(settings, f);
    case TrackerType::long_dft:
      return with_one_tracker<LongDft>(settings, f);
    case TrackerType::chirp:
      break;
  }
  return with_one_tracker<ChirpTracker>(settings, f);
}

}  // namespace resonid::c
