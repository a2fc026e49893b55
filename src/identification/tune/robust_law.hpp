// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "design/largest_gain.hpp"
#include "design/robust.hpp"
#include "identification/tune/law.hpp"

namespace resonid::identification {

/// The controller for a set of machines; nothing where none meets the bounds.
using DesignFor = std::function<std::optional<Law>(design::Machines&)>;

/// A controller, and what of the machines that may be exceeds the bounds.
struct RobustLaw {
  Law law;
  double radius = 0.0;                   ///< Of the ellipsoids over which the bounds are met.
  std::vector<design::WorstCase> worst;  ///< Of every bounded transfer, over all results.
  design::MonteCarlo check;              ///< Of the result that exceeds most often.
};

/// What is asked of a design for machines that are known by their posteriors, one per result.
struct RobustTask {
  std::span<const design::Posterior> posteriors;
  design::Bounds bounds;
  double confidence = 0.95;
  Guarantee guarantee = Guarantee::probability;
  std::size_t draws = 10'000;
  std::uint64_t seed = 1;
};

/// Worst cases of a given controller over ellipsoids of that radius.
[[nodiscard]] std::vector<design::WorstCase> worst_cases(const RobustTask& task, const Law& law,
                                                         double radius);
/// Machines drawn from each posterior; the result of the one that exceeds most often.
[[nodiscard]] design::MonteCarlo drawn(const RobustTask& task, const Law& law);

/// What a design is asked for so that it meets bounds over ellipsoids: by so much tighter as a search may
/// leave a bound exceeded, and as one more machine may.
inline constexpr double kRoom = 2e-3;

/// The design (for bounds tightened by kRoom) for the worst machines of ellipsoids of that radius.
[[nodiscard]] std::optional<RobustLaw> law_over_ellipsoids(const RobustTask& task, const DesignFor& design,
                                                           double radius);

/// A design (for bounds tightened by kRoom) for the worst machines, which are added until none is worse
/// (docs/methods/tune.md 7.3), over the radius at which all bounds are met with the confidence (7.5). For one
/// result by one structure design::confident_design() does the same in less time.
[[nodiscard]] std::optional<RobustLaw> robust_law(const RobustTask& task, const DesignFor& design);

}  // namespace resonid::identification
