// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/io/detail/table.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "io/csv_cell.hpp"
#include "io/text.hpp"

namespace resonid::io {

inline constexpr std::string_view kCsvRequirement =
    "required: rows of numbers, separated by comma, semicolon, tab or blanks, with the column names above "
    "them";

/// The separator of columns between which blanks and tabs stand, as many as there are.
inline constexpr char kBlanks = ' ';

/// How the rows of a text table are written.
struct CsvFormat {
  std::string file;
  std::vector<std::string> names;     ///< [column], all different, UTF-8.
  std::vector<std::string> units;     ///< [column], empty where none is told apart from the name.
  std::vector<CellKind> kinds;        ///< [column]
  std::vector<std::string> examples;  ///< [column] why the first cell is no number; empty where it is one.
  std::vector<bool> without_hours;    ///< [column] of times: the first is written `mm:ss`.
  std::size_t header_line = 0;        ///< From 1; 0 when there is none.
  std::size_t data_line = 1;          ///< Line of the first row, from 1.
  std::size_t data_offset = 0;        ///< Byte at which that line begins.
  char separator = ',';
  char decimal = '.';
  double sample_interval_s = 0.0;   ///< As a line above the rows tells; 0: none does.
  bool trailing_separator = false;  ///< The header ends with one, so every row may.
  std::vector<std::string> notes;   ///< What was sniffed, where it is not the usual.

  [[nodiscard]] bool is_blank(char c) const noexcept { return c == ' ' || (c == '\t' && separator != '\t'); }
};

/// Walks through the lines of a text, skipping blank ones and comments. The text must end with a line end or
/// be followed by a NUL.
class LineCursor {
 public:
  explicit LineCursor(std::string_view text) noexcept : next_(text.data()), end_(text.data() + text.size()) {}

  /// Moves to the next line that holds something; false at the end of the text.
  bool find() noexcept;
  /// Steps over the end of the line, which is LF, CR LF, CR or the end of the text.
  void end_line() noexcept;

  [[nodiscard]] const char* position() const noexcept { return next_; }
  [[nodiscard]] const char* end() const noexcept { return end_; }
  void move_to(const char* position) noexcept { next_ = position; }
  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }        ///< Line ends passed.
  [[nodiscard]] std::size_t comments() const noexcept { return comments_; }  ///< Comments passed.
  [[nodiscard]] std::string_view rest_of_line() const noexcept;

 private:
  const char* next_;
  const char* end_;
  std::size_t lines_ = 0;
  std::size_t comments_ = 0;
};

struct Field {
  std::string text;     ///< Without the blanks around it and without quotes.
  bool closed = true;   ///< False when a quote was opened and not closed.
  bool quoted = false;  ///< Began with a quote.
};

/// The fields of a line; one more, empty, where it ends with a separator.
[[nodiscard]] std::vector<Field> split_fields(char separator, std::string_view line);

/// What stands in a field that should hold a number: "'2,012.3' has thousands separators; write ...".
[[nodiscard]] std::string not_a_number(const Field& field, char decimal);

/// Reads one line field by field: for what the fast scanner does not understand. `line` counts from 1; `row`
/// has as many elements as there are columns; a missing value and text become NaN.
[[nodiscard]] expected<void, Error> read_csv_row(const CsvFormat& format, std::string_view text,
                                                 std::size_t line, std::vector<double>& row);

}  // namespace resonid::io
