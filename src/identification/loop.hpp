// SPDX-License-Identifier: MIT
#pragma once

#include <identification/measurement.hpp>
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

}  // namespace resonid::identification::detail
