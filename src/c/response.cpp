// SPDX-License-Identifier: MIT
#include <resonid/c/detail/lines.h>

#include <array>
#include <resonid/online/lines/response_tracker.hpp>

#include "handle.hpp"
#include "tracker_config.hpp"

namespace resonid::c {
namespace {

using online::ResponseTracker;

struct Responses : Variants<Responses, ResponseTracker<KalmanBank>, ResponseTracker<ShortDft>,
                            ResponseTracker<LongDft>, ResponseTracker<ChirpTracker>> {
  using Settings = resonid_response_settings;
  using Results = resonid_response_results;
  static constexpr std::uint32_t kId = family_of(RESONID_RESPONSE), kTypes = 1;

  static Settings defaults(std::uint32_t) noexcept { return {}; }
  static expected<std::uint32_t> variant(const Settings& s) noexcept {
    return tracker_of(s).and_then(tracker_type).map([](TrackerType type) {
      return static_cast<std::uint32_t>(type);
    });
  }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    if (s.controller_lines > RESONID_TRACKER_MAX_LINES)
      return refuse("controller_lines", "must be at most RESONID_TRACKER_MAX_LINES", s.controller_lines);
    std::array<std::complex<double>, RESONID_TRACKER_MAX_LINES> at_line;
    const auto given = array(s.controller_at_line, s.controller_lines);
    for (std::size_t i = 0; i < given.size(); ++i) at_line[i] = {given[i].re, given[i].im};
    online::ResponseTrackerConfig config;
    config.known_delay_s = s.known_delay_s;
    config.controller_at_line = std::span(at_line).first(given.size());
    config.controller_numerator = array(s.controller_numerator, s.controller_numerator_count);
    config.controller_denominator = array(s.controller_denominator, s.controller_denominator_count);
    config.noise_memory_samples = s.noise_memory_samples;
    const auto tracker = tracker_of(s);
    return with_tracker(static_cast<TrackerType>(variant), *tracker, [&](const auto& pattern) {
      using Tracker = std::remove_cvref_t<decltype(pattern)>;
      return place(memory, s.head.kind, variant, ResponseTracker<Tracker>::create(pattern, config));
    });
  }
  template <class Tracker>
  static void step(ResponseTracker<Tracker>& tracker, double ru, double u, double y) noexcept {
    tracker.step(ru, u, y);
  }
  template <class Tracker>
  static void results(const ResponseTracker<Tracker>& tracker, Results& r) noexcept {
    r.samples = tracker.samples();
    r.skipped_samples = tracker.skipped_samples();
    r.lines = static_cast<std::uint32_t>(tracker.lines());
    r.ready = tracker.ready() ? 1 : 0;
  }

 private:
  static expected<resonid_tracker_settings> tracker_of(const Settings& s) noexcept {
    if (s.tracker == nullptr) return refuse("tracker", "must not be NULL");
    resonid_tracker_settings tracker;
    if (take<TrackerDefaults>(&s.tracker->head, tracker, nullptr) != RESONID_OK)
      return refuse("tracker", "must be settings that resonid_defaults() has filled");
    return tracker;
  }
};

}  // namespace

const Family kResponse = FamilyOf<Responses>::kFamily;

}  // namespace resonid::c

using resonid::c::Responses;

resonid_status resonid_read_response_line(const resonid_handle* response, uint32_t line, uint32_t approach,
                                          resonid_response_line* info, size_t struct_size) noexcept {
  if (approach > RESONID_JOINT) return RESONID_ERROR_RANGE;
  resonid_response_line found{};
  const resonid_status status = Responses::visit(response, [&](const auto& tracker) -> resonid_status {
    if (line >= tracker.lines()) return RESONID_ERROR_RANGE;
    found.settled = tracker.settled(line) ? 1 : 0;
    found.frequency_hz = tracker.frequency_hz(line);
    found.response = resonid::c::plain(tracker.response(line, static_cast<resonid::Approach>(approach)));
    found.standard_deviation = tracker.standard_deviation(line);
    found.coherence = tracker.coherence(line);
    found.lag_samples = tracker.lag_samples(line);
    return RESONID_OK;
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
