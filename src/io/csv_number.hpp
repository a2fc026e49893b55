// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <system_error>

namespace resonid::io {

/// Bytes that must be readable after a text that parse_number() gets, beginning with a NUL.
inline constexpr std::size_t kNumberPadding = 8;

inline constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

/// The decimal digits at `p` appended to `mantissa` (modulo 2^64). Moves `p` behind them.
inline void append_digits(const char*& p, std::uint64_t& mantissa) noexcept {
  static constexpr std::array<std::uint64_t, 9> kShift = {1,       10,        100,        1000,       10'000,
                                                          100'000, 1'000'000, 10'000'000, 100'000'000};
  if constexpr (std::endian::native == std::endian::little) {
    while (true) {  // eight characters at a time, as bytes of one word
      std::uint64_t word = 0;
      std::memcpy(&word, p, 8);
      const std::uint64_t other = ((word & 0xF0F0F0F0F0F0F0F0) ^ 0x3030303030303030) |
                                  (((word + 0x0606060606060606) & 0xF0F0F0F0F0F0F0F0) ^ 0x3030303030303030);
      const int digits = std::countr_zero(other) / 8;
      word &= 0x0F0F0F0F0F0F0F0F;
      if (digits < 8) word = (word << 1) << (63 - 8 * digits);  // the missing ones become leading zeros
      word = (word * 2561) >> 8;
      word = ((word & 0x00FF00FF00FF00FF) * 6553601) >> 16;
      word = ((word & 0x0000FFFF0000FFFF) * 42949672960001) >> 32;
      p += digits;
      mantissa = mantissa * kShift[static_cast<std::size_t>(digits)] + word;
      if (digits < 8) return;
    }
  } else {
    while (is_digit(*p)) mantissa = 10 * mantissa + static_cast<std::uint64_t>(*p++ - '0');
  }
}

/// mantissa 10^exponent, correctly rounded (to nearest, ties to even), for a mantissa > 0 and |exponent| <=
/// 27, where 5^|exponent| fits 64 bits. The product or quotient is formed exactly to 64 bits with a sticky
/// bit below.
inline double scaled_exactly(std::uint64_t mantissa, int exponent) noexcept {
  __extension__ using Wide = unsigned __int128;
  static constexpr auto kPowersOfFive = [] {
    std::array<std::uint64_t, 28> powers{1};
    for (std::size_t i = 1; i < powers.size(); ++i) powers[i] = 5 * powers[i - 1];
    return powers;
  }();
  const std::uint64_t five = kPowersOfFive[static_cast<std::size_t>(exponent < 0 ? -exponent : exponent)];
  const int shift_m = std::countl_zero(mantissa);
  const int shift_f = std::countl_zero(five);
  const std::uint64_t m = mantissa << shift_m;
  const std::uint64_t f = five << shift_f;
  std::uint64_t top = 0;  // value = (top + fraction) 2^binary, the fraction being 0 or not
  bool inexact = false;
  int binary = 0;
  if (exponent < 0) {
    const Wide numerator = static_cast<Wide>(m) << 63;
    top = static_cast<std::uint64_t>(numerator / f);
    inexact = static_cast<std::uint64_t>(numerator) != top * f;
    binary = exponent - shift_m + shift_f - 63;
  } else {
    const Wide product = static_cast<Wide>(m) * f;
    top = static_cast<std::uint64_t>(product >> 64);
    inexact = static_cast<std::uint64_t>(product) != 0;
    binary = exponent - shift_m - shift_f + 64;
  }
  const int lead = std::countl_zero(top);  // 0 or 1
  const int drop = 11 - lead;
  const std::uint64_t half = std::uint64_t{1} << (drop - 1);
  const std::uint64_t rest = top & (2 * half - 1);
  std::uint64_t kept = top >> drop;
  kept += rest > half || (rest == half && (inexact || (kept & 1) != 0)) ? 1U : 0U;
  const auto power = static_cast<std::uint64_t>(1023 + binary + drop);
  return static_cast<double>(kept) * std::bit_cast<double>(power << 52);
}

/// What parse_number() leaves to the standard library: many digits, large exponents. `text` has no plus sign.
inline const char* parse_rare_number(const char* text, const char* end, long magnitude, double& value,
                                     char decimal) noexcept {
  if (decimal != '.') {  // the standard library knows the point only
    const char* last = text;
    while (last != end && (is_digit(*last) || *last == decimal || *last == 'e' || *last == 'E' ||
                           *last == '+' || *last == '-'))
      ++last;
    std::string pointed(text, last);
    for (char& c : pointed)
      if (c == decimal) c = '.';
    const char* const begin = pointed.data();
    const char* const after = parse_rare_number(begin, begin + pointed.size(), magnitude, value, '.');
    return after == nullptr ? nullptr : text + (after - begin);
  }
  const auto result = std::from_chars(text, end, value);
  if (result.ec == std::errc::result_out_of_range) {
    if (magnitude > 0) return nullptr;  // too large for a double
    value = *text == '-' ? -0.0 : 0.0;  // too small for one
    return result.ptr;
  }
  return result.ec == std::errc() && std::isfinite(value) ? result.ptr : nullptr;
}

/// Reads a finite decimal number, correctly rounded, with `decimal` between whole and fraction. A NUL and
/// kNumberPadding readable bytes must follow `end`.
///
/// A mantissa below 2^53 and a power of ten up to 10^22 are both exact doubles, so one multiplication or
/// division rounds once and correctly (Clinger 1990); up to 19 digits go through exact 128-bit integers.
///
/// @return the character after the number, or nullptr when there is none or it is not finite
inline const char* parse_number(const char* text, const char* end, double& value,
                                char decimal = '.') noexcept {
  static constexpr std::array<double, 23> kPowers = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                     1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                     1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  const std::uint64_t negative = *text == '-' ? 1 : 0;
  const char* p = text + ((negative != 0 || *text == '+') ? 1 : 0);
  const char* const digits = p;
  std::uint64_t mantissa = 0;
  while (is_digit(*p)) mantissa = 10 * mantissa + static_cast<std::uint64_t>(*p++ - '0');
  long count = p - digits;
  long exponent = 0;
  if (*p == decimal) {
    const char* const fraction = ++p;
    append_digits(p, mantissa);
    exponent = fraction - p;
    count -= exponent;
  }
  if (count == 0) return nullptr;
  if (*p == 'e' || *p == 'E') {
    ++p;
    const bool down = *p == '-';
    if (down || *p == '+') ++p;
    if (!is_digit(*p)) return nullptr;
    long power = 0;
    for (; is_digit(*p); ++p) power = power < 100'000 ? 10 * power + (*p - '0') : power;
    exponent += down ? -power : power;
  }
  if (count > 19 || exponent < -27 || exponent > 27)
    return parse_rare_number(digits - negative, end, exponent + count, value, decimal);
  double magnitude = 0.0;
  if (mantissa <= (std::uint64_t{1} << 53) && exponent >= -22 && exponent <= 22) {
    const auto exact = static_cast<double>(mantissa);
    magnitude = exponent <= 0 ? exact / kPowers[static_cast<std::size_t>(-exponent)]
                              : exact * kPowers[static_cast<std::size_t>(exponent)];
  } else if (mantissa != 0) {
    magnitude = scaled_exactly(mantissa, static_cast<int>(exponent));
  }
  value = std::bit_cast<double>(std::bit_cast<std::uint64_t>(magnitude) | (negative << 63));
  return p;
}

}  // namespace resonid::io
