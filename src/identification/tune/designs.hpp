// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

#include "identification/tune/robust_law.hpp"

namespace resonid::identification {

/// How a structure is designed for a set of machines under bounds; `biquads` where it has them.
[[nodiscard]] DesignFor design_for(ControllerStructure structure, const design::Bounds& bounds,
                                   std::size_t biquads, std::uint64_t seed);

/// The bounds of a structure: of a cascade |T_load| is that of the position, and filters get a limit of |C S|
/// where none is given.
[[nodiscard]] design::Bounds bounds_for(ControllerStructure structure, const TuneOptions& options,
                                        double best_controller_sensitivity);

/// |C S| of the best PI, or P, for these machines; nothing where none meets the bounds.
[[nodiscard]] std::optional<double> best_controller_sensitivity(
    design::Machines& machines, const design::Bounds& bounds,
    ControllerStructure structure = ControllerStructure::pi);

/// The bounds of the options that hold for every structure.
[[nodiscard]] design::Bounds plain_bounds(const TuneOptions& options);
/// With that of every design: the loop is small where the machine was not measured (docs/methods/tune.md
/// 7.10).
[[nodiscard]] design::Bounds design_bounds(const TuneOptions& options);

}  // namespace resonid::identification
