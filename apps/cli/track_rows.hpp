// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/track.hpp>
#include <string>

namespace resonid::cli {

/// Positions, trust and physical parameters of the rows that `resonid track --out FILE` has written. Ends
/// with an InputError that begins with the option where the file is none, or tells no position.
[[nodiscard]] identification::Track read_track_rows(const std::string& path, const std::string& option);

}  // namespace resonid::cli
