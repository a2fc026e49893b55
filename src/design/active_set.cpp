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
  // What the last round may leave is taken off before, so that draws, which are counted strictly, are within.
  // Without a variance there is no other machine, and the gains are exact.
  constexpr double kLeft = 3e-4;
  const Bounds aim = !posterior_.is_exact() ? tightened(bounds_, kLeft) : bounds_;
  for (int round = 0; round < kRounds; ++round) {
    const auto gains = largest_integral_gain(machines_, biquads, aim);
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
  bool met = true;
  for (const Transfer transfer : bounded_transfers(bounds_)) {
    auto worst = worst_case(posterior_, design.controller, transfer, radius_);
    worst.peak.bound = *bound_of(bounds_, transfer);
    if (worst.peak.value > worst.peak.bound) {
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
