// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <span>
#include <vector>

#include "design/posterior.hpp"
#include "design/schedule.hpp"
#include "identification/tune/robust_law.hpp"

namespace resonid::identification {

/// PI gains over the positions of the results, which keep all bounds with the confidence wherever the
/// position stands (docs/methods/tune.md 12), and the noise's and the step's torque within their limits
/// there. Puts them into the tuning; returned is the controller of the first position, with what was counted
/// there. Refused: a position at which no gain meets the bounds; a speed at which the gains change too
/// quickly; a crossover outside the band that was identified, a bandwidth that is not reached.
[[nodiscard]] expected<RobustLaw, Error> schedule_gains(Tuning& tuning, std::span<const Result> results,
                                                        const std::vector<design::Posterior>& posteriors);

/// Where the bounds are not met with the confidence, however soft the gains around: between two results what
/// is open of the machine, which a recording there would tell.
[[nodiscard]] Error not_met_at(const std::vector<double>& positions, double place, double confidence);

/// What one PI for all positions, which needs no position, would do on a run through the stroke.
void add_one_for_all(Tuning& tuning, const design::FilteredPi& gains);

/// The machine between the results, what is open of it (the posteriors must stay), and the gains: of a tuning
/// with positions.
[[nodiscard]] design::MachineAt machine_over(const Tuning& tuning);
[[nodiscard]] design::PosteriorAt posterior_over(const Tuning& tuning,
                                                 const std::vector<design::Posterior>& posteriors);
[[nodiscard]] design::GainSchedule gains_over(const TunedSchedule& schedule);

}  // namespace resonid::identification
