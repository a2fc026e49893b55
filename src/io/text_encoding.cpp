// SPDX-License-Identifier: MIT
#include "io/text_encoding.hpp"

#include <fmt/core.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>

#include "io/text.hpp"

namespace resonid::io {
namespace {

std::uint8_t byte(char c) noexcept { return static_cast<std::uint8_t>(c); }

void append_utf8(std::string& text, std::uint32_t code) {
  const auto put = [&](std::uint32_t value) { text.push_back(static_cast<char>(value)); };
  if (code < 0x80) return put(code);
  if (code < 0x800) {
    put(0xC0U | (code >> 6U));
  } else {
    if (code < 0x10000) {
      put(0xE0U | (code >> 12U));
    } else {
      put(0xF0U | (code >> 18U));
      put(0x80U | ((code >> 12U) & 0x3FU));
    }
    put(0x80U | ((code >> 6U) & 0x3FU));
  }
  put(0x80U | (code & 0x3FU));
}

/// Characters 0x80 ... 0x9F of Windows-1252; the others are those of Unicode.
constexpr std::array<std::uint16_t, 32> kWindows1252 = {
    0x20AC, 0x81,   0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021, 0x02C6, 0x2030, 0x0160,
    0x2039, 0x0152, 0x8D,   0x017D, 0x8F,   0x90,   0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
    0x2013, 0x2014, 0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0x9D,   0x017E, 0x0178};

/// Bytes of the character that begins there; 0 for none.
std::size_t utf8_length(std::string_view text) noexcept {
  const std::uint8_t first = byte(text.front());
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  if (length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(text[i]) & 0xC0U) != 0x80U) return 0;
  return length;
}

}  // namespace

Encoding encoding_of(std::string_view beginning) noexcept {
  if (beginning.substr(0, 2) == "\xff\xfe") return Encoding::utf16_little;
  if (beginning.substr(0, 2) == "\xfe\xff") return Encoding::utf16_big;
  const std::string_view sample = beginning.substr(0, 256);
  std::array<std::size_t, 2> zeros{};
  for (std::size_t i = 0; i < sample.size(); ++i) zeros[i % 2] += sample[i] == '\0' ? 1U : 0U;
  const std::size_t half = sample.size() / 2;
  if (half < 4) return Encoding::bytes;
  if (zeros[0] == 0 && 10 * zeros[1] > 7 * half) return Encoding::utf16_little;
  if (zeros[1] == 0 && 10 * zeros[0] > 7 * half) return Encoding::utf16_big;
  return Encoding::bytes;
}

std::string from_utf16(std::string_view bytes, Encoding encoding) {
  const std::size_t high = encoding == Encoding::utf16_big ? 0 : 1;
  const auto unit = [&](std::size_t i) -> std::uint32_t {
    return (static_cast<std::uint32_t>(byte(bytes[i + high])) << 8U) | byte(bytes[i + 1 - high]);
  };
  constexpr std::uint32_t kMark = 0xFEFF;
  constexpr std::uint32_t kNoCharacter = 0xFFFD;
  std::string text;
  text.reserve(bytes.size() / 2);
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    std::uint32_t code = unit(i);
    if (code == kMark && i == 0) continue;
    if (code >= 0xD800 && code < 0xE000) {
      const std::uint32_t second = code < 0xDC00 && i + 3 < bytes.size() ? unit(i + 2) : 0;
      const bool pair = second >= 0xDC00 && second < 0xE000;
      code = pair ? 0x10000U + ((code - 0xD800U) << 10U) + (second - 0xDC00U) : kNoCharacter;
      if (pair) i += 2;
    }
    append_utf8(text, code);
  }
  return text;
}

bool is_utf8(std::string_view text) noexcept {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string as_utf8(std::string text) {
  if (is_utf8(text)) return text;
  std::string result;
  for (const char c : text) {
    const std::uint8_t code = byte(c);
    append_utf8(result, code >= 0x80 && code < 0xA0 ? kWindows1252[code - 0x80U] : code);
  }
  return result;
}

bool is_gzip(std::string_view beginning) noexcept { return beginning.substr(0, 2) == "\x1f\x8b"; }

expected<std::string, Error> unpacked_gzip(const std::string& name, std::string_view bytes) {
  constexpr int kGzip = 16 + MAX_WBITS;
  constexpr std::size_t kMost = std::size_t{4} << 30U;  // bytes
  z_stream stream{};
  if (inflateInit2(&stream, kGzip) != Z_OK) return fail(name, "cannot be unpacked: no memory");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, inflateEnd);
  std::string text;
  std::string piece(std::size_t{1} << 18U, '\0');
  int state = Z_OK;
  while (!bytes.empty() || stream.avail_in > 0) {
    if (stream.avail_in == 0) {
      const std::size_t some = std::min(bytes.size(), std::size_t{1} << 20U);
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
      stream.avail_in = static_cast<uInt>(some);
      bytes.remove_prefix(some);
    }
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    state = inflate(&stream, Z_NO_FLUSH);
    if (state != Z_OK && state != Z_STREAM_END && state != Z_BUF_ERROR) break;
    text.append(piece.data(), piece.size() - stream.avail_out);
    if (text.size() > kMost) return fail(name, "holds more than 4 GiB when unpacked; unpack it and cut it");
    if (state != Z_STREAM_END) continue;
    if (bytes.empty() && stream.avail_in == 0) return text;
    if (inflateReset(&stream) != Z_OK) break;  // a further member follows
  }
  return fail(name, fmt::format("is a gzip file that {} after {} bytes; compress it again",
                                state == Z_OK || state == Z_BUF_ERROR ? "ends" : "is damaged", text.size()));
}

}  // namespace resonid::io
