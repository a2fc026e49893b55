// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace resonid::io {

/// SHA-256 of bytes that come in any number of pieces. Source: NIST FIPS 180-4, 6.2.
class Sha256 {
 public:
  void add(std::string_view bytes) noexcept;
  /// 64 hexadecimal digits of all that was added; nothing is added afterwards.
  [[nodiscard]] std::string hexadecimal() noexcept;

 private:
  void block(const unsigned char* bytes) noexcept;

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<unsigned char, 64> rest_{};
  std::size_t filled_ = 0;
  std::uint64_t length_ = 0;  // bytes
};

/// Digest of a file; nothing where it is no regular file that can be read.
[[nodiscard]] std::optional<std::string> sha256_of_file(const std::string& path);

}  // namespace resonid::io
