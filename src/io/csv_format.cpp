// SPDX-License-Identifier: MIT
#include "io/csv_format.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "io/csv_number.hpp"

namespace resonid::io {
namespace {

struct Field {
  std::string text;    ///< Without the blanks around it and without quotes.
  bool closed = true;  ///< False when a quote was opened and not closed.
};

/// Takes a quoted part, in which a doubled quote stands for one; `i` is at the opening quote and moves behind
/// it.
void take_quoted(std::string_view line, std::size_t& i, Field& field) {
  field.closed = false;
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

std::vector<Field> split(const CsvFormat& format, std::string_view line) {
  std::vector<Field> fields;
  for (std::size_t i = 0;; ++i) {
    Field field;
    while (i < line.size() && format.is_blank(line[i])) ++i;
    if (i < line.size() && line[i] == '"') take_quoted(line, i, field);
    while (i < line.size() && line[i] != format.separator) field.text += line[i++];
    while (!field.text.empty() && format.is_blank(field.text.back())) field.text.pop_back();
    fields.push_back(std::move(field));
    if (i == line.size()) return fields;
  }
}

/// The separator that the header holds most often outside quotes; without one the table has a single column.
char separator_of(std::string_view header) {
  char best = ',';
  long most = 0;
  for (const char candidate : {'\t', ';', ','}) {
    long count = 0;
    bool inside = false;
    for (const char c : header) {
      inside = inside != (c == '"');
      count += c == candidate && !inside ? 1 : 0;
    }
    if (count > most) {
      most = count;
      best = candidate;
    }
  }
  return best;
}

/// True when the whole field is one finite number.
bool to_number(std::string text, double& value) {
  const std::size_t size = text.size();
  text.append(kNumberPadding, '\0');
  return parse_number(text.data(), text.data() + size, value) == text.data() + size;
}

/// What stands in a field that should hold a number.
std::string not_a_number(const Field& field, bool single_column) {
  std::string_view text = field.text;
  const std::string found = in_quotes(text);
  if (text.empty()) return "is empty; a number is required";
  if (!field.closed) return fmt::format("the quote before {} is not closed", found);
  if (text.front() == '+' || text.front() == '-') text.remove_prefix(1);
  const std::string word = lower(text);
  if (word == "nan" || word == "inf" || word == "infinity")
    return fmt::format("{} is not a finite number; every sample must be one", found);
  const auto holds_only = [&](std::string_view allowed) {
    return text.find_first_not_of(allowed) == text.npos;
  };
  if (text.find(',') != text.npos && holds_only("0123456789,eE+-"))
    return fmt::format("{} has a decimal comma; write numbers with a decimal point", found);
  double value = 0.0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec == std::errc::result_out_of_range && result.ptr == text.data() + text.size())
    return fmt::format("{} is larger than a double can hold", found);
  if (single_column && text.find_first_of(" \t") != text.npos)
    return fmt::format("{} is not a number; columns must be separated by comma, semicolon or tab", found);
  return fmt::format("{} is not a number", found);
}

expected<void, Error> check_names(const CsvFormat& format) {
  for (std::size_t i = 0; i < format.names.size(); ++i) {
    if (format.names[i].empty())
      return fail(fmt::format("{}: line {}", format.file, format.header_line),
                  fmt::format("column {} has no name", i + 1));
    for (std::size_t j = 0; j < i; ++j)
      if (format.names[i] == format.names[j])
        return fail(fmt::format("{}: line {}", format.file, format.header_line),
                    fmt::format("columns {} and {} are both called {}; names must differ", j + 1, i + 1,
                                in_quotes(format.names[i])));
  }
  return {};
}

}  // namespace

bool LineCursor::find() noexcept {
  while (next_ != end_) {
    const char* p = next_;
    while (p != end_ && (*p == ' ' || *p == '\t')) ++p;
    if (p != end_ && *p != '\n' && *p != '\r' && *p != '#') return true;
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

expected<CsvFormat, Error> read_csv_header(const std::string& file, std::string_view text) {
  CsvFormat format;
  format.file = file;
  if (text.empty()) return fail(file, fmt::format("the file is empty; {}", kCsvRequirement));
  if (text.substr(0, 2) == "\xff\xfe" || text.substr(0, 2) == "\xfe\xff")
    return fail(file, "is UTF-16 text; UTF-8 or plain ASCII is required");
  const std::string_view plain = text.substr(0, 3) == "\xef\xbb\xbf" ? text.substr(3) : text;
  LineCursor cursor(plain);
  if (!cursor.find())
    return fail(file, fmt::format("holds only comments and blank lines; {}", kCsvRequirement));
  const std::string_view header = cursor.rest_of_line();
  format.header_line = cursor.lines() + 1;
  format.separator = separator_of(header);
  auto fields = split(format, header);
  double value = 0.0;
  if (std::all_of(fields.begin(), fields.end(),
                  [&](const Field& f) { return f.text.empty() || to_number(f.text, value); })) {
    const char* const hint =
        plain.front() == '#' ? " (a line that begins with # is a comment, not the header)" : "";
    return fail(fmt::format("{}: line {}", file, format.header_line),
                fmt::format("has {} where the column names should be{}; {}", in_quotes(header), hint,
                            kCsvRequirement));
  }
  format.trailing_separator = fields.size() > 1 && fields.back().text.empty();
  if (format.trailing_separator) fields.pop_back();
  for (auto& field : fields) {
    if (!field.closed)
      return fail(fmt::format("{}: line {}", file, format.header_line),
                  fmt::format("the quote before {} is not closed", in_quotes(field.text)));
    format.names.push_back(std::move(field.text));
  }
  cursor.move_to(header.data() + header.size());
  cursor.end_line();
  format.data_offset = static_cast<std::size_t>(cursor.position() - text.data());
  if (auto names = check_names(format); !names) return unexpected<Error>(names.error());
  return format;
}

expected<void, Error> read_csv_row(const CsvFormat& format, std::string_view text, std::size_t line,
                                   std::vector<double>& row) {
  auto fields = split(format, text);
  const std::size_t width = format.names.size();
  if (format.trailing_separator && fields.size() == width + 1 && fields.back().text.empty())
    fields.pop_back();
  if (fields.size() != width) {
    const bool comma = format.separator == ',' && fields.size() == 2 * width;
    return fail(fmt::format("{}: line {}", format.file, line),
                fmt::format("has {} field{}, the header (line {}) names {} column{}{}", fields.size(),
                            fields.size() == 1 ? "" : "s", format.header_line, width, width == 1 ? "" : "s",
                            comma ? "; numbers must be written with a decimal point, not a comma" : ""));
  }
  for (std::size_t i = 0; i < width; ++i)
    if (!fields[i].closed || !to_number(fields[i].text, row[i]))
      return fail(fmt::format("{}: line {}, column {}", format.file, line, in_quotes(format.names[i])),
                  not_a_number(fields[i], width == 1));
  return {};
}

}  // namespace resonid::io
