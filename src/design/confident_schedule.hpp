// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/base/expected.hpp>
#include <vector>

#include "design/robust.hpp"
#include "design/schedule.hpp"

// Gains over position that keep all bounds with a stated probability wherever the position stands
// (docs/methods/tune.md 12).
namespace resonid::design {

struct ConfidentScheduleOptions {
  Bounds bounds;
  Confidence confidence;
  std::size_t first_nodes = 2, most_nodes = 33;
  std::size_t count = 41;                 ///< Even positions at which the machines are drawn.
  std::vector<double> further;            ///< Positions beside those: where the machines were identified.
  std::optional<double> most_noise_gain;  ///< Rms torque per rms of white noise, of every machine.
};

/// What of the posterior of one position exceeds the bounds, with the position fixed.
struct FrozenCheck {
  double position = 0.0;
  double radius = 0.0;  ///< Of the ellipsoid of the design there.
  MonteCarlo check;
  std::vector<WorstCase> worst;  ///< Of every bounded transfer, over that ellipsoid.
  double noise_gain = 0.0;
};

struct ConfidentSchedule {
  GainSchedule schedule;
  std::vector<double> radii;        ///< [node] Of the ellipsoid over which its bounds are met.
  std::vector<FrozenCheck> checks;  ///< Ascending in position.

  /// Where a bound is exceeded most often.
  [[nodiscard]] const FrozenCheck& worst() const;
};

/// PI gains with nodes at the radius at which all bounds are met with the confidence there. Machines are
/// drawn at every position, with the same random numbers; where too many of them exceed a bound between
/// nodes, a node is added, or the radius of both neighbours is raised, until the probability that all bounds
/// are met is that of the confidence at every position. No controller need suit all positions. Refused: a
/// position at which no gain does ("bounds"), and one between nodes at which the bounds are not met with the
/// confidence however soft the nodes are ("confidence"); the value is the position.
[[nodiscard]] expected<ConfidentSchedule> confident_schedule(const PosteriorAt& posterior_at,
                                                             const Stroke& stroke,
                                                             const ConfidentScheduleOptions& options);

}  // namespace resonid::design
