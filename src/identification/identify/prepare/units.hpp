// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/record.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// Units of everything reported, from the units of input and output.
[[nodiscard]] Units units_of(const data::Record& record);

}  // namespace resonid::identification::detail
