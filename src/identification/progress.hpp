// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/options.hpp>

namespace resonid::identification::detail {

/// Tells the caller which stage begins.
inline void tell(const Options& options, std::string_view stage) {
  if (options.progress) options.progress(stage);
}

}  // namespace resonid::identification::detail
