// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/judge/loop.hpp>
#include <identification/identify/measure/measure.hpp>

namespace resonid::identification::detail {

/// Where |L| = 1 between neighbouring lines, as diagnostics::loop_margins() reads it, rising ones too; with
/// the errors that those of the lines make, taken as independent.
[[nodiscard]] std::vector<LoopCrossing> crossings_of(const data::FrequencyResponse& loop);

/// Standard deviation of the gain margin by those of the lines, dB.
[[nodiscard]] std::optional<double> gain_margin_std_db(const data::FrequencyResponse& loop, double at_hz);

/// What a stable planned loop leaves to be wished: `planned-may-be-unstable` where its distance to -1 is
/// within two standard deviations, else `planned-small-margins`.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_planned_margins(const LoopResult& loop);

/// Whether the lines of a loop tell that it is stable: nothing if so, else `planned-unstable` or
/// `planned-not-judged`. By the argument principle, for a machine that integrates its torque below the first
/// line and is stable by itself otherwise, with nothing above the last line that lifts |L| to 1
/// (docs/methods/margins.md). `controller`: the sampled one that is in the loop.
[[nodiscard]] std::optional<diagnostics::Finding> judge_by_lines(const LoopResult& loop,
                                                                 const data::TransferFunction& controller,
                                                                 double confidence,
                                                                 double known_delay_s = 0.0);

/// The loop with the controller that is to run, Options::planned_controller, and whether it is stable: with a
/// drive model by the closed loop's poles, else by its lines. Where these do not tell it, margins are not
/// promised. Of a model a delay without a standard deviation is taken as `tune` takes it, as known to a
/// quarter of a sample.
void judge_planned_loop(const Measurement& m, const Options& options, const PlantModel& model,
                        Result& result);

}  // namespace resonid::identification::detail
