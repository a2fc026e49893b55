// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <resonid/io/detail/table.hpp>
#include <string_view>

#include "io/csv_reader.hpp"
#include "io/text.hpp"
#include "io/text_source.hpp"

namespace resonid::io {
namespace {

constexpr std::string_view kHdf5Signature("\x89HDF\r\n\x1a\n", 8);

}  // namespace

// MAT 5 and 7.3 begin with a text; an HDF5 file that is not one of them is better refused by read_mat().
bool is_mat(std::string_view head) noexcept {
  const auto starts = [&](std::string_view text) { return head.substr(0, text.size()) == text; };
  return starts("MATLAB 5.0 MAT-file") || starts("MATLAB 7.3 MAT-file") || starts(kHdf5Signature) ||
         (head.size() >= 128 && (head.substr(126, 2) == "IM" || head.substr(126, 2) == "MI") &&
          head.find('\0') != std::string_view::npos);
}

std::string Table::place(std::size_t row) const {
  const auto after = std::upper_bound(line_runs.begin(), line_runs.end(), row,
                                      [](std::size_t r, const LineRun& run) { return r < run.row; });
  if (after == line_runs.begin()) return fmt::format("element {}", row + 1);
  const LineRun& run = *(after - 1);
  return fmt::format("line {}", row - run.row + run.line);
}

expected<Table, Error> read_table(const std::filesystem::path& path, const TextLayout& layout) {
  const auto source = TextSource::open(path);
  if (!source) return unexpected<Error>(source.error());
  std::string head(128, '\0');
  const auto got = source->read(0, head.data(), head.size());
  if (!got) return unexpected<Error>(got.error());
  head.resize(*got);
  if (is_mat(head) || lower(path.extension().string()) == ".mat") return read_mat(*source, path);
  return read_csv(*source, layout);
}

}  // namespace resonid::io
