// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace resonid::io {

/// docs/experiment_files.md: every table and key of an experiment file with type, default, range, unit and
/// where it applies, as Markdown. Made from describe() and check() of the configuration structs, so that it
/// says what the reader does.
[[nodiscard]] std::string experiment_schema();

}  // namespace resonid::io
