// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <resonid/fit/drive_model.hpp>
#include <string>

namespace resonid::identification::detail {

/// A parameter of the drive as findings say it: "driven_inertia" is "motor inertia".
inline std::string parameter_words(int parameter) {
  std::string name(fit::kParameterNames[static_cast<std::size_t>(parameter)]);
  std::replace(name.begin(), name.end(), '_', ' ');
  constexpr std::string_view kDriven = "driven ";
  if (name.starts_with(kDriven)) name.replace(0, kDriven.size(), "motor ");
  return name;
}

}  // namespace resonid::identification::detail
