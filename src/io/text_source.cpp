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
#include "io/text_encoding.hpp"

namespace resonid::io {

namespace {

/// An Office file is a zip archive; so is an OpenDocument one.
bool is_zip(std::string_view beginning) noexcept { return beginning.substr(0, 4) == "PK\x03\x04"; }

}  // namespace

expected<TextSource, Error> TextSource::open(const std::filesystem::path& path) {
  const bool standard_input = path == kStandardInput;
  TextSource source(standard_input ? "standard input" : path.string());
  source.descriptor_ = standard_input ? ::dup(STDIN_FILENO) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (source.descriptor_ < 0 && errno == ENOENT) return fail(source.name_, "there is no such file");
  if (source.descriptor_ < 0) return source.failure(errno);
  struct ::stat status {};
  if (::fstat(source.descriptor_, &status) != 0) return source.failure(errno);
  if (S_ISDIR(status.st_mode)) return fail(source.name_, "is a folder, a file is required");
  if (S_ISREG(status.st_mode) && !standard_input) {
    source.size_ = static_cast<std::size_t>(status.st_size);
  } else if (auto taken = source.take_all(); !taken) {
    return unexpected<Error>(taken.error());
  }
  if (auto plain = source.make_plain(); !plain) return unexpected<Error>(plain.error());
  return source;
}

expected<void, Error> TextSource::take_all() {
  std::array<char, 65536> piece{};
  while (true) {
    const ::ssize_t got = ::read(descriptor_, piece.data(), piece.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failure(errno);
    if (got == 0) break;
    memory_.append(piece.data(), static_cast<std::size_t>(got));
  }
  ::close(std::exchange(descriptor_, -1));
  size_ = memory_.size();
  return {};
}

expected<void, Error> TextSource::take_into_memory() {
  if (descriptor_ < 0) return {};
  std::string all(size_, '\0');
  const auto got = read(0, all.data(), all.size());
  if (!got) return unexpected<Error>(got.error());
  all.resize(*got);
  memory_ = std::move(all);
  size_ = memory_.size();
  ::close(std::exchange(descriptor_, -1));
  return {};
}

expected<void, Error> TextSource::make_plain() {
  std::string head(512, '\0');
  auto got = read(0, head.data(), head.size());
  if (!got) return unexpected<Error>(got.error());
  head.resize(*got);
  if (is_gzip(head)) {
    if (auto taken = take_into_memory(); !taken) return taken;
    auto unpacked = unpacked_gzip(name_, memory_);
    if (!unpacked) return unexpected<Error>(unpacked.error());
    memory_ = std::move(*unpacked);
    size_ = memory_.size();
    form_ = "gzip";
    head = memory_.substr(0, 512);
  }
  if (is_zip(head))
    return fail(
        name_,
        "is a zip archive or a workbook (.xlsx, .ods); required CSV or MAT: unpack it, or save the sheet "
        "as CSV (UTF-8)");
  const Encoding encoding = encoding_of(head);
  if (encoding == Encoding::bytes || is_mat(head)) return {};
  if (auto taken = take_into_memory(); !taken) return taken;
  memory_ = from_utf16(memory_, encoding);
  size_ = memory_.size();
  form_ += form_.empty() ? "UTF-16" : ", UTF-16";
  return {};
}

TextSource::TextSource(TextSource&& other) noexcept
    : name_(std::move(other.name_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      memory_(std::move(other.memory_)),
      form_(std::move(other.form_)) {}

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
