// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/io/detail/table.hpp>

#include "io/text_source.hpp"

namespace resonid::io {

/// What is open already, read.
[[nodiscard]] expected<Table, Error> read_csv(const TextSource& source, const TextLayout& layout);
[[nodiscard]] expected<Table, Error> read_mat(const TextSource& source, const std::filesystem::path& path);

}  // namespace resonid::io
