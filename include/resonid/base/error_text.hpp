// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdio>
#include <resonid/base/error.hpp>
#include <string>

namespace resonid {

/// "run.csv: line 3: from_hz: found 0, must be > 0": what is known of it, in this order.
[[nodiscard]] inline std::string message_of(const Error& error) {
  std::string text;
  for (const Phrase* part : {&error.where, &error.field})
    if (!part->empty()) text += part->str() + ": ";
  if (!std::isnan(error.value)) {
    char number[32];
    std::snprintf(number, sizeof number, "found %g, ", error.value);
    text += number;
  }
  return text + error.requirement.str();
}

}  // namespace resonid
