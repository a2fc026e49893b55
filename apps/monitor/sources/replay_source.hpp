// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>

#include "monitor/sources/source.hpp"

namespace resonid::monitor {

struct ReplaySettings {
  std::shared_ptr<const data::Record> record;
  std::int64_t first_ns = 0;  ///< UNIX, told of the first sample; the others follow at the record's rate.
  double speed = 0.0;         ///< Seconds of the recording per second; 0: as fast as they are taken.
};

/// The samples of a recording, for one axis, as columns `ru`, `u`, `y` and `position`; ends with it.
///
/// Errors: no samples; a speed below 0.
[[nodiscard]] expected<std::unique_ptr<Source>, Error> make_replay_source(ReplaySettings settings,
                                                                          Axes& axes);

}  // namespace resonid::monitor
