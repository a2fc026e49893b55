// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <resonid/base/expected.hpp>
#include <string>
#include <utility>

#include "monitor/web/backend.hpp"

namespace resonid::monitor::detail {

/// Times of the engine and the store (ns) as people are told them (s), and back.
[[nodiscard]] inline double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }
[[nodiscard]] inline std::int64_t ns_of(double unix_s) {
  return static_cast<std::int64_t>(std::llround(unix_s * 1e9));
}

[[nodiscard]] inline auto no(web::Problem::Kind kind, std::string field, std::string message) {
  return tl::unexpected(web::Problem{kind, std::move(field), std::move(message)});
}

}  // namespace resonid::monitor::detail
