// SPDX-License-Identifier: MIT
#include "io/csv_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <resonid/io/detail/table.hpp>
#include <thread>

#include "io/csv_format.hpp"
#include "io/csv_layout.hpp"
#include "io/csv_number.hpp"
#include "io/text_source.hpp"

namespace resonid::io {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 18;   // stays in the second-level cache
constexpr std::size_t kRegionBytes = std::size_t{1} << 21;  // what is worth a thread of its own
constexpr std::size_t kMostRegions = 8;

/// Whole lines of a file, read by one thread piece by piece; lines and rows count from the region's
/// beginning.
struct Region {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t reserved_bytes = 0;  ///< Bytes of text for whose rows memory is set aside.
  std::vector<std::vector<double>> columns;
  std::vector<Table::LineRun> line_runs;
  std::size_t rows = 0;
  std::size_t lines = 0;
  std::size_t comments = 0;
  std::size_t remarks = 0;       ///< Lines of words among the rows ...
  std::size_t first_remark = 0;  ///< ... and the first of them.
  std::optional<Error> read_failure;
  std::optional<std::string> bad_line;  ///< The text of the line after `lines` lines, when it is not a row.
  std::size_t bad_offset = 0;           ///< Byte at which that line begins.
};

/// Reads the lines of one region. Rows go through a fast scanner; a line that it does not understand is read
/// again field by field, either to accept it (quoted numbers) or to end the region with it.
class RegionReader {
 public:
  RegionReader(const TextSource& source, const CsvFormat& format, Region& region)
      : source_(source), format_(format), region_(region), row_(format.names.size()) {
    region_.columns.resize(format.names.size());
  }

  void read() {
    std::size_t capacity = kPieceBytes;
    auto buffer = allocate(capacity);
    std::size_t filled = 0;
    plain_ = std::all_of(format_.kinds.begin(), format_.kinds.end(),
                         [](CellKind kind) { return kind == CellKind::number; });
    for (std::size_t offset = region_.begin; offset < region_.end;) {
      const auto got =
          source_.read(offset, buffer.get() + filled, std::min(capacity - filled, region_.end - offset));
      if (!got) region_.read_failure = got.error();
      if (!got) return;
      filled += *got;
      offset = *got == 0 ? region_.end : offset + *got;
      const bool last = offset == region_.end;
      const std::size_t whole = last ? filled : whole_lines(buffer.get(), filled);
      if (whole == 0 && !last) {  // one line fills the buffer
        auto larger = allocate(2 * capacity);
        std::memcpy(larger.get(), buffer.get(), filled);
        buffer = std::move(larger);
        capacity *= 2;
        continue;
      }
      std::memset(buffer.get() + filled, 0, kNumberPadding);
      if (!read_lines({buffer.get(), whole}, offset - filled)) return;
      std::memmove(buffer.get(), buffer.get() + whole, filled - whole);
      filled -= whole;
    }
  }

 private:
  static std::unique_ptr<char[]> allocate(std::size_t capacity) {
    return std::unique_ptr<char[]>(new char[capacity + kNumberPadding]);  // not filled with zeros
  }

  static std::size_t whole_lines(const char* text, std::size_t size) {
    while (size > 0 && text[size - 1] != '\n') --size;
    return size;
  }

  /// `offset`: of the text in the file.
  bool read_lines(std::string_view text, std::size_t offset) {
    LineCursor cursor(text);
    const std::size_t lines_before = region_.lines;
    while (cursor.find()) {
      const std::size_t line = lines_before + cursor.lines();
      if (!scan_row(cursor)) {
        const std::string_view rest = cursor.rest_of_line();
        if (is_remark(rest)) {
          if (region_.remarks++ == 0) region_.first_remark = line;
          cursor.move_to(rest.data() + rest.size());
          cursor.end_line();
          continue;
        }
        if (!read_csv_row(format_, rest, line, row_)) {
          region_.lines = line;
          region_.bad_line = std::string(rest);
          region_.bad_offset = offset + static_cast<std::size_t>(rest.data() - text.data());
          return false;
        }
        cursor.move_to(rest.data() + rest.size());
      }
      store(line);
      cursor.end_line();
    }
    region_.lines = lines_before + cursor.lines();
    region_.comments += cursor.comments();
    if (!reserved_) reserve(text.size());
    return true;
  }

  /// A line of words among the samples, "overrun", "Pause": one field where there are several, and no digit.
  [[nodiscard]] bool is_remark(std::string_view line) const {
    constexpr std::string_view kNoRemark = "0123456789\",;|\t";
    constexpr std::size_t kLongest = 80;
    const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
    return row_.size() > 1 && line.size() < kLongest && line.find_first_of(kNoRemark) == line.npos &&
           std::count_if(line.begin(), line.end(), letter) > 2 &&
           (format_.separator != kBlanks || split_fields(kBlanks, line).size() < row_.size());
  }

