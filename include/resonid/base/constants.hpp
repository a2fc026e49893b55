// SPDX-License-Identifier: MIT
#pragma once

#include <numbers>

namespace resonid {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kTwoPi = 2.0 * std::numbers::pi;

}  // namespace resonid
