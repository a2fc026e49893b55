// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "design/robust.hpp"

namespace resonid::design {

/// The nominal machine and the worst ones of an ellipsoid (docs/methods/tune.md 7.3). What was worst for one
/// controller or radius is near to what is for the next, so that they are kept.
class ActiveSet {
 public:
  /// Keeps references.
  ActiveSet(const Posterior& posterior, const Bounds& bounds, double radius);

  /// The largest integral gain that meets the bounds on the whole ellipsoid.
  [[nodiscard]] std::optional<RobustDesign> gains(std::span<const Biquad> biquads);
  [[nodiscard]] Machines& machines() { return machines_; }
  [[nodiscard]] double radius() const { return radius_; }
  /// A machine that a climb has missed.
  void add(const Eigen::VectorXd& u);
  /// The same machines, nearer or farther.
  void scale_to(double radius);

 private:
  /// Whether the bounds are met; else the machines that exceed them have joined.
  bool look_for_worst(RobustDesign& design);

  const Posterior& posterior_;
  const Bounds& bounds_;
  double radius_;
  std::vector<Eigen::VectorXd> worst_;
  Machines machines_;
};

}  // namespace resonid::design
