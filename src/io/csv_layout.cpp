// SPDX-License-Identifier: MIT
#include "io/csv_layout.hpp"

#include <fmt/core.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "io/csv_header.hpp"
#include "io/text_encoding.hpp"

namespace resonid::io {
namespace {

constexpr std::size_t kMostLooked = 4000;  // looked at
constexpr std::size_t kSampledRows = 60;   // from which separator, decimal mark and columns are told
constexpr std::size_t kRowsToBelieve = 8;  // of which half must be rows, where the rows are said to begin
constexpr std::size_t kMostEndLines = 5;   // below the rows

/// The lines of the text that hold something, with their numbers.
std::vector<TextLine> lines_of(std::string_view text, bool complete) {
  std::vector<TextLine> lines;
  const char* p = text.data();
  const char* const end = p + text.size();
  for (std::size_t number = 1; p != end && lines.size() < kMostLooked; ++number) {
    const char* stop = p;
    while (stop != end && *stop != '\n' && *stop != '\r') ++stop;
    if (stop == end && !complete) break;
    const std::string_view line(p, static_cast<std::size_t>(stop - p));
    const std::size_t first = line.find_first_not_of(" \t");
    LineCursor cursor(line);
    if (first != line.npos)
      lines.push_back(
          {line, number, static_cast<std::size_t>(p - text.data()), line[first] == '#' && !cursor.find()});
    if (stop != end && *stop == '\r') ++stop;
    if (stop != end && *stop == '\n') ++stop;
    p = stop;
  }
  return lines;
}

struct Dialect {
  char separator = ',';
  char decimal = '.';
};
/// In the order of preference among those that read equally many numbers.
constexpr std::array<Dialect, 9> kDialects = {{{'\t', '.'},
                                               {';', '.'},
                                               {',', '.'},
                                               {'\t', ','},
                                               {';', ','},
                                               {'|', '.'},
                                               {'|', ','},
                                               {kBlanks, '.'},
                                               {kBlanks, ','}}};

/// What the sampled rows look like in a dialect.
struct Shape {
  Dialect dialect;
  std::size_t width = 0;    ///< Fields of a row, with an empty one at the end.
  bool ends_empty = false;  ///< All sampled rows end with an empty field.
  std::vector<CellKind> kinds;
  std::size_t numbers = 0;  ///< Cells read as numbers or times of day.
  std::size_t texts = 0;    ///< Columns of text.
};

struct RowCells {
  std::vector<Cell> cells;
  std::size_t numbers = 0;
  std::size_t texts = 0;
};

RowCells cells_of(const TextLine& line, const Dialect& dialect) {
  RowCells row;
  for (const Field& field : split_fields(dialect.separator, line.text)) {
    row.cells.push_back(read_cell(field.text, dialect.decimal));
    row.texts += row.cells.back().kind == Cell::Kind::text ? 1U : 0U;
    row.numbers +=
        row.cells.back().kind == Cell::Kind::number || row.cells.back().kind == Cell::Kind::clock ? 1U : 0U;
  }
  return row;
}

/// The number of fields that most of the last lines with numbers have.
std::size_t width_of(const std::vector<RowCells>& rows) {
  std::map<std::size_t, std::size_t> count;
  std::size_t seen = 0;
  for (const auto& row : rows) {
    if (row.numbers == 0 || seen++ >= 12) continue;
    ++count[row.cells.size()];
  }
  std::size_t best = 0;
  for (const auto& [width, times] : count)
    if (best == 0 || times >= count[best]) best = width;
  return best;
}

/// Looks at the last lines; the earliest may be a header or belong to it.
Shape shape_of(const std::vector<TextLine>& lines, std::size_t from, const Dialect& dialect) {
  Shape shape{dialect, 0, false, {}, 0, 0};
  std::vector<RowCells> rows;
  for (std::size_t i = lines.size(); i-- > from && rows.size() < kSampledRows;)
    if (!lines[i].comment) rows.push_back(cells_of(lines[i], dialect));
  shape.width = width_of(rows);
  struct Count {
    std::size_t number = 0, clock = 0, text = 0;
  };
  std::vector<Count> counts(shape.width);
  shape.ends_empty = shape.width > 1;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto& row = rows[k];
    if (row.numbers == 0 && k >= kMostEndLines) break;  // the header, or what stands above
    if (row.cells.size() != shape.width || row.numbers == 0) continue;
    for (std::size_t c = 0; c < shape.width; ++c) {
      counts[c].number += row.cells[c].kind == Cell::Kind::number ? 1U : 0U;
      counts[c].clock += row.cells[c].kind == Cell::Kind::clock ? 1U : 0U;
      counts[c].text += row.cells[c].kind == Cell::Kind::text ? 1U : 0U;
    }
    shape.ends_empty = shape.ends_empty && row.cells.back().kind == Cell::Kind::missing;
  }
  for (const Count& c : counts) {
    const bool text = c.text > c.number + c.clock;
    shape.kinds.push_back(text ? CellKind::text : c.clock > c.number ? CellKind::clock : CellKind::number);
    shape.texts += text ? 1U : 0U;
    shape.numbers += text ? 0U : c.number + c.clock;
  }
  return shape;
}

Shape best_shape(const std::vector<TextLine>& lines, std::size_t from, const TextLayout& layout) {
  std::optional<Shape> best;
  for (const Dialect& dialect : kDialects) {
    if (layout.decimal && *layout.decimal != dialect.decimal) continue;
    Shape shape = shape_of(lines, from, dialect);
    const bool better = !best || shape.numbers > best->numbers ||
                        (shape.numbers == best->numbers && shape.texts < best->texts);
    if (better) best = std::move(shape);
  }
  return std::move(*best);
}

bool is_row(const TextLine& line, const Shape& shape) {
  if (line.comment) return false;
  const RowCells row = cells_of(line, shape.dialect);
  if (row.cells.size() != shape.width || row.numbers == 0) return false;
  for (std::size_t c = 0; c < shape.width; ++c) {
    const auto kind = row.cells[c].kind;
    if (kind == Cell::Kind::missing || shape.kinds[c] == CellKind::text) continue;
    if (kind != (shape.kinds[c] == CellKind::clock ? Cell::Kind::clock : Cell::Kind::number)) return false;
  }
  return true;
}

/// The first line from which on most are rows, none of the first ones a line of names.
std::optional<std::size_t> first_row(const std::vector<TextLine>& lines, std::size_t from,
                                     const Shape& shape) {
  for (std::size_t i = from; i < lines.size(); ++i) {
    if (!is_row(lines[i], shape)) continue;
    std::size_t seen = 0, rows = 0;
    bool names = false;
    for (std::size_t j = i; j < lines.size() && seen < kRowsToBelieve; ++j) {
      if (lines[j].comment) continue;
      ++seen;
      rows += is_row(lines[j], shape) ? 1U : 0U;
      const RowCells cells = cells_of(lines[j], shape.dialect);
      names = names || (shape.width > 1 && cells.texts > 0 && cells.numbers == 0 &&
                        cells.cells.size() == shape.width && seen <= 4 && j + 1 < lines.size());
    }
    if (2 * rows >= seen && !names) return i;
  }
  return std::nullopt;
}

std::string_view name_of_separator(char separator) {
  switch (separator) {
    case '\t':
      return "tab";
    case ';':
      return "semicolon";
    case '|':
      return "bar";
    case kBlanks:
      return "blanks";
    default:
      return "comma";
  }
}

/// What was sniffed, where it is not what one would expect: "semicolons, decimal comma, names in line 3 ...".
void tell(CsvFormat& format, bool encoded) {
  std::string text;
  const auto add = [&](const std::string& phrase) { text += (text.empty() ? "" : ", ") + phrase; };
  if (format.separator != ',' || format.decimal != '.')
    add(fmt::format("columns separated by {}", name_of_separator(format.separator)));
  if (format.decimal != '.') add("decimal comma");
  const bool units =
      std::any_of(format.units.begin(), format.units.end(), [](const auto& u) { return !u.empty(); });
  const std::size_t above = format.header_line == 0 ? format.data_line : format.header_line;
  const bool named = format.names.size() > 1 && format.names[1] != "c2";
  if (format.header_line == 0 && named)
    add("names in every row");
  else if (format.header_line == 0)
    add(fmt::format("no header: columns are called c1 ... c{}", format.names.size()));
  else if (format.header_line > 1 || format.data_line > format.header_line + 1)
    add(fmt::format("names in line {}", format.header_line));
  if (units) add("units below them");
  if (format.data_line > above + 1 || format.header_line > 1)
    add(fmt::format("samples from line {}", format.data_line));
  if (encoded) add("Windows-1252 characters");
  for (std::size_t i = 0; i < format.kinds.size(); ++i)
    if (format.kinds[i] == CellKind::text && format.names[i] != fmt::format("c{}", i + 1))
      add(fmt::format("{} holds text", in_quotes(format.names[i])));
  if (!text.empty()) format.notes.push_back(text);
}

class Sniffer {
 public:
  Sniffer(const std::string& file, std::string_view text, bool complete, const TextLayout& layout)
      : file_(file), text_(text), layout_(layout), lines_(lines_of(text, complete)) {}

