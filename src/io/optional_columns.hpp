// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/io/record_reader.hpp>
#include <span>
#include <string>
#include <vector>

#include "io/columns.hpp"

namespace resonid::io {

/// Most of the samples that may be missing.
inline constexpr double kMostMissing = 0.05;

/// Columns of the signals, in the order of FoundColumns::times.
[[nodiscard]] std::vector<std::size_t> signal_columns(const FoundColumns& found);

/// Takes the signals out that the work goes on without, that nobody named, and whose empty cells would stop
/// it: more than kMostMissing of the rows that all other signals have, or more than half of them at the
/// beginning and the end.
///
/// @return a note for each
std::vector<std::string> leave_out_sparse(const Table& table, const ColumnMapping& mapping,
                                          std::span<const std::size_t> rows, FoundColumns& found);

}  // namespace resonid::io
