// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <resonid/base/expected.hpp>

namespace resonid::io {

/// A JSON file. The message of a broken one names line and column.
[[nodiscard]] expected<nlohmann::json, Error> read_json(const std::filesystem::path& path);

}  // namespace resonid::io
