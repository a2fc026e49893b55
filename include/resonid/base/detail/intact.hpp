// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

namespace resonid {

// For `bool intact() const` of whatever a snapshot holds: whether bytes of unknown origin are a state that
// create() and steps can leave, as far as safety goes: indices, counts, flags, enumerators, and what numbers
// are used to find an index. A class whose members are numbers alone needs none. Whoever adds another member
// adds it there.

/// Whether a flag is 0 or 1: any other byte must not be read as a bool.
[[nodiscard]] inline bool intact(const bool& flag) noexcept {
  unsigned char byte = 0;
  std::memcpy(&byte, &flag, 1);
  return byte <= 1;
}
template <class... Flags>
[[nodiscard]] bool intact_flags(const Flags&... flags) noexcept {
  return (intact(flags) && ...);
}
/// Whether an enumerator lies from 0 to the last one.
template <class Enum>
[[nodiscard]] bool intact(const Enum& value, Enum last) noexcept {
  return static_cast<long long>(value) >= 0 && static_cast<long long>(value) <= static_cast<long long>(last);
}
/// Whether the first `count` of the indices are below `limit`.
template <class Index>
[[nodiscard]] bool all_below(std::span<const Index> indices, std::size_t limit) noexcept {
  return std::all_of(indices.begin(), indices.end(), [limit](Index i) { return i < limit; });
}
template <class Real>
[[nodiscard]] bool positive(Real x) noexcept {
  return x > Real(0) && std::isfinite(x);
}

}  // namespace resonid
