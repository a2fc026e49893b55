// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace resonid::monitor {

/// A number as people and programs write it, with a point or, where `comma` may stand for it, a comma. Not a
/// number where the text says that there is none (`null`, `NaN`, empty); nothing where it is something else.
[[nodiscard]] std::optional<double> read_value(std::string_view text, bool comma = false);

/// A sample index: digits alone, or a number that is whole.
[[nodiscard]] std::optional<std::uint64_t> read_index(std::string_view text);

/// After so many samples an index of 32 bits begins again.
inline constexpr std::uint64_t kIndexTurn = std::uint64_t{1} << 32U;
/// An index of 32 bits, which goes from 2^31 - 1 to -2^31 where it has a sign: modulo 2^32.
[[nodiscard]] std::optional<std::uint64_t> read_wrapped_index(std::string_view text);

/// UNIX time in ns of a number of s, ms, us or ns (told apart by its size) or ISO 8601 text.
struct ReadTime {
  bool readable = false;
  std::optional<std::int64_t> time_ns = {};  ///< Nothing: of no known epoch.
};
[[nodiscard]] ReadTime read_time(std::string_view text);

}  // namespace resonid::monitor
