// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/io/detail/table.hpp>
#include <string_view>

#include "io/csv_format.hpp"

namespace resonid::io {

/// Tells from the beginning of a text how its rows are written: the separator and decimal mark that make most
/// numbers of them, how many columns, what kind of cells; above the rows their names and, in a row of its
/// own, their units. What `layout` says is not sniffed.
///
/// @param complete whether `text` is all there is; otherwise its last line is left aside
/// Errors: no rows of numbers, a header of other width than the rows, an unclosed quote in it, lines named in
/// `layout` that are not there.
[[nodiscard]] expected<CsvFormat, Error> sniff_layout(const std::string& file, std::string_view text,
                                                      bool complete, const TextLayout& layout);

}  // namespace resonid::io
