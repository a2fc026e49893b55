// SPDX-License-Identifier: MIT
#include "io/csv_format.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <limits>

#include "io/text_encoding.hpp"

namespace resonid::io {
namespace {

/// Takes a quoted part, in which a doubled quote stands for one; `i` is at the opening quote and moves behind
/// it.
void take_quoted(std::string_view line, std::size_t& i, Field& field) {
  field.closed = false;
  field.quoted = true;
  for (++i; i < line.size() && !field.closed; ++i) {
    const bool doubled = line[i] == '"' && i + 1 < line.size() && line[i + 1] == '"';
    if (line[i] == '"' && !doubled) {
      field.closed = true;
    } else {
      field.text += line[i];
      if (doubled) ++i;
    }
  }
}

/// "#NV" and its like are values, no comments.
bool begins_with_missing(std::string_view text) noexcept {
  const std::string_view word = text.substr(0, text.find_first_of(",; \t|\r\n"));
  return word.size() > 1 && says_missing(word);
}

}  // namespace

std::string not_a_number(const Field& field, char decimal) {
  std::string_view text = field.text;
  const std::string found = in_quotes(as_utf8(field.text));
  if (!field.closed) return fmt::format("the quote before {} is not closed", found);
  if (!text.empty() && (text.front() == '+' || text.front() == '-')) text.remove_prefix(1);
  const std::string word = lower(text);
  if (word == "inf" || word == "infinity")
    return fmt::format("{} is not a finite number; every sample must be one", found);
  const auto holds_only = [&](std::string_view allowed) {
    return text.find_first_not_of(allowed) == text.npos;
  };
  const bool comma = text.find(',') != text.npos;
  const bool point = text.find('.') != text.npos;
  if (comma && point && holds_only("0123456789,.eE+-"))
    return fmt::format("{} has thousands separators; write numbers without them", found);
  if (decimal == '.' && comma && holds_only("0123456789,eE+-"))
    return fmt::format("{} has a decimal comma, other rows have a point; write all numbers alike (.decimal)",
                       found);
  if (decimal == ',' && point && holds_only("0123456789.eE+-"))
    return fmt::format("{} has a decimal point, other rows have a comma; write all numbers alike (.decimal)",
                       found);
  double value = 0.0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec == std::errc::result_out_of_range && result.ptr == text.data() + text.size())
    return fmt::format("{} is larger than a double can hold", found);
  return fmt::format("{} is not a number", found);
}

std::vector<Field> split_fields(char separator, std::string_view line) {
  const bool blanks = separator == kBlanks;
  const auto is_blank = [&](char c) { return c == ' ' || (c == '\t' && separator != '\t'); };
  while (blanks && !line.empty() && is_blank(line.back())) line.remove_suffix(1);
  const auto ends = [&](char c) { return blanks ? is_blank(c) : c == separator; };
  std::vector<Field> fields;
  for (std::size_t i = 0;; ++i) {
    Field field;
    while (i < line.size() && is_blank(line[i])) ++i;
    if (i < line.size() && line[i] == '"') take_quoted(line, i, field);
    while (i < line.size() && !ends(line[i])) field.text += line[i++];
    while (!field.text.empty() && is_blank(field.text.back())) field.text.pop_back();
    fields.push_back(std::move(field));
    if (i >= line.size()) return fields;
  }
}

bool LineCursor::find() noexcept {
  while (next_ != end_) {
    const char* p = next_;
    while (p != end_ && (*p == ' ' || *p == '\t')) ++p;
    const bool comment =
        p != end_ && *p == '#' && !begins_with_missing({p, static_cast<std::size_t>(end_ - p)});
    if (p != end_ && *p != '\n' && *p != '\r' && !comment) return true;
    comments_ += comment ? 1U : 0U;
    while (p != end_ && *p != '\n' && *p != '\r') ++p;
    next_ = p;
    end_line();
  }
  return false;
}

void LineCursor::end_line() noexcept {
  if (next_ != end_ && *next_ == '\r') ++next_;
  if (next_ != end_ && *next_ == '\n') ++next_;
  ++lines_;
}

std::string_view LineCursor::rest_of_line() const noexcept {
  const char* p = next_;
  while (p != end_ && *p != '\n' && *p != '\r') ++p;
  return {next_, static_cast<std::size_t>(p - next_)};
}

expected<void, Error> read_csv_row(const CsvFormat& format, std::string_view text, std::size_t line,
                                   std::vector<double>& row) {
  auto fields = split_fields(format.separator, text);
  const std::size_t width = format.names.size();
  if (format.trailing_separator && fields.size() == width + 1 && fields.back().text.empty())
    fields.pop_back();
  if (fields.size() != width) {
    const std::string names = format.header_line == 0
                                  ? fmt::format("the first row (line {}) has", format.data_line)
                                  : fmt::format("the header (line {}) names", format.header_line);
    const bool whole = std::all_of(fields.begin(), fields.end(), [](const Field& f) {
      return f.text.find_first_not_of("+-0123456789") == f.text.npos;
    });
    return fail(fmt::format("{}: line {}", format.file, line),
                fmt::format("has {} field{}, {} {} column{}{}", fields.size(), fields.size() == 1 ? "" : "s",
                            names, width, width == 1 ? "" : "s",
                            format.separator == ',' && whole
                                ? "; a decimal comma? then separate columns by semicolon or tab"
                                : ""));
  }
  for (std::size_t i = 0; i < width; ++i) {
    row[i] = std::numeric_limits<double>::quiet_NaN();
    const Field& field = fields[i];
    if (format.kinds[i] == CellKind::text) continue;
    const Cell cell = read_cell(field.text, format.decimal);
    const bool fits =
        cell.kind == Cell::Kind::missing ||
        cell.kind == (format.kinds[i] == CellKind::clock ? Cell::Kind::clock : Cell::Kind::number);
    if (!field.closed || !fits)
      return fail(fmt::format("{}: line {}, column {}", format.file, line, in_quotes(format.names[i])),
                  format.kinds[i] == CellKind::clock
                      ? fmt::format("{} is not a time like the others", in_quotes(field.text))
                      : not_a_number(field, format.decimal));
    row[i] = cell.value;
  }
  return {};
}

}  // namespace resonid::io
