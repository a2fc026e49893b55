// SPDX-License-Identifier: MIT
#include "io/text_source.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "io/text.hpp"

namespace resonid::io {

expected<TextSource, Error> TextSource::open(const std::filesystem::path& path) {
  TextSource source(path.string());
  source.descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (source.descriptor_ < 0 && errno == ENOENT) return fail(source.name_, "there is no such file");
  if (source.descriptor_ < 0) return source.failure(errno);
  struct ::stat status {};
  if (::fstat(source.descriptor_, &status) != 0) return source.failure(errno);
  if (S_ISDIR(status.st_mode)) return fail(source.name_, "is a folder, a file is required");
  if (S_ISREG(status.st_mode)) {
    source.size_ = static_cast<std::size_t>(status.st_size);
    return source;
  }
  std::array<char, 65536> piece{};
  while (true) {
    const ::ssize_t got = ::read(source.descriptor_, piece.data(), piece.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return source.failure(errno);
    if (got == 0) break;
    source.memory_.append(piece.data(), static_cast<std::size_t>(got));
  }
  ::close(std::exchange(source.descriptor_, -1));
  source.size_ = source.memory_.size();
  return source;
}

TextSource::TextSource(TextSource&& other) noexcept
    : name_(std::move(other.name_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      memory_(std::move(other.memory_)) {}

TextSource::~TextSource() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

unexpected<Error> TextSource::failure(int code) const {
  return fail(name_, fmt::format("cannot read: {}", std::generic_category().message(code)));
}

expected<std::size_t, Error> TextSource::read(std::size_t offset, char* buffer, std::size_t count) const {
  count = std::min(count, size_ - std::min(size_, offset));
  if (descriptor_ < 0) {
    if (count > 0) std::memcpy(buffer, memory_.data() + offset, count);
    return count;
  }
  std::size_t got = 0;
  while (got < count) {
    const ::ssize_t n = ::pread(descriptor_, buffer + got, count - got, static_cast<::off_t>(offset + got));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failure(errno);
    if (n == 0) break;  // the file has become shorter
    got += static_cast<std::size_t>(n);
  }
  return got;
}

}  // namespace resonid::io
