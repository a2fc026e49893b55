// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

namespace resonid::io {

/// Named columns of numbers as a file holds them; what they mean is decided by to_record().
struct Table {
  /// A variable of a MAT file that holds one number ("Ts", "fs").
  struct Scalar {
    std::string name;
    double value = 0.0;
  };
  /// A variable that cannot be a signal. It is an error only when somebody asks for it.
  struct Unusable {
    std::string name;
    std::string reason;  ///< What it is instead, as a phrase: "is a struct (1x1)".
  };
  /// From `row` on, the row i stands in line i - row + line of the text file.
  struct LineRun {
    std::size_t row = 0;
    std::size_t line = 0;
  };

  std::string source;                        ///< File name.
  std::vector<std::string> names;            ///< [column], all different, in the file's order.
  std::vector<std::vector<double>> columns;  ///< [column][row], finite. Of a MAT file, lengths may differ.
  std::vector<Scalar> scalars;               ///< MAT only.
  std::vector<Unusable> unusable;            ///< MAT only.
  std::vector<LineRun> line_runs;            ///< By rising row; empty for MAT.

  /// Where a row stands in the file: "line 12" of a text file, "element 11" of a MAT file, both from 1.
  [[nodiscard]] std::string place(std::size_t row) const;
};

/// Reads a text table: a header row with the names, then one row per sample. The separator (comma, semicolon
/// or tab) is told from the header; `#` lines and blank lines are skipped; numbers have decimal points and
/// are rounded correctly. Errors: no such file, no header, a name twice, text or not-a-number instead of a
/// number, a missing or surplus field, fewer than two rows.
[[nodiscard]] expected<Table, Error> read_csv(const std::filesystem::path& path);

/// Reads a MAT file (version 4, 5 or 7.3): every real numeric vector is a column, every number a scalar; what
/// else the file holds is listed as unusable.
[[nodiscard]] expected<Table, Error> read_mat(const std::filesystem::path& path);

/// read_mat() for what begins like a MAT file or is called `.mat`, read_csv() for everything else.
[[nodiscard]] expected<Table, Error> read_table(const std::filesystem::path& path);

}  // namespace resonid::io
