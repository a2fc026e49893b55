// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <resonid/base/error.hpp>
#include <tl/expected.hpp>
#include <utility>

namespace resonid {

template <class T, class E = Error>
using expected = tl::expected<T, E>;
using tl::unexpected;

/// Shorthand for `unexpected(Error{...})`.
[[nodiscard]] inline tl::unexpected<Error> refuse(Phrase field, Phrase requirement,
                                                  double value = std::numeric_limits<double>::quiet_NaN()) {
  return tl::unexpected<Error>(Error{std::move(field), std::move(requirement), value});
}

}  // namespace resonid
