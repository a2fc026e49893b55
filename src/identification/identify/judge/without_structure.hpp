// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/measure/measure.hpp>
#include <resonid/identification/identify.hpp>

namespace resonid::identification::detail {

/// Typical difference of a black box to the measured response beyond its noise, relative, over the lines that
/// its sample rate reaches.
[[nodiscard]] double black_box_error(const fit::BlackBoxModel& model,
                                     const data::FrequencyResponse& response);

/// Of a measured response, the lines that a black box reaches: those below 0.4 of its own sample rate.
[[nodiscard]] double reach_hz(const fit::BlackBoxModel& model);
[[nodiscard]] data::FrequencyResponse within_reach(const fit::BlackBoxModel& model,
                                                   const data::FrequencyResponse& response);

/// Where no drive model holds but the measured response does: a black box in the drive model's place, of an
/// order high enough that it has the modes that the response shows. Nothing happens where none holds, or
/// where the drive model fails by a little only. Resonances and margins are those of the response; the drive
/// model stays among the structures.
void put_black_box_instead(const Experiment& experiment, const Measurement& measurement,
                           const Options& options, Result& result);

}  // namespace resonid::identification::detail
