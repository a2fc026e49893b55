// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/record.hpp>
#include <string>

namespace resonid::io {

/// A record as CSV text with the columns `time_s, ru, u, y, r, position`, those that are present. A unit
/// other than the SI one of the motion is added to the name (`u_V`, `u [ticks]`). Samples are the shortest
/// numbers that read back to the same double, so that read_record() gives the same record.
[[nodiscard]] std::string record_csv(const data::Record& record);

}  // namespace resonid::io
