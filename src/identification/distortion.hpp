// SPDX-License-Identifier: MIT
#pragma once

#include <identification/measurement.hpp>
#include <resonid/diagnostics/finding.hpp>

namespace resonid::identification::detail {

/// `non-linear-distortion`, when a periodic record answers at lines that its excitation leaves out.
[[nodiscard]] std::vector<diagnostics::Finding> inspect_distortion(const data::Record& record,
                                                                   const Plan& plan);

}  // namespace resonid::identification::detail