  expected<CsvFormat, Error> sniff() {
    if (auto from = set_beginning(); !from) return unexpected<Error>(from.error());
    if (std::all_of(lines_.begin() + static_cast<std::ptrdiff_t>(from_), lines_.end(),
                    [](const TextLine& l) { return l.comment; }))
      return fail(file_, fmt::format("holds only comments and blank lines; {}", kCsvRequirement));
    const Shape shape = best_shape(lines_, from_, layout_);
    const auto row = shape.numbers > 0 ? first_row(lines_, from_, shape) : std::nullopt;
    if (!row) return no_rows();
    if (auto other = other_rows(*row, shape)) return unexpected<Error>(*other);
    CsvFormat format;
    format.file = file_;
    format.separator = shape.dialect.separator;
    format.decimal = shape.dialect.decimal;
    format.kinds = shape.kinds;
    format.data_line = lines_[*row].number;
    format.data_offset = lines_[*row].offset;
    Header header;
    const std::span<const TextLine> above(lines_.data() + from_, *row - from_);
    const bool none = layout_.header_line && *layout_.header_line == 0;
    if (!none && names_stand_in_rows(shape)) {
      header.names = names_in_row(lines_[*row], shape);
    } else if (!none) {
      auto found =
          find_header(file_, above, {shape.width, shape.ends_empty}, format.separator, layout_.header_line);
      if (!found) return unexpected<Error>(found.error());
      header = std::move(*found);
    }
    format.header_line = header.line;
    format.sample_interval_s =
        header.sample_interval_s > 0.0 ? header.sample_interval_s : told_interval(above);
    set_names(format, std::move(header), shape);
    const auto fields = split_fields(format.separator, lines_[*row].text);
    format.without_hours.resize(format.kinds.size());
    for (std::size_t i = 0; i < format.examples.size() && i < fields.size(); ++i) {
      if (format.kinds[i] == CellKind::text) format.examples[i] = not_a_number(fields[i], format.decimal);
      format.without_hours[i] = format.kinds[i] == CellKind::clock && is_without_hours(fields[i].text);
    }
    return format;
  }

