// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

namespace resonid::io {

/// How a text table is written, as far as the user tells; the rest is sniffed.
struct TextLayout {
  std::optional<char> decimal = {};             ///< '.' or ','.
  std::size_t skip_lines = 0;                   ///< Lines left out at the beginning.
  std::optional<std::size_t> header_line = {};  ///< Line of the names, from 1; 0: there is none.
};

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

  std::string source;              ///< File name.
  std::vector<std::string> names;  ///< [column], all different, in the file's order.
  std::vector<std::string> units;  ///< [column] as a row of units tells; empty: none, or no such row.
  std::vector<std::vector<double>> columns;  ///< [column][row], finite or NaN for a missing one. Of a MAT
                                             ///< file, lengths may differ.
  std::vector<Scalar> scalars;               ///< MAT only.
  std::vector<Unusable> unusable;            ///< MAT variables that are no vectors, columns of text.
  std::vector<LineRun> line_runs;            ///< By rising row; empty for MAT.
  std::vector<std::string> notes;  ///< How the file was read, where it is not the usual; a phrase each.
  double sample_interval_s = 0.0;  ///< As a line above the rows tells; 0: none does.

  /// Where a row stands in the file: "line 12" of a text file, "element 11" of a MAT file, both from 1.
  [[nodiscard]] std::string place(std::size_t row) const;
};

/// Reads a text table: rows of numbers, one per sample, with the names of the columns above them. Separator
/// (comma, semicolon, tab, bar, blanks), decimal mark, lines above the names, a row of units, the character
/// set (UTF-8, UTF-16, Windows-1252) and gzip are told from the text, as far as `layout` does not say; `#`
/// lines and blank lines are skipped; numbers are rounded correctly. A cell that is empty, NaN, `#NV` or the
/// like is a missing sample, times of day become seconds. A last line that is torn and text below the rows
/// are left out and noted. `-` is standard input. Errors: no such file, no rows of numbers, text instead of a
/// number, a missing or surplus field, fewer than two rows.
[[nodiscard]] expected<Table, Error> read_csv(const std::filesystem::path& path,
                                              const TextLayout& layout = {});

/// Reads a MAT file (version 4, 5 or 7.3): every real numeric vector is a column, every number a scalar, the
/// columns of a matrix and the fields of a structure are columns of their own; what else the file holds is
/// listed as unusable.
[[nodiscard]] expected<Table, Error> read_mat(const std::filesystem::path& path);

/// read_mat() for what begins like a MAT file or is called `.mat`, read_csv() for everything else.
[[nodiscard]] expected<Table, Error> read_table(const std::filesystem::path& path,
                                                const TextLayout& layout = {});

}  // namespace resonid::io
