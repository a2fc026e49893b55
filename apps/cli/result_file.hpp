// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/result.hpp>
#include <string>

namespace resonid::cli {

/// The result that `identify --json` wrote; a file that holds none is an InputError that names every wrong or
/// missing field by its JSON path, and begins with the option that named the file.
[[nodiscard]] identification::Result read_result(const std::string& path, const std::string& option = {});

/// The response as CSV, with noise and distortion per line where they are known.
void write_response(const std::string& path, const identification::Result& result);

}  // namespace resonid::cli
