// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <string_view>

namespace resonid::online {

/// How the frequency of a chirp goes from its start to its end.
enum class Sweep { linear, logarithmic };
[[nodiscard]] inline std::span<const std::string_view> enum_names(Sweep) noexcept {
  static constexpr std::array<std::string_view, 2> kNames{"linear", "logarithmic"};
  return kNames;
}

}  // namespace resonid::online
