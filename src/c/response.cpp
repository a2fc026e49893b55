// SPDX-License-Identifier: MIT
#include <resonid/c/response.h>

#include <array>
#include <resonid/online/lines/response_tracker.hpp>

#include "handle.hpp"
#include "tracker_config.hpp"

namespace resonid::c {
namespace {

using online::ResponseTracker;

struct Responses : Variants<RESONID_FAMILY_RESPONSE, ResponseTracker<KalmanBank>, ResponseTracker<ShortDft>,
                            ResponseTracker<LongDft>, ResponseTracker<ChirpTracker>> {
  using Config = resonid_response_config;
  using Handle = resonid_response;

  static Config defaults_for(const Config*) noexcept { return {}; }
  static expected<std::uint32_t, Error> variant(const Config& c) noexcept {
    return tracker_of(c).and_then(tracker_type).map([](TrackerType type) {
      return static_cast<std::uint32_t>(type);
    });
  }
  static std::size_t size(std::uint32_t variant) noexcept { return kSize[variant]; }
  static expected<void, Error> build(void* memory, std::uint32_t variant, const Config& c) noexcept {
    if (c.controller_lines > RESONID_TRACKER_MAX_LINES)
      return refuse("controller_lines", "must be at most RESONID_TRACKER_MAX_LINES", c.controller_lines);
    std::array<std::complex<double>, RESONID_TRACKER_MAX_LINES> at_line;
    const auto given = array(c.controller_at_line, c.controller_lines);
    for (std::size_t i = 0; i < given.size(); ++i) at_line[i] = {given[i].re, given[i].im};
    online::ResponseTrackerConfig config;
    config.known_delay_s = c.known_delay_s;
    config.controller_at_line = std::span(at_line).first(given.size());
    config.controller_numerator = array(c.controller_numerator, c.controller_numerator_count);
    config.controller_denominator = array(c.controller_denominator, c.controller_denominator_count);
    config.noise_memory_samples = c.noise_memory_samples;
    const auto tracker = tracker_of(c);
    return with_tracker(static_cast<TrackerType>(variant), *tracker,
                        [&](const auto& pattern) -> expected<void, Error> {
                          using Tracker = std::remove_cvref_t<decltype(pattern)>;
                          const auto made = ResponseTracker<Tracker>::create(pattern, config);
                          if (!made) return unexpected<Error>(made.error());
                          place(memory, kFamily, variant, *made);
                          return {};
                        });
  }

 private:
  static expected<resonid_tracker_config, Error> tracker_of(const Config& c) noexcept {
    if (c.tracker == nullptr) return refuse("tracker", "must not be NULL");
    resonid_tracker_config config = tracker_defaults(second_field(c.tracker));
    if (take(c.tracker, config, nullptr) != RESONID_OK)
      return refuse("tracker", "must be a configuration that its defaults function has filled");
    return config;
  }
};

}  // namespace
}  // namespace resonid::c

using resonid::c::Responses;

resonid_status resonid_response_defaults(resonid_response_config* config, size_t struct_size) noexcept {
  return resonid::c::give_defaults(resonid_response_config{}, config, struct_size);
}
size_t resonid_response_size(const resonid_response_config* config) noexcept {
  return resonid::c::size_of<Responses>(config);
}
resonid_status resonid_response_init(void* memory, size_t size, const resonid_response_config* config,
                                     resonid_response** handle, resonid_error* error) noexcept {
  return resonid::c::init<Responses>(memory, size, config, handle, error);
}
resonid_status resonid_response_create(const resonid_response_config* config, resonid_response** handle,
                                       resonid_error* error) noexcept {
  return resonid::c::create<Responses>(config, handle, error);
}
resonid_status resonid_response_step(resonid_response* handle, double ru, double u, double y) noexcept {
  return Responses::visit(handle, [&](auto& tracker) { tracker.step(ru, u, y); });
}
resonid_status resonid_response_run(resonid_response* handle, const double* ru, const double* u,
                                    const double* y, size_t count) noexcept {
  if (count > 0 && (u == nullptr || y == nullptr)) return RESONID_ERROR_NULL;
  return Responses::visit(handle, [&](auto& tracker) {
    for (std::size_t k = 0; k < count; ++k) tracker.step(ru != nullptr ? ru[k] : 0.0, u[k], y[k]);
  });
}
resonid_status resonid_response_miss(resonid_response* handle, uint64_t count) noexcept {
  return Responses::visit(handle, [&](auto& tracker) { tracker.miss(count); });
}
resonid_status resonid_response_reset(resonid_response* handle) noexcept {
  return Responses::visit(handle, [](auto& tracker) { tracker.reset(); });
}
resonid_status resonid_response_get_line(const resonid_response* handle, uint32_t line, uint32_t approach,
                                         resonid_response_line* info, size_t struct_size) noexcept {
  if (approach > RESONID_JOINT) return RESONID_ERROR_RANGE;
  resonid_response_line found{};
  const resonid_status status = Responses::visit(handle, [&](const auto& tracker) -> resonid_status {
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
resonid_status resonid_response_get_info(const resonid_response* handle, resonid_response_info* info,
                                         size_t struct_size) noexcept {
  resonid_response_info found{};
  const resonid_status status = Responses::visit(handle, [&](const auto& tracker) {
    found.lines = static_cast<std::uint32_t>(tracker.lines());
    found.ready = tracker.ready() ? 1 : 0;
    found.samples = tracker.samples();
    found.skipped_samples = tracker.skipped_samples();
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
