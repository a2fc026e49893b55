// SPDX-License-Identifier: MIT
#include "identification/tune/robust_law.hpp"

#include <algorithm>
#include <cmath>

namespace resonid::identification {

using design::bounded_transfers;

std::optional<RobustLaw> law_over_ellipsoids(const RobustTask& task, const DesignFor& design, double radius) {
  constexpr int kRounds = 6;
  std::vector<design::Machine> machines;
  for (const auto& posterior : task.posteriors)
    machines.emplace_back(posterior.nominal(), posterior.known_to_hz());
  for (int round = 0; round < kRounds; ++round) {
    design::Machines all(machines);
    auto law = design(all);
    if (!law) return std::nullopt;
    bool met = true;
    RobustLaw found{*std::move(law), radius, {}, {}};
    for (const auto transfer : bounded_transfers(task.bounds)) {
      design::WorstCase worst{{transfer, 0.0, 0.0, *bound_of(task.bounds, transfer)}, {}};
      for (const auto& posterior : task.posteriors) {
        auto here = worst_case(posterior, found.law.linear, transfer, radius);
        here.peak.bound = worst.peak.bound;
        if (here.peak.value > here.peak.bound) {
          met = false;
          machines.emplace_back(posterior.at(here.u), posterior.known_to_hz());
        }
        if (here.peak.value > worst.peak.value) worst = std::move(here);
      }
      found.worst.push_back(std::move(worst));
    }
    if (met) return found;
  }
  return std::nullopt;
}

design::Bounds with_room(design::Bounds bounds) {
  for (auto* bound : {&bounds.sensitivity, &bounds.complementary, &bounds.load_transfer,
                      &bounds.controller_sensitivity, &bounds.disk, &bounds.beyond_band})
    if (*bound) **bound /= 1.0 + kRoom;
  return bounds;
}

std::vector<design::WorstCase> worst_cases(const RobustTask& task, const Law& law, double radius) {
  std::vector<design::WorstCase> list;
  for (const auto transfer : bounded_transfers(task.bounds)) {
    design::WorstCase worst{{transfer, 0.0, 0.0, 0.0}, {}};
    for (const auto& posterior : task.posteriors) {
      auto here = worst_case(posterior, law.linear, transfer, radius);
      if (here.peak.value > worst.peak.value) worst = std::move(here);
    }
    worst.peak.bound = *bound_of(task.bounds, transfer);
    list.push_back(std::move(worst));
  }
  return list;
}

design::MonteCarlo drawn(const RobustTask& task, const Law& law) {
  std::optional<design::MonteCarlo> most;
  std::size_t unstable = 0;
  for (const auto& posterior : task.posteriors) {
    auto here = monte_carlo(posterior, law.linear, task.bounds, task.draws, task.seed);
    unstable = std::max(unstable, here.unstable);
    if (!most || here.exceeding > most->exceeding) most = std::move(here);
  }
  most->unstable = unstable;
  return *most;
}

std::optional<RobustLaw> robust_law(const RobustTask& task, const DesignFor& design) {
  if (task.guarantee == Guarantee::ellipsoid) {
    double radius = 0.0;
    for (const auto& posterior : task.posteriors)
      radius = std::max(radius, design::ellipsoid_radius(task.confidence, posterior.dimension()));
    auto found = law_over_ellipsoids(task, design, radius);
    if (found) found->check = drawn(task, found->law);
    return found;
  }
  constexpr int kRounds = 6;
  constexpr double kLeast = 0.7;  // of the allowed probability: no need to come nearer
  const double allowed = design::allowed_share(task.confidence, task.draws);
  std::optional<RobustLaw> best;
  double low = 0.0, high = 0.0, radius = 2.0;
  for (int round = 0; round < kRounds; ++round) {
    auto found = law_over_ellipsoids(task, design, radius);
    if (!found) {
      high = radius;
      radius = 0.5 * (low + high);
      continue;
    }
    found->check = drawn(task, found->law);
    const double probability = found->check.probability();
    if (probability <= allowed && (!best || radius < best->radius)) best = std::move(found);
    if (probability <= allowed && probability >= kLeast * allowed) break;
    (probability > allowed ? low : high) = radius;
    radius = high > 0.0 ? 0.5 * (low + high) : 1.25 * radius;
  }
  return best;
}

}  // namespace resonid::identification