  /// Reads a line of plain numbers and empty fields and stops before its end; false, with nothing moved, when
  /// it is anything else.
  bool scan_row(LineCursor& cursor) noexcept {
    if (!plain_) return false;
    const char* p = cursor.position();
    const char* const end = cursor.end();
    const std::size_t width = row_.size();
    const bool blanks = format_.separator == kBlanks;
    while (format_.is_blank(*p)) ++p;
    for (std::size_t i = 0; i < width; ++i) {
      if (i > 0 && !blanks && *p++ != format_.separator) return false;
      while (!blanks && format_.is_blank(*p)) ++p;
      if (!scan_number(p, end, row_[i])) return false;
      const char* const after = p;
      while (format_.is_blank(*p)) ++p;
      if (blanks && p == after && i + 1 < width) return false;
    }
    if (format_.trailing_separator && *p == format_.separator) {
      ++p;
      while (format_.is_blank(*p)) ++p;
    }
    if (*p != '\n' && *p != '\r' && p != end) return false;
    cursor.move_to(p);
    return true;
  }

  /// A number, or nothing before the next separator.
  bool scan_number(const char*& p, const char* end, double& value) const noexcept {
    const char* const after = parse_number(p, end, value, format_.decimal);
    if (after == nullptr) {
      value = std::numeric_limits<double>::quiet_NaN();
      return format_.separator != kBlanks &&
             (*p == format_.separator || *p == '\n' || *p == '\r' || p == end);
    }
    p = after;
    return true;
  }

  void store(std::size_t line) {
    if (line - region_.rows != skipped_lines_ || region_.rows == 0) {
      skipped_lines_ = line - region_.rows;
      region_.line_runs.push_back({region_.rows, line});
    }
    for (std::size_t i = 0; i < row_.size(); ++i) region_.columns[i].push_back(row_[i]);
    ++region_.rows;
  }

  /// Sets memory aside for all rows, as many per byte as in the first piece.
  void reserve(std::size_t bytes) {
    reserved_ = true;
    const double pieces = static_cast<double>(region_.reserved_bytes) / static_cast<double>(bytes);
    if (pieces <= 1.0) return;
    const auto rows = static_cast<std::size_t>(1.02 * pieces * static_cast<double>(region_.rows));
    for (auto& column : region_.columns) column.reserve(rows);
  }

  const TextSource& source_;
  const CsvFormat& format_;
  Region& region_;
  std::vector<double> row_;
  std::size_t skipped_lines_ = 0;
  bool reserved_ = false;
  bool plain_ = false;  // no times of day, no text
};

/// Sniffs from as much of the file's beginning as it takes.
expected<CsvFormat, Error> sniff(const TextSource& source, const TextLayout& layout) {
  constexpr std::size_t kFewestLines = 8;  // in a piece that is not all
  for (std::size_t wanted = kPieceBytes;; wanted *= 4) {
    std::string text(std::min(wanted, source.size()), '\0');
    const auto got = source.read(0, text.data(), text.size());
    if (!got) return unexpected<Error>(got.error());
    text.resize(*got);
    const bool all = text.size() >= source.size();
    const bool enough = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) >= kFewestLines;
    if (!all && !enough) continue;
    auto format = sniff_layout(source.name(), text, all, layout);
    if (format || all) return format;
  }
}

/// The offset of the first line that begins at or after `offset`.
expected<std::size_t, Error> line_begin(const TextSource& source, std::size_t offset) {
  std::string text(4096, '\0');
  for (--offset; offset < source.size();) {
    const auto got = source.read(offset, text.data(), text.size());
    if (!got) return unexpected<Error>(got.error());
    const std::size_t found = std::string_view(text.data(), *got).find('\n');
    if (found != std::string_view::npos) return offset + found + 1;
    if (*got == 0) break;
    offset += *got;
  }
  return source.size();
}

expected<std::vector<Region>, Error> divide(const TextSource& source, std::size_t begin) {
  const std::size_t bytes = source.size() - begin;
  const std::size_t threads = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t count = std::clamp<std::size_t>(bytes / kRegionBytes, 1, std::min(kMostRegions, threads));
  std::vector<Region> regions(count);
  for (std::size_t i = 0; i < count; ++i) {
    regions[i].begin = i == 0 ? begin : regions[i - 1].end;
    const auto end =
        i + 1 == count ? expected<std::size_t, Error>(source.size())
                       : line_begin(source, std::max(regions[i].begin + 1, begin + bytes * (i + 1) / count));
    if (!end) return unexpected<Error>(end.error());
    regions[i].end = *end;
    regions[i].reserved_bytes = i == 0 ? bytes : regions[i].end - regions[i].begin;
  }
  return regions;
}

