// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace resonid::monitor {

/// Whether this is a subject with or without wildcards: tokens joined by points, none empty, no blanks; `>`
/// last.
[[nodiscard]] bool is_subject_filter(std::string_view text);
/// Whether a filter has this subject; an empty one has all.
[[nodiscard]] bool subject_matches(std::string_view filter, std::string_view subject);
/// Whether this is a name of a stream or consumer: no blanks, points, wildcards or slashes.
[[nodiscard]] bool is_stream_name(std::string_view text);

}  // namespace resonid::monitor
