// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/select/select.hpp>
#include <vector>

namespace resonid::identification::detail {

/// Tests the chosen drive for what bends it: torques in couplings and friction that no linear machine has,
/// and a course over time. What moves parameters by more than their bars widens these by it, and is told; by
/// more than a model can stand it is an error, and so is a third mass in whose place such a torque would do.
/// Of what a torque explains, the parameters' inconstancy is no longer told.
[[nodiscard]] std::vector<diagnostics::Finding> inspect_bending(const Experiment& experiment,
                                                                const Measurement& measurement,
                                                                const Options& options, Selection& selection);

}  // namespace resonid::identification::detail
