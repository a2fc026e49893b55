// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/judge/loop.hpp>
#include <identification/identify/measure/measure.hpp>

namespace resonid::identification::detail {

/// The loop with the controller that is to run, Options::planned_controller, and whether it is stable: with a
/// drive model by the closed loop's poles, else by how often 1 + L goes around 0 along the lines. Of a model
/// a delay without a standard deviation is taken as `tune` takes it, as known to a quarter of a sample.
void judge_planned_loop(const Measurement& m, const Options& options, const PlantModel& model,
                        Result& result);

}  // namespace resonid::identification::detail
