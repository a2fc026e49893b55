// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <span>

namespace resonid::identification {

/// What to know of a design: what had to be assumed, what it rests on, what the model does not tell.
void add_remarks(Tuning& tuning, std::span<const Result> results);

/// Whether the reference step of a design takes more than twice the torque that the drive has, whatever its
/// set-point weight: nothing that is promised of it holds then. Positions of a cascade go along a motion,
/// which is laid out for the torque.
[[nodiscard]] bool is_step_far_beyond(const TunedController& controller, const Tuning& tuning);

}  // namespace resonid::identification
