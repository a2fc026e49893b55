// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <resonid/identification/result.hpp>
#include <resonid/identification/track.hpp>
#include <vector>

namespace resonid::identification {

/// What tune() takes for a gain schedule: a result for each of some positions, ascending.
struct ResultsOverPosition {
  std::vector<double> positions;  ///< In the unit of the rows' position: TuneOptions::positions.
  std::vector<Result> results;    ///< [position]
};

/// The machine over the position of its trusted rows, as a tracker of physical parameters gives them
/// (docs/methods/tune.md 12). Stretches of position are halved until no inertia, stiffness or damping changes
/// by more than 5 %, or than its error bars, within one. Each gives the result's model with the parameters
/// of a straight line through its rows, in logarithms, over position, and as their covariance the mean of
/// the rows' own plus the variance around that line: neither divided by the number of rows, since neighbours
/// rest on the same samples. What is not tracked stays as the result has it. The first and the last position
/// are those of the outermost rows.
///
/// Refused are rows without position or without the parameters of a two-mass drive, fewer than ten that are
/// trusted, rows at one position only, rows of another machine or other units (a total inertia off by a
/// factor of two), and gaps, or too few rows, over which a parameter changes by more than a
/// fifth.
[[nodiscard]] expected<ResultsOverPosition, Error> results_over_position(const Result& result,
                                                                         const Track& rows);

}  // namespace resonid::identification
