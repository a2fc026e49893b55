// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <resonid/io/detail/table.hpp>
#include <string_view>

#include "io/text.hpp"
#include "io/text_source.hpp"

namespace resonid::io {
namespace {

constexpr std::string_view kHdf5Signature("\x89HDF\r\n\x1a\n", 8);

/// MAT 5 and 7.3 begin with a text; an HDF5 file that is not one of them is better refused by read_mat().
bool begins_like_mat(std::string_view head) {
  const auto starts = [&](std::string_view text) { return head.substr(0, text.size()) == text; };
  return starts("MATLAB 5.0 MAT-file") || starts("MATLAB 7.3 MAT-file") || starts(kHdf5Signature) ||
         (head.size() >= 128 && (head.substr(126, 2) == "IM" || head.substr(126, 2) == "MI") &&
          head.find('\0') != std::string_view::npos);
}

}  // namespace

std::string Table::place(std::size_t row) const {
  const auto after = std::upper_bound(line_runs.begin(), line_runs.end(), row,
                                      [](std::size_t r, const LineRun& run) { return r < run.row; });
  if (after == line_runs.begin()) return fmt::format("element {}", row + 1);
  const LineRun& run = *(after - 1);
  return fmt::format("line {}", row - run.row + run.line);
}

expected<Table, Error> read_table(const std::filesystem::path& path) {
  const auto source = TextSource::open(path);
  if (!source) return unexpected<Error>(source.error());
  std::string head(128, '\0');
  const auto got = source->read(0, head.data(), head.size());
  if (!got) return unexpected<Error>(got.error());
  head.resize(*got);
  if (begins_like_mat(head) || lower(path.extension().string()) == ".mat") return read_mat(path);
  return read_csv(path);
}

}  // namespace resonid::io
