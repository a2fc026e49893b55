// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

namespace resonid::report {

/// A figure that is known; JSON has no other numbers than finite ones.
inline void put(nlohmann::json& to, const char* key, const std::optional<double>& value) {
  if (value && std::isfinite(*value)) to[key] = *value;
}

}  // namespace resonid::report
