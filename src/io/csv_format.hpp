// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "io/text.hpp"

namespace resonid::io {

inline constexpr std::string_view kCsvRequirement =
    "required: a header row with column names, then rows of numbers, separated by comma, semicolon or tab";

/// How the rows of a text table are written, as its header tells.
struct CsvFormat {
  std::string file;
  std::vector<std::string> names;
  std::size_t header_line = 0;  ///< From 1.
  std::size_t data_offset = 0;  ///< Byte at which the line after the header begins.
  char separator = ',';
  bool trailing_separator = false;  ///< The header ends with one, so every row may.

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
  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }  ///< Line ends passed.
  [[nodiscard]] std::string_view rest_of_line() const noexcept;

 private:
  const char* next_;
  const char* end_;
  std::size_t lines_ = 0;
};

/// Reads the header from the beginning of a file.
[[nodiscard]] expected<CsvFormat, Error> read_csv_header(const std::string& file, std::string_view text);

/// Reads one line field by field: for what the fast scanner does not understand. `line` counts from 1; `row`
/// has as many elements as there are columns.
[[nodiscard]] expected<void, Error> read_csv_row(const CsvFormat& format, std::string_view text,
                                                 std::size_t line, std::vector<double>& row);

}  // namespace resonid::io
