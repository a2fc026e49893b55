// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/record.hpp>
#include <resonid/identification/result.hpp>
#include <string>

namespace resonid::identification::detail {

/// Units of everything reported, from the units of input and output.
[[nodiscard]] Units units_of(const data::Record& record);
[[nodiscard]] Units units_of(data::Motion motion, data::OutputQuantity quantity, const std::string& input,
                             const std::string& output);

/// Unit of the place that a velocity in that unit leads to: "rad" of "rad/s".
[[nodiscard]] std::string position_unit(const std::string& velocity);

}  // namespace resonid::identification::detail
