// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <identification/identify/measure/methods.hpp>
#include <resonid/diagnostics/detail/data_findings.hpp>
#include <resonid/fit/detail/controller_estimate.hpp>
#include <resonid/identification/result.hpp>
#include <variant>

namespace resonid::identification::detail {

/// What was fitted, if anything.
using PlantModel = std::variant<std::monostate, fit::DriveModel, fit::BlackBoxModel>;
[[nodiscard]] PlantModel plant_model(const Result& result);

/// The real loop: controller times plant, known and fitted delay included.
///
/// With a model: C(f) given, or measured as (Ru - U)/Y, times the model. Without: C times the measured
/// response, or L = Ru/U - 1 at the lines. Nothing without a controller and without the excitation signal.
[[nodiscard]] std::optional<LoopResult> loop_of(const Plan& plan, const Options& options,
                                                const response::LineEstimates& lines,
                                                const data::FrequencyResponse& response,
                                                const PlantModel& model);

/// Takes the standard deviations from margins that lie further beyond the excited frequencies than the model
/// is to be trusted with: above them, where a machine may have modes that the record does not show. Where the
/// controller comes from the record too, and is extrapolated to the crossover, from all of them. The finding
/// says which.
[[nodiscard]] std::optional<diagnostics::Finding> keep_to_band(const Plan& plan, bool controller_from_record,
                                                               LoopResult& loop);

/// A loop whose controller comes from the record itself: its error goes into the margins' standard
/// deviations, to first order. `loop_with`: the loop with another controller.
void include_controller(
    const fit::ControllerEstimate& shown,
    const std::function<std::optional<LoopResult>(const data::TransferFunction&)>& loop_with,
    LoopResult& loop);

/// The same model without what makes standard deviations, which moved models need not have.
[[nodiscard]] PlantModel plain(PlantModel model);

}  // namespace resonid::identification::detail