void read_regions(const TextSource& source, const CsvFormat& format, std::vector<Region>& regions) {
  std::vector<std::thread> threads;
  for (std::size_t i = 1; i < regions.size(); ++i)
    threads.emplace_back([&, i] { RegionReader(source, format, regions[i]).read(); });
  RegionReader(source, format, regions[0]).read();
  for (auto& thread : threads) thread.join();
}

/// What stands below the rows.
struct Ending {
  std::string note;  ///< Empty when it is nothing that may be left out.
};

/// Whether what begins at a line that is no row may be left out: the last line of a file that ends in the
/// middle of it, or a few lines of text, as of statistics or an end mark, without a row among them.
expected<Ending, Error> ending(const TextSource& source, const CsvFormat& format, std::size_t offset,
                               std::size_t line) {
  constexpr std::size_t kMostTail = 4096;
  constexpr std::size_t kMostBelow = 20;
  if (source.size() - offset > kMostTail) return Ending();
  std::string text(source.size() - offset, '\0');
  const auto got = source.read(offset, text.data(), text.size());
  if (!got) return unexpected<Error>(got.error());
  text.resize(*got);
  const bool torn = text.find_first_of("\r\n") == text.npos;
  if (torn && split_fields(format.separator, text).size() <= format.names.size())
    return Ending{fmt::format("the last line ({}) is not complete and left out", line)};
  std::vector<double> row(format.names.size());
  std::size_t lines = 0;
  text.append(kNumberPadding, '\0');
  LineCursor cursor(std::string_view(text).substr(0, text.size() - kNumberPadding));
  for (; cursor.find(); cursor.end_line(), ++lines) {
    const auto rest = cursor.rest_of_line();
    const auto fields = split_fields(format.separator, rest);
    const bool numeric = read_cell(fields.front().text, format.decimal).kind == Cell::Kind::number;
    if (numeric || lines >= kMostBelow || read_csv_row(format, rest, 0, row)) return Ending();
    cursor.move_to(rest.data() + rest.size());
  }
  return Ending{fmt::format("the text from line {} on is left out", line)};
}

/// Times of one recording: a clock that begins anew with the day, or with the hour where it shows none, goes
/// on. Says how they were read.
std::string read_times(const std::string& name, bool without_hours, std::vector<double>& time) {
  constexpr double kDay = 86400.0, kHour = 3600.0;
  const bool of_the_hour =
      without_hours && std::none_of(time.begin(), time.end(), [](double t) { return t >= kHour; });
  const double turn = of_the_hour ? kHour : kDay;
  double turns = 0.0;
  double before = time.empty() ? 0.0 : time.front();
  for (double& t : time) {
    if (std::isnan(t)) continue;
    if (t < before - 0.5 * turn) turns += 1.0;
    before = t;
    t += turns * turn;
  }
  std::string note = fmt::format("{} read as {}", in_quotes(name),
                                 without_hours ? "minutes and seconds (mm:ss)" : "HH:MM:SS");
  if (turns > 0.0) note += fmt::format(", going on after {}", of_the_hour ? "the full hour" : "midnight");
  return note;
}

/// Puts the regions behind one another; the first error in the file's order is the one that counts.
expected<Table, Error> joined(const TextSource& source, const CsvFormat& format,
                              std::vector<Region>& regions) {
  Table table;
  table.source = format.file;
  table.names = format.names;
  table.units = format.units;
  table.notes = format.notes;
  table.sample_interval_s = format.sample_interval_s;
  table.columns = std::move(regions.front().columns);
  std::size_t rows = 0;
  std::size_t comments = 0;
  std::size_t line = format.data_line;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    Region& region = regions[i];
    if (region.read_failure) return unexpected<Error>(*region.read_failure);
    if (region.bad_line) {
      const auto end = ending(source, format, region.bad_offset, line + region.lines);
      if (!end) return unexpected<Error>(end.error());
      std::vector<double> row(format.names.size());
      auto read = read_csv_row(format, *region.bad_line, line + region.lines, row);
      if (end->note.empty() && !read) return unexpected<Error>(read.error());
      if (!end->note.empty()) table.notes.push_back(end->note);
    }
    comments += region.comments;
    if (region.remarks > 0)
      table.notes.push_back(fmt::format("{} line{} of words left out from line {} on", region.remarks,
                                        region.remarks == 1 ? "" : "s", line + region.first_remark));
    for (std::size_t c = 0; i > 0 && c < table.columns.size(); ++c) {
      table.columns[c].insert(table.columns[c].end(), region.columns[c].begin(), region.columns[c].end());
      std::vector<double>().swap(region.columns[c]);
    }
    for (const auto& run : region.line_runs) {
      const bool continues =
          !table.line_runs.empty() &&
          table.line_runs.back().line + rows + run.row - table.line_runs.back().row == line + run.line;
      if (!continues) table.line_runs.push_back({rows + run.row, line + run.line});
    }
    rows += region.rows;
    line += region.lines;
  }
  if (comments > 0)
    table.notes.push_back(
        fmt::format("{} comment{} (#) among the samples left out", comments, comments == 1 ? "" : "s"));
  return table;
}

