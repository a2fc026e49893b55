// SPDX-License-Identifier: MIT
#include "design/active_set.hpp"

#include <utility>

namespace resonid::design {

ActiveSet::ActiveSet(const Posterior& posterior, const Bounds& bounds, double radius)
    : posterior_(posterior),
      bounds_(bounds),
      radius_(radius),
      machines_({Machine(posterior.nominal(), posterior.known_to_hz())}) {}

void ActiveSet::scale_to(double radius) {
  machines_ = Machines({Machine(posterior_.nominal(), posterior_.known_to_hz())});
  for (auto& u : worst_) {
    if (radius_ > 0.0) u *= radius / radius_;
    machines_.add(Machine(posterior_.at(u), posterior_.known_to_hz()));
  }
  radius_ = radius;
}

void ActiveSet::add(const Eigen::VectorXd& u) {
  worst_.push_back(u);
  machines_.add(Machine(posterior_.at(u), posterior_.known_to_hz()));
}

std::optional<RobustDesign> ActiveSet::gains(std::span<const Biquad> biquads) {
  constexpr int kRounds = 12;
  for (int round = 0; round < kRounds; ++round) {
    const auto gains = largest_integral_gain(machines_, biquads, bounds_);
    if (!gains) return std::nullopt;
    RobustDesign design;
    design.controller = {gains->kp, gains->ki, {biquads.begin(), biquads.end()}};
    design.radius = radius_;
    design.machines = machines_.all.size();
    if (look_for_worst(design)) return design;
  }
  return std::nullopt;
}

bool ActiveSet::look_for_worst(RobustDesign& design) {
  constexpr double kMet = 1e-3;
  bool met = true;
  for (const Transfer transfer : bounded_transfers(bounds_)) {
    auto worst = worst_case(posterior_, design.controller, transfer, radius_);
    worst.peak.bound = *bound_of(bounds_, transfer);
    if (worst.peak.value > (1.0 + kMet) * worst.peak.bound) {
      met = false;
      add(worst.u);
    }
    design.worst.push_back(std::move(worst));
  }
  return met;
}

std::optional<RobustDesign> robust_gains(const Posterior& posterior, std::span<const Biquad> biquads,
                                         const Bounds& bounds, double radius) {
  return ActiveSet(posterior, bounds, radius).gains(biquads);
}

}  // namespace resonid::design
