// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/detail/output_hold.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/fit/output_error.hpp>
#include <vector>

namespace resonid::identification::detail {

/// An inertia or a stiffness: what modes and loop gain come from.
[[nodiscard]] bool essential(int parameter);

/// Those parameters that were not the same throughout the record, with the probability of a false alarm of
/// Criteria per record.
[[nodiscard]] std::vector<fit::Constancy> inconstant(std::vector<fit::Constancy> all);

/// Adds the scatter between parts of the record to the parameters' variances; correlations stay.
void widen(const std::vector<fit::Constancy>& inconstant, fit::DriveModel& model);

/// `changes-within-recording` or, of bands, `differs-over-frequency`: an error where an inertia or a
/// stiffness moves by more than the record's answer can stand, else that bars were widened.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_constancy(
    const std::vector<fit::Constancy>& inconstant, const fit::DriveModel& model, bool over_frequency);

/// Samples that nothing of a drive explains, as missing, doubled or disturbed ones leave:
/// `disturbed-samples`. Of a held output the new ones count.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_outliers(const fit::OutputErrorFit& fit,
                                                                   double sample_time_s,
                                                                   const data::OutputHold& hold);

}  // namespace resonid::identification::detail
