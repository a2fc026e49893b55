// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace resonid {

/// States as bytes, of one library version on one machine. Runs of zeros, of which states with room for more
/// are full, take no space.
class ByteWriter {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(&value, sizeof value);
  }
  template <class T>
  void put(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    put(static_cast<std::uint64_t>(values.size()));
    append(values.data(), values.size() * sizeof(T));
  }
  void put(const std::string& text) {
    put(static_cast<std::uint64_t>(text.size()));
    append(text.data(), text.size());
  }
  void put_bytes(std::span<const std::byte> bytes) { append(bytes.data(), bytes.size()); }
  /// Sparse: words of 8 bytes, a run of zeros and one of others in turn.
  void put_sparse(std::span<const std::byte> bytes) {
    put(static_cast<std::uint64_t>(bytes.size()));
    const std::size_t words = bytes.size() / kWord;
    for (std::size_t at = 0; at < words;) {
      const std::size_t first = run(bytes, at, words, true), last = run(bytes, first, words, false);
      put(static_cast<std::uint32_t>(first - at));
      put(static_cast<std::uint32_t>(last - first));
      append(bytes.data() + first * kWord, (last - first) * kWord);
      at = last;
    }
    append(bytes.data() + words * kWord, bytes.size() - words * kWord);
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::vector<std::byte> take() noexcept { return std::move(bytes_); }

 private:
  static constexpr std::size_t kWord = 8;
  static std::size_t run(std::span<const std::byte> bytes, std::size_t at, std::size_t words, bool zeros) {
    std::uint64_t word = 0;
    for (; at < words; ++at) {
      std::memcpy(&word, bytes.data() + at * kWord, kWord);
      if ((word == 0) != zeros) break;
    }
    return at;
  }
  void append(const void* data, std::size_t size) {
    const auto* first = static_cast<const std::byte*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
  }
  std::vector<std::byte> bytes_;
};

/// Reads what a ByteWriter wrote. Bytes that end too early, or counts beyond them, leave values as they are
/// and ok() false.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) noexcept : rest_(bytes) {}

  template <class T>
  void get(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (has(sizeof value)) take(&value, sizeof value);
  }
  template <class T>
  void get(std::vector<T>& values) {
    std::uint64_t size = 0;
    get(size);
    if (size > rest_.size() / sizeof(T)) ok_ = false;
    if (!ok_) return;
    values.resize(static_cast<std::size_t>(size));
    take(values.data(), values.size() * sizeof(T));
  }
  void get(std::string& text) {
    std::uint64_t size = 0;
    get(size);
    if (!has(size)) return;
    text.resize(static_cast<std::size_t>(size));
    take(text.data(), text.size());
  }
  /// Into zeros of the size that was written.
  void get_sparse(std::span<std::byte> into) {
    std::uint64_t size = 0;
    get(size);
    if (size != into.size()) ok_ = false;
    const std::size_t words = into.size() / kWord;
    for (std::size_t at = 0; ok_ && at < words;) {
      std::uint32_t zeros = 0, others = 0;
      get(zeros);
      get(others);
      const std::size_t left = words - at;
      if (zeros > left || others > left - zeros || zeros + others == 0 || !has(others * kWord)) {
        ok_ = false;
        return;
      }
      take(into.data() + (at + zeros) * kWord, others * kWord);
      at += zeros + others;
    }
    const std::size_t tail = into.size() - words * kWord;
    if (has(tail)) take(into.data() + words * kWord, tail);
  }
  /// The same into as many zeros as were written, `most` at most.
  void get_sparse_sized(std::vector<std::byte>& into, std::size_t most) {
    ByteReader ahead(rest_);
    std::uint64_t size = 0;
    ahead.get(size);
    if (!ahead.ok() || size > most) ok_ = false;
    if (!ok_) return;
    into.assign(static_cast<std::size_t>(size), std::byte{0});
    get_sparse(into);
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] bool at_end() const noexcept { return ok_ && rest_.empty(); }

 private:
  static constexpr std::size_t kWord = 8;
  bool has(std::uint64_t size) noexcept {
    if (size > rest_.size()) ok_ = false;
    return ok_;
  }
  void take(void* to, std::size_t size) noexcept {
    if (size > 0) std::memcpy(to, rest_.data(), size);
    rest_ = rest_.subspan(size);
  }
  std::span<const std::byte> rest_;
  bool ok_ = true;
};

}  // namespace resonid
