// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <resonid/design/detail/bounds.hpp>
#include <vector>

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
/// opposite, and four random directions; where delays of whole samples are an edge, along each of up to eight
/// too. As far as a local search finds; a Monte Carlo stands beside every promise.
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
  /// The least distance from the nominal machine of a draw that is unstable, in standard deviations.
  std::optional<double> nearest_unstable;
  /// The draw that exceeds a bound by more than two thousandths and is nearest to the nominal machine; empty:
  /// none.
  Eigen::VectorXd nearest_exceeding;

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

/// What a design promises, and what a Monte Carlo says of it.
struct ConfidentDesign {
  RobustDesign design;
  MonteCarlo check;
  Bounds bounds;     ///< Those that the design meets: |CS| is bounded where there are filters.
  double iae = 0.0;  ///< Of the nominal machine's load after a load step, rad.
};

/// The radius at which all bounds are met with the probability `confidence`, and the design there
/// (docs/methods/tune.md 7.5).
[[nodiscard]] std::optional<ConfidentDesign> confident_gains(const Posterior& posterior,
                                                             std::span<const Biquad> biquads,
                                                             const Bounds& bounds, double confidence,
                                                             std::size_t draws, std::uint64_t seed);

/// In standard deviations, of the ellipsoid that holds a normal variable of so many dimensions with that
/// probability.
[[nodiscard]] double ellipsoid_radius(double probability, Eigen::Index dimension);

/// How sure a design is to meet its bounds.
struct Confidence {
  double probability = 0.95;
  Guarantee guarantee = Guarantee::probability;
  std::size_t draws = 10'000;
  std::uint64_t seed = 1;
};

/// The share of so many draws that may exceed a bound, so that of all machines no more than 1 - probability
/// do, as sure as a twentieth (one-sided): the controller is chosen by these very draws.
[[nodiscard]] double allowed_share(double probability, std::size_t draws);

/// PI with `how.biquads` filters (0: none) of the least integrated error for all machines of an ellipsoid.
/// The filters are searched again on the nominal machine and the worst ones, since those that suit the
/// nominal machine best lose most as its gains are made robust (docs/methods/tune.md 7.8). Where no bound
/// limits |CS| and there are filters, it is twice that of the nominal machine's PI. Nothing where no gain
/// meets the bounds, or a draw of the ellipsoid is unstable.
[[nodiscard]] std::optional<ConfidentDesign> confident_design(const Posterior& posterior,
                                                              const FilterSearch& how, const Bounds& bounds,
                                                              const Confidence& confidence);

}  // namespace resonid::design
