// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <optional>
#include <resonid/io/atomic_file.hpp>
#include <string>
#include <system_error>

namespace resonid::io {
namespace {

namespace fs = std::filesystem;

unexpected<Error> cannot_write(const fs::path& path, std::string_view why) {
  return unexpected<Error>(Error{fmt::format("{}: cannot write: {}", path.string(), why)});
}

std::string system_message(int code) { return std::generic_category().message(code); }

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number) noexcept : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  [[nodiscard]] int number() const noexcept { return number_; }

  /// Closes now; false with errno set when the system reports a delayed write error.
  bool close() noexcept {
    const int number = number_;
    number_ = -1;
    return ::close(number) == 0;
  }

 private:
  int number_;
};

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

/// Writes the whole contents under a temporary name and gives it the wanted permissions. Returns the error
/// number.
int write_temporary(const fs::path& temporary, std::string_view contents, std::optional<::mode_t> mode) {
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.number() < 0) return errno;
  if (mode && ::fchmod(file.number(), *mode) != 0) return errno;
  if (!write_all(file.number(), contents)) return errno;
  if (::fsync(file.number()) != 0) return errno;
  return file.close() ? 0 : errno;
}

/// Makes the rename itself last through a power cut; a file system that cannot is no reason to fail.
void flush_folder(const fs::path& folder) {
  const Descriptor descriptor(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.number() >= 0) static_cast<void>(::fsync(descriptor.number()));
}

expected<void, Error> write_special(const fs::path& path, std::string_view contents) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (file.number() < 0 || !write_all(file.number(), contents))
    return cannot_write(path, system_message(errno));
  return {};
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

}  // namespace

expected<void, Error> check_writable(const fs::path& path) {
  const auto target = target_of(path);
  if (!target) return unexpected<Error>(target.error());
  const fs::path folder = target->file.parent_path();
  if (!target->special && ::access(folder.empty() ? "." : folder.c_str(), W_OK | X_OK) != 0)
    return cannot_write(path, system_message(errno));
  return {};
}

expected<void, Error> write_file_atomically(const fs::path& path, std::string_view contents) {
  const auto target = target_of(path);
  if (!target) return unexpected<Error>(target.error());
  if (target->special) return write_special(target->file, contents);

  const fs::path temporary = temporary_name(target->file);
  int failure = write_temporary(temporary, contents, target->mode);
  if (failure == EEXIST) return cannot_write(path, fmt::format("'{}' is in the way", temporary.string()));
  if (failure == 0 && ::rename(temporary.c_str(), target->file.c_str()) != 0) failure = errno;
  if (failure != 0) {
    ::unlink(temporary.c_str());
    return cannot_write(path, system_message(failure));
  }
  flush_folder(target->file.parent_path());
  return {};
}

}  // namespace resonid::io
