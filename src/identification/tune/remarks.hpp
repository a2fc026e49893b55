// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <span>

namespace resonid::identification {

/// What to know of a design: what had to be assumed, what it rests on, what the model does not tell.
void add_remarks(Tuning& tuning, std::span<const Result> results);

}  // namespace resonid::identification
