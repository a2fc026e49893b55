// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string_view>

namespace resonid::online {

/// How the frequency of a chirp goes from its start to its end.
enum class Sweep { linear, logarithmic };
inline constexpr EnumName<Sweep> kSweepNames[] = {{Sweep::linear, "linear"},
                                                  {Sweep::logarithmic, "logarithmic"}};
[[nodiscard]] constexpr std::span<const EnumName<Sweep>> enum_names(Sweep) noexcept { return kSweepNames; }

}  // namespace resonid::online
