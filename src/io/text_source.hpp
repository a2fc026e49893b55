// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <resonid/base/expected.hpp>
#include <string>

namespace resonid::io {

/// The bytes of a file, readable at any offset and from several threads. A pipe is taken into memory when
/// opened.
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

  /// Copies up to `count` bytes that begin at `offset`. Fewer come only at the end of the file.
  expected<std::size_t, Error> read(std::size_t offset, char* buffer, std::size_t count) const;

 private:
  explicit TextSource(std::string name) : name_(std::move(name)) {}
  [[nodiscard]] unexpected<Error> failure(int code) const;

  std::string name_;
  int descriptor_ = -1;
  std::size_t size_ = 0;
  std::string memory_;  // of a pipe
};

}  // namespace resonid::io
