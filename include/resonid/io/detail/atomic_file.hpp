// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <resonid/base/expected.hpp>
#include <string_view>

namespace resonid::io {

/// Writes a file so that it appears complete or not at all: a temporary file in the same folder is written,
/// flushed to the disk and renamed over the target. On failure the target is as it was and the temporary file
/// is gone.
///
/// An existing file keeps its permissions, a symbolic link is followed. What is not a regular file
/// (`/dev/null`, a pipe) is written directly. Parent folders are not made.
[[nodiscard]] expected<void, Error> write_file_atomically(const std::filesystem::path& path,
                                                          std::string_view contents);

/// The same for contents that are too long to be held at once: written piece by piece, it appears with
/// commit() and not at all without.
class AtomicFile {
 public:
  [[nodiscard]] static expected<AtomicFile, Error> create(const std::filesystem::path& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();  ///< Without commit() nothing is left.

  [[nodiscard]] expected<void, Error> write(std::string_view piece);
  [[nodiscard]] expected<void, Error> commit();

 private:
  AtomicFile() = default;
  [[nodiscard]] unexpected<Error> failed(int code) const;

  std::filesystem::path path_, target_, temporary_;  // as named; links followed; empty: written directly
  int descriptor_ = -1;
};

/// For a program that is ended by a signal: removes the temporary files of all that is being written. Whoever
/// writes a file afterwards waits forever; the program has to end.
void remove_unfinished_files();

/// The same refusals, as far as they can be told before there is anything to write: a folder that is not
/// there or takes no files, a target that is a folder or write-protected. For work that takes long.
[[nodiscard]] expected<void, Error> check_writable(const std::filesystem::path& path);

}  // namespace resonid::io
