// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <span>
#include <vector>

#include "design/machine.hpp"
#include "design/posterior.hpp"

namespace resonid::identification {

/// Under what controllers were designed: a limit of |C S| for noise or filters is one of them.
struct DesignedUnder {
  design::Bounds pi;        ///< The best PI.
  design::Bounds proposed;  ///< The proposed controller.
};

/// What each bound costs one PI for all machines, and what a better experiment would buy
/// (docs/methods/tune.md 5.5, 7.6).
void add_value(Tuning& tuning, const std::vector<design::Machine>& machines,
               const std::vector<design::Posterior>& posteriors, const DesignedUnder& bounds);

/// Where the end of the measured band keeps the gains down: says so, and what a wider one would buy a PI.
void add_value_of_band(Tuning& tuning, const std::vector<design::Machine>& machines,
                       std::span<const Result> results, const design::Bounds& bounds);

/// Of one controller for several machines: which of them is worst for each bound.
void add_worst_machines(Tuning& tuning, const std::vector<design::Posterior>& posteriors,
                        std::span<const Result> results);

/// The shortest input shaper for the closed loop of the proposed controller, whatever it is made of, over all
/// results, and positions of a schedule (docs/methods/tune.md 11.2): for one mode or for two.
void add_shapers(Tuning& tuning, const std::vector<design::Posterior>& posteriors);

}  // namespace resonid::identification
