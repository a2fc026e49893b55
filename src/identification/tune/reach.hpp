// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/identification/tune.hpp>
#include <span>
#include <string>
#include <vector>

#include "design/machine.hpp"

namespace resonid::identification {

/// Bounds that no controller meets: which of them cannot be met beside the others, and what could.
[[nodiscard]] Error out_of_reach(const TuneOptions& options, const std::vector<design::Machine>& machines,
                                 const std::string& what);

/// A bandwidth that is not reached under the bounds, and looser ones under which a PI reaches it.
[[nodiscard]] Error bandwidth_out_of_reach(const TuneOptions& options,
                                           const std::vector<design::Machine>& machines, double reached_hz);

/// A limit of the noise's torque below what every loop takes that crosses where the machines were measured,
/// and how much that is. Nothing where no loop does, whatever its noise.
[[nodiscard]] std::optional<Error> noise_out_of_reach(const TuneOptions& options,
                                                      const std::vector<design::Machine>& machines,
                                                      std::span<const Result> results);

/// A bound, tighter than the usual one, that leaves only loops which cross below what was measured: which one
/// it is, and what of it a PI needs that crosses inside. Nothing where loops do so under the usual bounds
/// too.
[[nodiscard]] std::optional<Error> crossing_out_of_reach(const TuneOptions& options,
                                                         const std::vector<design::Machine>& machines,
                                                         std::span<const Result> results);

}  // namespace resonid::identification
