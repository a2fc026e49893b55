// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>

namespace resonid::io {

/// The path that stands for standard input.
inline constexpr std::string_view kStandardInput = "-";

/// Whether a file begins like a MAT file of version 5 or 7.3, or like any other HDF5 file.
[[nodiscard]] bool is_mat(std::string_view beginning) noexcept;

/// The bytes of a file, readable at any offset and from several threads. What is no plain file (a pipe,
/// standard input), is packed (gzip) or UTF-16 is taken into memory when opened, unpacked and as UTF-8.
/// Errors: no such file, a folder, a zip archive or workbook.
class TextSource {
 public:
  static expected<TextSource, Error> open(const std::filesystem::path& path);
  TextSource(TextSource&& other) noexcept;
  TextSource(const TextSource&) = delete;
  TextSource& operator=(const TextSource&) = delete;
  TextSource& operator=(TextSource&&) = delete;
  ~TextSource();

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }

  /// What the file was before it became plain text, "gzip, UTF-16"; empty for nothing.
  [[nodiscard]] const std::string& form() const noexcept { return form_; }
  /// All of what was taken into memory; empty where the file is read as it is.
  [[nodiscard]] std::string_view memory() const noexcept { return memory_; }

  /// Copies up to `count` bytes that begin at `offset`. Fewer come only at the end of the file.
  expected<std::size_t, Error> read(std::size_t offset, char* buffer, std::size_t count) const;

 private:
  explicit TextSource(std::string name) : name_(std::move(name)) {}
  [[nodiscard]] unexpected<Error> failure(int code) const;
  expected<void, Error> take_all();
  expected<void, Error> take_into_memory();
  expected<void, Error> make_plain();

  std::string name_;
  int descriptor_ = -1;
  std::size_t size_ = 0;
  std::string memory_;  // of what is no plain file
  std::string form_;
};

}  // namespace resonid::io
