// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cmath>
#include <mutex>
#include <optional>
#include <resonid/io/detail/atomic_file.hpp>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace resonid::io {
namespace {

namespace fs = std::filesystem;

unexpected<Error> cannot_write(const fs::path& path, std::string_view why) {
  return unexpected<Error>(Error{{}, fmt::format("cannot write: {}", why), std::nan(""), path.string()});
}

std::string system_message(int code) { return std::generic_category().message(code); }

bool write_all(int descriptor, std::string_view contents) {
  while (!contents.empty()) {
    const ::ssize_t written = ::write(descriptor, contents.data(), contents.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    contents.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// A name that no other writer of this or another process uses at the same time, and short enough for any
/// target.
fs::path temporary_name(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  const std::string stem = target.filename().string().substr(0, 200);
  return target.parent_path() / fmt::format(".{}.{}-{}.tmp", stem, ::getpid(), counter.fetch_add(1));
}

/// Makes the rename itself last through a power cut; a file system that cannot is no reason to fail.
void flush_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  static_cast<void>(::fsync(descriptor));
  ::close(descriptor);
}

/// Where a path leads, and what is there.
struct Target {
  fs::path file;                 ///< Symbolic links followed.
  bool special = false;          ///< Not a regular file: written directly.
  std::optional<::mode_t> mode;  ///< Permissions of the file that is there.
};

expected<Target, Error> target_of(const fs::path& path) {
  if (path.empty()) return cannot_write(path, "the file name is empty");
  std::error_code code;
  Target target{path, false, {}};
  if (fs::is_symlink(path, code)) {
    target.file = fs::weakly_canonical(path, code);
    if (code) return cannot_write(path, code.message());
  }
  const fs::path folder = target.file.parent_path();
  const fs::file_status folder_status = fs::status(folder.empty() ? fs::path(".") : folder, code);
  if (!fs::exists(folder_status))
    return cannot_write(path, fmt::format("there is no folder '{}'", folder.string()));
  if (!fs::is_directory(folder_status))
    return cannot_write(path, fmt::format("'{}' is not a folder", folder.string()));

  struct ::stat status {};
  if (::stat(target.file.c_str(), &status) != 0) return target;
  if (S_ISDIR(status.st_mode)) return cannot_write(path, "this is a folder, a file is required");
  target.special = !S_ISREG(status.st_mode);
  if (target.special) return target;
  if (::access(target.file.c_str(), W_OK) != 0) return cannot_write(path, system_message(errno));
  target.mode = status.st_mode & 07777U;
  return target;
}

/// Temporary files that are there now, or will be in a moment.
struct UnfinishedFiles {
  std::mutex mutex;
  std::vector<fs::path> files;
};
UnfinishedFiles& unfinished() {
  static auto* all = new UnfinishedFiles;  // outlives every thread that might end the program
  return *all;
}
void note_unfinished(const fs::path& file) {
  const std::lock_guard lock(unfinished().mutex);
  unfinished().files.push_back(file);
}
void note_finished(const fs::path& file) {
  const std::lock_guard lock(unfinished().mutex);
  std::erase(unfinished().files, file);
}

}  // namespace

void remove_unfinished_files() {
  unfinished().mutex.lock();  // for good: the program ends, and nothing new begins meanwhile
  for (const auto& file : unfinished().files) ::unlink(file.c_str());
}

expected<void, Error> check_writable(const fs::path& path) {
  const auto target = target_of(path);
  if (!target) return unexpected<Error>(target.error());
  const fs::path folder = target->file.parent_path();
  if (!target->special && ::access(folder.empty() ? "." : folder.c_str(), W_OK | X_OK) != 0)
    return cannot_write(path, system_message(errno));
  return {};
}

expected<AtomicFile, Error> AtomicFile::create(const fs::path& path) {
  const auto target = target_of(path);
  if (!target) return unexpected<Error>(target.error());
  AtomicFile file;
  file.path_ = path;
  file.target_ = target->file;
  if (target->special) {
    file.descriptor_ = ::open(file.target_.c_str(), O_WRONLY | O_CLOEXEC);
    if (file.descriptor_ < 0) return file.failed(errno);
    return file;
  }
  fs::path temporary = temporary_name(file.target_);
  note_unfinished(temporary);
  file.descriptor_ = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file.descriptor_ < 0) {
    const int code = errno;
    note_finished(temporary);
    if (code == EEXIST) return cannot_write(path, fmt::format("'{}' is in the way", temporary.string()));
    return file.failed(code);
  }
  file.temporary_ = std::move(temporary);
  if (target->mode && ::fchmod(file.descriptor_, *target->mode) != 0) return file.failed(errno);
  return file;
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (temporary_.empty()) return;
  ::unlink(temporary_.c_str());
  note_finished(temporary_);
}

expected<void, Error> AtomicFile::write(std::string_view piece) {
  if (!write_all(descriptor_, piece)) return failed(errno);
  return {};
}

expected<void, Error> AtomicFile::commit() {
  const bool direct = temporary_.empty();
  if (!direct && ::fsync(descriptor_) != 0) return failed(errno);
  if (::close(std::exchange(descriptor_, -1)) != 0 && !direct) return failed(errno);  // a delayed write error
  if (direct) return {};
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) return failed(errno);
  note_finished(std::exchange(temporary_, {}));
  flush_folder(target_.parent_path());
  return {};
}

unexpected<Error> AtomicFile::failed(int code) const { return cannot_write(path_, system_message(code)); }

expected<void, Error> write_file_atomically(const fs::path& path, std::string_view contents) {
  auto file = AtomicFile::create(path);
  if (!file) return unexpected<Error>(file.error());
  if (auto written = file->write(contents); !written) return written;
  return file->commit();
}

}  // namespace resonid::io
