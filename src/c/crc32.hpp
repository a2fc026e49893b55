// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace resonid::c {

using CrcTable = std::array<std::array<std::uint32_t, 256>, 4>;  // [bytes behind it][byte]
constexpr CrcTable make_crc_table() noexcept {
  CrcTable t{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1) != 0 ? c >> 1 ^ 0xEDB88320U : c >> 1;
    t[0][i] = c;
  }
  for (std::size_t n = 1; n < 4; ++n)
    for (std::size_t i = 0; i < 256; ++i) t[n][i] = t[n - 1][i] >> 8 ^ t[0][t[n - 1][i] & 0xFF];
  return t;
}

/// CRC-32 of Ethernet and zip (polynomial 0xEDB88320, reflected), four bytes at a time by tables. Finds every
/// burst of up to 32 wrong bits, and others but for one in 2^32.
class Crc32 {
 public:
  void add(const void* data, std::size_t size) noexcept {
    const auto* p = static_cast<const unsigned char*>(data);
    std::uint32_t c = state_;
    // Pointers, since without optimisation every [] of an array is a call; the masks keep within 256.
    const std::uint32_t *t0 = kTable[0].data(), *t1 = kTable[1].data(), *t2 = kTable[2].data(),
                        *t3 = kTable[3].data();
    for (; size >= 4; size -= 4, p += 4) {
      c ^= std::uint32_t{p[0]} | std::uint32_t{p[1]} << 8 | std::uint32_t{p[2]} << 16 |
           std::uint32_t{p[3]} << 24;
      c = t3[c & 0xFF] ^ t2[(c >> 8) & 0xFF] ^ t1[(c >> 16) & 0xFF] ^ t0[c >> 24];
    }
    for (; size > 0; --size, ++p) c = t0[(c ^ *p) & 0xFF] ^ (c >> 8);
    state_ = c;
  }
  [[nodiscard]] std::uint32_t value() const noexcept { return ~state_; }

 private:
  static constexpr CrcTable kTable = make_crc_table();
  std::uint32_t state_ = ~std::uint32_t{0};
};

}  // namespace resonid::c