 private:
  expected<void, Error> set_beginning() {
    if (text_.empty()) return fail(file_, fmt::format("the file is empty; {}", kCsvRequirement));
    const std::size_t first = layout_.header_line && *layout_.header_line > 0
                                  ? std::max(layout_.skip_lines + 1, *layout_.header_line)
                                  : layout_.skip_lines + 1;
    while (from_ < lines_.size() && lines_[from_].number < first) ++from_;
    if (from_ < lines_.size() || lines_.empty()) return {};
    return fail(file_,
                fmt::format("holds nothing from line {} on (.skip_lines, .header_line); its last line is {}",
                            first, lines_.back().number));
  }

  [[nodiscard]] unexpected<Error> no_rows() const {
    for (const TextLine& line : lines_) {
      if (line.comment || line.number < lines_[from_].number) continue;
      const bool several = line.text.find_first_of(",;\t") != line.text.npos;
      if (several && &line == &lines_.back())
        return fail(file_,
                    fmt::format("has a header (line {}) but no samples; {}", line.number, kCsvRequirement));
    }
    const auto text = std::find_if(lines_.begin() + static_cast<std::ptrdiff_t>(from_), lines_.end(),
                                   [](const TextLine& l) { return !l.comment; });
    return fail(file_, fmt::format("holds no rows of numbers (line {} is {}); {}", text->number,
                                   in_quotes(as_utf8(std::string(text->text))), kCsvRequirement));
  }

