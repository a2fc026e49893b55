// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <vector>

#include "design/posterior.hpp"

namespace resonid::identification {

/// What each bound costs, and what a better experiment would buy (docs/methods/tune.md 5.5, 7.6).
void add_value(Tuning& tuning, const design::Posterior& posterior, const design::Bounds& bounds);

/// The shortest input shaper for the closed loop of the proposed controller (docs/methods/tune.md 11.2).
void add_shapers(Tuning& tuning, const std::vector<design::Posterior>& posteriors);

}  // namespace resonid::identification
