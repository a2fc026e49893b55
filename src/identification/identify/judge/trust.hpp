// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/select/select_drive.hpp>

namespace resonid::identification::detail {

/// What model, loop and validation tell; added to the findings that record and response gave already.
void inspect_model(const Plan& plan, const Options& options, const std::optional<Selection>& selection,
                   Result& result);
void inspect_black_box(const BlackBoxResult& result, std::vector<diagnostics::Finding>& findings);
void inspect_loop(Result& result);
/// A delay that the record shows on top of the one that was told.
[[nodiscard]] diagnostics::Finding further_delay(double delay_s, double known_delay_s);
/// What the simulation of the record says against the model.
void inspect_validation(Result& result);

/// The verdict: trusted unless a finding is an error.
[[nodiscard]] bool trusted(const Result& result);

}  // namespace resonid::identification::detail
