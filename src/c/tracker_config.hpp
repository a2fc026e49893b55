// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/c/tracking.h>

#include <complex>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/sliding_dft.hpp>

#include "error.hpp"

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

/// Which of these four, in this order, the configuration asks for.
enum class TrackerType : std::uint32_t { kalman_bank, short_dft, long_dft, chirp };
expected<TrackerType, Error> tracker_type(const resonid_tracker_config& config) noexcept;

resonid_tracker_config tracker_defaults(std::uint32_t kind) noexcept;

template <class Tracker>
expected<Tracker, Error> make_tracker(const resonid_tracker_config& config) noexcept;

/// f(tracker) with a tracker of one type. Not inline: else the stack of a small one were that of the largest.
template <class Tracker, class F>
[[gnu::noinline]] expected<void, Error> with_one_tracker(const resonid_tracker_config& config,
                                                         F& f) noexcept {
  const auto made = make_tracker<Tracker>(config);
  if (!made) return unexpected<Error>(made.error());
  return f(*made);
}

/// f(tracker) with the tracker of the type; gives an error of it or of f.
template <class F>
expected<void, Error> with_tracker(TrackerType type, const resonid_tracker_config& config, F&& f) noexcept {
  switch (type) {
    case TrackerType::kalman_bank:
      return with_one_tracker<KalmanBank>(config, f);
    case TrackerType::short_dft:
      return with_one_tracker<ShortDft>(config, f);
    case TrackerType::long_dft:
      return with_one_tracker<LongDft>(config, f);
    case TrackerType::chirp:
      break;
  }
  return with_one_tracker<ChirpTracker>(config, f);
}

}  // namespace resonid::c
