// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <string_view>
#include <tl/expected.hpp>

namespace resonid {

template <class T, class E>
using expected = tl::expected<T, E>;
using tl::unexpected;

/// Why a configuration was refused. Holds string literals only, so it needs no heap.
struct ConfigError {
  std::string_view field;        ///< Name of the offending field of the configuration struct.
  std::string_view requirement;  ///< What is required of it, as a phrase: "must be > 0".
  double value = std::numeric_limits<double>::quiet_NaN();  ///< The value found, where it is a number.
};

/// Shorthand for `unexpected(ConfigError{...})`.
[[nodiscard]] inline tl::unexpected<ConfigError> refuse(
    std::string_view field, std::string_view requirement,
    double value = std::numeric_limits<double>::quiet_NaN()) noexcept {
  return tl::unexpected<ConfigError>(ConfigError{field, requirement, value});
}

}  // namespace resonid
