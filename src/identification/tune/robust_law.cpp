// SPDX-License-Identifier: MIT
#include "identification/tune/robust_law.hpp"

#include <algorithm>
#include <cmath>

namespace resonid::identification {

using design::bounded_transfers;

namespace {

/// By an active set of machines over ellipsoids. What was worst for one controller or radius is near to what
/// is for the next, so that it is kept (docs/methods/tune.md 7.3).
class ActiveMachines {
 public:
  explicit ActiveMachines(const RobustTask& task) : task_(task) {}

  /// Nothing where no controller meets the bounds over the ellipsoids of that radius.
  std::optional<RobustLaw> design_at(double radius, const DesignFor& design) {
    constexpr int kRounds = 6;
    for (int round = 0; round < kRounds; ++round) {
      design::Machines all(machines_at(radius));
      auto law = design(all);
      if (!law) return std::nullopt;
      RobustLaw found{*std::move(law), radius, {}, {}};
      if (look_for_worst(found)) return found;
    }
    return std::nullopt;
  }

 private:
  struct Worst {
    const design::Posterior& posterior;
    Eigen::VectorXd u;  ///< Over the radius at which it was found.
  };

  [[nodiscard]] std::vector<design::Machine> machines_at(double radius) const {
    std::vector<design::Machine> machines;
    for (const auto& posterior : task_.posteriors)
      machines.emplace_back(posterior.nominal(), posterior.known_to_hz());
    for (const auto& worst : worst_)
      machines.emplace_back(worst.posterior.at(radius * worst.u), worst.posterior.known_to_hz());
    return machines;
  }

  /// Whether the bounds are met; else the machines that exceed them have joined.
  bool look_for_worst(RobustLaw& found) {
    bool met = true;
    for (const auto transfer : bounded_transfers(task_.bounds)) {
      design::WorstCase worst{{transfer, 0.0, 0.0, *bound_of(task_.bounds, transfer)}, {}};
      for (const auto& posterior : task_.posteriors) {
        auto here = worst_case(posterior, found.law.linear, transfer, found.radius);
        here.peak.bound = worst.peak.bound;
        if (here.peak.value > here.peak.bound) {
          met = false;
          worst_.push_back({posterior, here.u / found.radius});
        }
        if (here.peak.value > worst.peak.value) worst = std::move(here);
      }
      found.worst.push_back(std::move(worst));
    }
    return met;
  }

  const RobustTask& task_;
  std::vector<Worst> worst_;
};

}  // namespace

std::optional<RobustLaw> law_over_ellipsoids(const RobustTask& task, const DesignFor& design, double radius) {
  return ActiveMachines(task).design_at(radius, design);
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
  ActiveMachines active(task);
  if (task.guarantee == Guarantee::ellipsoid) {
    double radius = 0.0;
    for (const auto& posterior : task.posteriors)
      radius = std::max(radius, design::ellipsoid_radius(task.confidence, posterior.dimension()));
    auto found = active.design_at(radius, design);
    if (found) found->check = drawn(task, found->law);
    return found;
  }
  constexpr int kRounds = 6;
  constexpr double kLeast = 0.7;  // of the allowed probability: no need to come nearer
  const double allowed = design::allowed_share(task.confidence, task.draws);
  std::optional<RobustLaw> best;
  double low = 0.0, high = 0.0, radius = 2.0;
  for (int round = 0; round < kRounds; ++round) {
    auto found = active.design_at(radius, design);
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
