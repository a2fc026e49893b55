// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/prepare/prepare.hpp>
#include <identification/identify/select/select_drive.hpp>

namespace resonid::identification::detail {

/// Model of a record with Experiment::motion: rigid, by its inverse dynamics; two masses where the record
/// less its friction shows them to the hold-out samples, with the same inertia in all. A simulation with dry
/// friction as a parameter has several minima here and error bars of each that do not hold the others.
/// Nothing where the options ask for another structure.
[[nodiscard]] std::optional<Selection> model_in_motion(const Experiment& experiment, const Options& options,
                                                       const data::FrequencyResponse& response);

/// Says where a model that was chosen otherwise contradicts the inverse dynamics of its record's motion: in
/// the inertia in all, beyond the error bars of both, dry friction being there. Nothing where the record does
/// not move enough to tell.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_against_motion(const data::Record& record,
                                                                         const Options& options,
                                                                         const ModelResult& model);

}  // namespace resonid::identification::detail
