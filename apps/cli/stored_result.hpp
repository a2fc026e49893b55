// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <resonid/base/expected.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::cli {

/// The result that `identify --json` wrote. The error of a file that holds none names every wrong or missing
/// field by its JSON path.
[[nodiscard]] expected<identification::Result> stored_result(const std::filesystem::path& path);

}  // namespace resonid::cli
