// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/io/record_reader.hpp>

namespace resonid::io {

/// A table with a further column for every sum, and the mapping that names those.
struct SummedTable {
  Table table;
  ColumnMapping mapping;
};

/// Resolves what the mapping writes as a sum of columns, `34.18*theta - 3.307*strain`: terms `NAME`,
/// `FACTOR*NAME` or `NAME*FACTOR` with + or - between them. A name that is a column's wins over its reading
/// as a sum, and inside a sum the longest name that fits. The new column is named by the sum in brackets;
/// where all factors are 1 or -1 and all units equal, that unit stands behind it. Nothing when no sum is
/// written. Errors: a term without a column of that name, columns of different lengths.
[[nodiscard]] expected<std::optional<SummedTable>, Error> add_sums(const Table& table,
                                                                   const ColumnMapping& mapping);

}  // namespace resonid::io
