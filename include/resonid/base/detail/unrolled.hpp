// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

namespace resonid {

/// Calls f(0) ... f(Count - 1) with each number as a constant. For short loops of known length that compilers
/// keep as loops at -O2 and -Os, where their counting costs as much as their work.
template <std::size_t Count, class Function>
[[gnu::always_inline]] constexpr inline void unrolled(Function&& f) noexcept {
  [&]<std::size_t... I>(std::index_sequence<I...>) __attribute__((always_inline)) {
    (f(std::integral_constant<std::size_t, I>{}), ...);
  }
  (std::make_index_sequence<Count>{});
}

}  // namespace resonid
