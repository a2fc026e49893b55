// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <resonid/data/record.hpp>
#include <span>
#include <string_view>

namespace resonid::io {

/// For reading configurations: the names of an enum of a stage that has no configurations of its own. The
/// others are found beside their enums.
inline std::span<const std::string_view> enum_names(data::Motion) noexcept {
  static constexpr std::array<std::string_view, 2> kNames{"rotary", "linear"};
  return kNames;
}

}  // namespace resonid::io
