// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/format.h>

#include <optional>
#include <resonid/io/detail/atomic_file.hpp>
#include <span>
#include <string>

namespace resonid::cli {

/// Rows as CSV, ten significant digits, written as they come: those of a long recording may not fit in
/// memory. The file (`-`: standard output) is there with finish(), complete, or not at all. What cannot be
/// written ends as std::runtime_error.
class RowWriter {
 public:
  explicit RowWriter(const std::string& path);

  void columns(std::span<const std::string> names);
  /// A value that is not finite is an empty field.
  void row(std::span<const double> values);
  void finish();

 private:
  void end_line();
  void flush();

  bool standard_output_;
  std::optional<io::AtomicFile> file_;
  fmt::memory_buffer text_;
};

}  // namespace resonid::cli
