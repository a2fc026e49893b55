// SPDX-License-Identifier: MIT
#include "row_writer.hpp"

#include <cmath>
#include <iterator>
#include <resonid/base/error_text.hpp>
#include <stdexcept>
#include <string_view>

#include "output.hpp"

namespace resonid::cli {

RowWriter::RowWriter(const std::string& path) : standard_output_(path == "-") {
  if (standard_output_) return;
  auto file = io::AtomicFile::create(path);
  if (!file) throw std::runtime_error(message_of(file.error()));
  file_.emplace(std::move(*file));
}

void RowWriter::columns(std::span<const std::string> names) {
  for (std::size_t i = 0; i < names.size(); ++i)
    fmt::format_to(std::back_inserter(text_), "{}{}", i == 0 ? "" : ",", names[i]);
  end_line();
}

void RowWriter::row(std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) text_.push_back(',');
    if (std::isfinite(values[i])) fmt::format_to(std::back_inserter(text_), "{:.10g}", values[i]);
  }
  end_line();
}

void RowWriter::finish() {
  flush();
  if (!file_) return;
  if (const auto done = file_->commit(); !done) throw std::runtime_error(message_of(done.error()));
}

void RowWriter::end_line() {
  constexpr std::size_t kPiece = std::size_t{1} << 20U;
  text_.push_back('\n');
  if (text_.size() >= kPiece) flush();
}

void RowWriter::flush() {
  const std::string_view piece(text_.data(), text_.size());
  if (standard_output_) {
    print(piece);
  } else if (const auto written = file_->write(piece); !written) {
    throw std::runtime_error(message_of(written.error()));
  }
  text_.clear();
}

}  // namespace resonid::cli
