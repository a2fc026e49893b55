// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "design/bounds.hpp"
#include "design/closed_loop.hpp"
#include "design/filter_search.hpp"
#include "design/largest_gain.hpp"
#include "design/posterior.hpp"

namespace resonid::design {

/// The machine of an ellipsoid at which a transfer is largest.
struct WorstCase {
  Peak peak;
  Eigen::VectorXd u;  ///< In standard deviations; its length is at most the radius.
};

/// By maximisation over the whole ellipsoid (docs/methods/tune.md 7.2): from the nominal gradient, its
/// opposite, and four random directions. As far as a local search finds; a Monte Carlo stands beside every
/// promise.
[[nodiscard]] WorstCase worst_case(const Posterior& posterior, const LinearController& controller,
                                   Transfer transfer, double radius);
[[nodiscard]] inline WorstCase worst_case(const Posterior& posterior, const FilteredPi& controller,
                                          Transfer transfer, double radius) {
  return worst_case(posterior, LinearController(controller, posterior.nominal().sample_time_s), transfer,
                    radius);
}

/// What of the posterior exceeds the bounds.
struct MonteCarlo {
  std::size_t draws = 0, exceeding = 0, unstable = 0;
  std::vector<std::size_t> exceeding_each;  ///< [kTransfers]
  std::vector<double> quantile_95, worst;   ///< [kTransfers], of those that are bounded; else 0

  [[nodiscard]] double probability() const {
    return draws == 0 ? 0.0 : static_cast<double>(exceeding) / static_cast<double>(draws);
  }
};
/// `radius`: draws are put on the surface of that ellipsoid instead; 0: the posterior's own.
[[nodiscard]] MonteCarlo monte_carlo(const Posterior& posterior, const LinearController& controller,
                                     const Bounds& bounds, std::size_t draws, std::uint64_t seed,
                                     double radius = 0.0);
[[nodiscard]] inline MonteCarlo monte_carlo(const Posterior& posterior, const FilteredPi& controller,
                                            const Bounds& bounds, std::size_t draws, std::uint64_t seed,
                                            double radius = 0.0) {
  return monte_carlo(posterior, LinearController(controller, posterior.nominal().sample_time_s), bounds,
                     draws, seed, radius);
}

struct RobustDesign {
  FilteredPi controller;
  double radius = 0.0;           ///< Of the ellipsoid over which the bounds are met.
  std::vector<WorstCase> worst;  ///< Of every bounded transfer.
  std::size_t machines = 0;      ///< How many the design had to suit.
};

/// The largest integral gain that meets the bounds on the whole ellipsoid, by an active set of the worst
/// machines (docs/methods/tune.md 7.3).
[[nodiscard]] std::optional<RobustDesign> robust_gains(const Posterior& posterior,
                                                       std::span<const Biquad> biquads, const Bounds& bounds,
                                                       double radius);

/// The radius at which all bounds are met with the probability `confidence`, and the design there
/// (docs/methods/tune.md 7.5).
struct ConfidentDesign {
  RobustDesign design;
  MonteCarlo check;
};
[[nodiscard]] std::optional<ConfidentDesign> confident_gains(const Posterior& posterior,
                                                             std::span<const Biquad> biquads,
                                                             const Bounds& bounds, double confidence,
                                                             std::size_t draws, std::uint64_t seed);

}  // namespace resonid::design