  /// Rows of another width above the first one: channels that end early, or another table.
  [[nodiscard]] std::optional<Error> other_rows(std::size_t row, const Shape& shape) const {
    constexpr std::size_t kPreamble = 2;  // lines of numbers only
    std::size_t rows = 0;
    const TextLine* first = nullptr;
    for (std::size_t i = from_; i < row; ++i) {
      if (lines_[i].comment) continue;
      const RowCells cells = cells_of(lines_[i], shape.dialect);
      const bool numbers = std::none_of(cells.cells.begin(), cells.cells.end(),
                                        [](const Cell& c) { return c.kind == Cell::Kind::text; });
      if (!numbers || cells.numbers < 2) continue;
      if (rows++ == 0) first = &lines_[i];
    }
    if (rows <= kPreamble) return std::nullopt;
    return Error{
        {},
        fmt::format(
            "has {} fields, from line {} on rows have {}: signals of different length or rate; export all "
            "columns with one sample time, or say where the rows begin (.skip_lines)",
            cells_of(*first, shape.dialect).cells.size(), lines_[row].number, shape.width),
        std::nan(""),
        fmt::format("{}: line {}", file_, first->number)};
  }

  /// `torque 1.5 velocity 3.2`: text and number in turn.
  static bool names_stand_in_rows(const Shape& shape) {
    if (shape.width < 4 || shape.width % 2 != 0) return false;
    for (std::size_t i = 0; i < shape.width; ++i)
      if ((shape.kinds[i] == CellKind::text) != (i % 2 == 0)) return false;
    return true;
  }
  static std::vector<std::string> names_in_row(const TextLine& line, const Shape& shape) {
    std::vector<std::string> names(shape.width);
    const auto fields = split_fields(shape.dialect.separator, line.text);
    for (std::size_t i = 1; i < fields.size(); i += 2) names[i] = fields[i - 1].text;
    return names;
  }

  static void set_names(CsvFormat& format, Header header, const Shape& shape) {
    std::size_t width = shape.width;
    const bool named_to_the_end = header.names.size() == width && !header.names.back().empty();
    if (shape.ends_empty && !named_to_the_end) {
      format.trailing_separator = true;
      --width;
    } else {
      format.trailing_separator = header.names.size() == width + 1;
    }
    format.kinds.resize(width);
    format.examples.resize(width);
    header.names.resize(width);
    header.units.resize(width);
    bool encoded = false;
    for (std::size_t i = 0; i < width; ++i) {
      encoded = encoded || !is_utf8(header.names[i]) || !is_utf8(header.units[i]);
      std::string name = as_utf8(header.names[i]);
      if (name.empty()) name = fmt::format("c{}", i + 1);
      const std::string plain = name;
      for (std::size_t k = 2; std::find(format.names.begin(), format.names.end(), name) != format.names.end();
           ++k)
        name = fmt::format("{}#{}", plain, k);
      format.names.push_back(name);
      format.units.push_back(as_utf8(header.units[i]));
    }
    tell(format, encoded);
  }

  const std::string& file_;
  std::string_view text_;
  const TextLayout& layout_;
  std::vector<TextLine> lines_;
  std::size_t from_ = 0;
};

}  // namespace

expected<CsvFormat, Error> sniff_layout(const std::string& file, std::string_view text, bool complete,
                                        const TextLayout& layout) {
  return Sniffer(file, text, complete, layout).sniff();
}

}  // namespace resonid::io
