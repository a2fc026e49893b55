// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <resonid/io/detail/table.hpp>
#include <thread>

#include "io/csv_format.hpp"
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
  std::optional<Error> read_failure;
  std::optional<std::string> bad_line;  ///< The text of the line after `lines` lines, when it is not a row.
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
      if (!read_lines({buffer.get(), whole})) return;
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

  bool read_lines(std::string_view text) {
    LineCursor cursor(text);
    const std::size_t lines_before = region_.lines;
    while (cursor.find()) {
      const std::size_t line = lines_before + cursor.lines();
      if (!scan_row(cursor)) {
        const std::string_view rest = cursor.rest_of_line();
        if (!read_csv_row(format_, rest, line, row_)) {
          region_.lines = line;
          region_.bad_line = std::string(rest);
          return false;
        }
        cursor.move_to(rest.data() + rest.size());
      }
      store(line);
      cursor.end_line();
    }
    region_.lines = lines_before + cursor.lines();
    if (!reserved_) reserve(text.size());
    return true;
  }

  /// Reads a line of plain numbers and stops before its end; false, with nothing moved, when it is anything
  /// else.
  bool scan_row(LineCursor& cursor) noexcept {
    const char* p = cursor.position();
    const char* const end = cursor.end();
    const std::size_t width = row_.size();
    for (std::size_t i = 0; i < width; ++i) {
      if (i > 0 && *p++ != format_.separator) return false;
      while (format_.is_blank(*p)) ++p;
      p = parse_number(p, end, row_[i]);
      if (p == nullptr) return false;
      while (format_.is_blank(*p)) ++p;
    }
    if (format_.trailing_separator && *p == format_.separator) {
      ++p;
      while (format_.is_blank(*p)) ++p;
    }
    if (*p != '\n' && *p != '\r' && p != end) return false;
    cursor.move_to(p);
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
};

/// Reads the header from as much of the file's beginning as it takes.
expected<CsvFormat, Error> read_header(const TextSource& source) {
  for (std::size_t wanted = kPieceBytes;; wanted *= 4) {
    std::string text(std::min(wanted, source.size()), '\0');
    const auto got = source.read(0, text.data(), text.size());
    if (!got) return unexpected<Error>(got.error());
    text.resize(*got);
    auto format = read_csv_header(source.name(), text);
    const bool complete = format && format->data_offset < text.size();
    if (complete || wanted >= source.size()) return format;
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

/// Puts the regions behind one another; the first error in the file's order is the one that counts.
expected<Table, Error> joined(const CsvFormat& format, std::vector<Region>& regions) {
  Table table;
  table.source = format.file;
  table.names = format.names;
  table.columns = std::move(regions.front().columns);
  std::size_t rows = 0;
  std::size_t line = format.header_line + 1;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    Region& region = regions[i];
    if (region.read_failure) return unexpected<Error>(*region.read_failure);
    if (region.bad_line) {
      std::vector<double> row(format.names.size());
      if (auto read = read_csv_row(format, *region.bad_line, line + region.lines, row); !read)
        return unexpected<Error>(read.error());
    }
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
  return table;
}

}  // namespace

expected<Table, Error> read_csv(const std::filesystem::path& path) {
  const auto source = TextSource::open(path);
  if (!source) return unexpected<Error>(source.error());
  const auto format = read_header(*source);
  if (!format) return unexpected<Error>(format.error());
  auto regions = divide(*source, format->data_offset);
  if (!regions) return unexpected<Error>(regions.error());
  read_regions(*source, *format, *regions);
  auto table = joined(*format, *regions);
  if (!table) return table;
  const std::size_t rows = table->columns.front().size();
  if (rows == 0)
    return fail(format->file, fmt::format("has a header (line {}) but no samples; {}", format->header_line,
                                          kCsvRequirement));
  if (rows == 1)
    return fail(format->file,
                fmt::format("has only one row of samples ({}); at least 2 are required", table->place(0)));
  return table;
}

}  // namespace resonid::io