/// The last number of a file without a line end may be cut: then it has fewer digits than the one above it.
void drop_cut_row(const TextSource& source, const CsvFormat& format, Table& table) {
  constexpr std::size_t kTail = 4096;
  const std::size_t begin = source.size() - std::min(source.size(), kTail);
  std::string text(source.size() - begin, '\0');
  const auto got = source.read(begin, text.data(), text.size());
  if (!got || *got != text.size() || text.empty() || text.back() == '\n' || text.back() == '\r') return;
  const auto last_number = [&](std::string_view line) {
    const std::size_t at = line.find_last_of(std::string{format.separator, '\t', ' '});
    return line.substr(at == line.npos ? 0 : at + 1);
  };
  const std::string_view all(text);
  const std::size_t at = all.find_last_of("\r\n");
  if (at == all.npos || at == 0) return;
  const std::string_view last = last_number(all.substr(at + 1));
  std::size_t end = all.find_last_not_of("\r\n", at);
  if (end == all.npos) return;
  const std::size_t before = all.find_last_of("\r\n", end);
  if (before == all.npos) return;
  const std::string_view above = last_number(all.substr(before + 1, end - before));
  constexpr std::size_t kFewer = 2;  // writers leave out zeros at the end
  if (last.size() + kFewer > above.size() || table.columns.front().size() < 3) return;
  for (auto& column : table.columns) column.pop_back();
  table.notes.emplace_back(
      "the file ends without a line end, maybe within a number: the last line is left out");
}

/// Whole numbers of which most repeat the one before: `14:03` are hours and minutes of the day, no stamps.
bool hardly_runs(const std::vector<double>& time) {
  std::size_t repeated = 0;
  for (std::size_t k = 1; k < time.size(); ++k) repeated += time[k] == time[k - 1] ? 1U : 0U;
  return 2 * repeated > time.size() &&
         std::all_of(time.begin(), time.end(), [](double t) { return std::isnan(t) || t == std::round(t); });
}

/// Columns of text are no signals; times go on.
void set_aside_text(const CsvFormat& format, Table& table) {
  for (std::size_t c = format.kinds.size(); c-- > 0;) {
    const bool coarse = format.without_hours[c] && hardly_runs(table.columns[c]);
    if (format.kinds[c] == CellKind::clock && !coarse) {
      table.notes.push_back(read_times(table.names[c], format.without_hours[c], table.columns[c]));
      table.units[c] = "s";
    }
    if (format.kinds[c] != CellKind::text && !coarse) continue;
    table.unusable.push_back({table.names[c], coarse ? "holds times that hardly run"
                                              : format.examples[c].empty()
                                                  ? "holds text"
                                                  : "holds text: " + format.examples[c]});
    const auto at = static_cast<std::ptrdiff_t>(c);
    table.names.erase(table.names.begin() + at);
    table.units.erase(table.units.begin() + at);
    table.columns.erase(table.columns.begin() + at);
  }
}

}  // namespace

expected<Table, Error> read_csv(const TextSource& source, const TextLayout& layout) {
  const auto format = sniff(source, layout);
  if (!format) return unexpected<Error>(format.error());
  auto regions = divide(source, format->data_offset);
  if (!regions) return unexpected<Error>(regions.error());
  read_regions(source, *format, *regions);
  auto table = joined(source, *format, *regions);
  if (!table) return table;
  const std::size_t rows = table->columns.front().size();
  if (rows == 0)
    return fail(format->file, fmt::format("has a header (line {}) but no samples; {}", format->header_line,
                                          kCsvRequirement));
  if (rows == 1)
    return fail(format->file,
                fmt::format("has only one row of samples ({}); at least 2 are required", table->place(0)));
  if (!source.form().empty()) table->notes.insert(table->notes.begin(), source.form());
  drop_cut_row(source, *format, *table);
  set_aside_text(*format, *table);
  return table;
}

expected<Table, Error> read_csv(const std::filesystem::path& path, const TextLayout& layout) {
  const auto source = TextSource::open(path);
  if (!source) return unexpected<Error>(source.error());
  return read_csv(*source, layout);
}

}  // namespace resonid::io
