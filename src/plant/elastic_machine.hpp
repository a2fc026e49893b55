// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "plant/machine.hpp"

namespace resonid::plant {

/// What of N masses does not depend on how many they are, and is not done sample by sample: compiled once.
class ElasticMachine {
 public:
  ElasticMachine(Machine machine, bool lags, double sample_time_s);

  /// dx/dt = law [state; command; torques] = (fixed + factor by_factor + sqrt(factor) by_root) [...]: a
  /// spring is proportional to the stiffness, the damping of a tooth belt to its root.
  struct Law {
    Eigen::MatrixXd fixed, by_factor, by_root;
    [[nodiscard]] Eigen::MatrixXd at(double factor) const;
  };
  [[nodiscard]] Law law() const;
  /// [state; command; torques] of the machine with its couplings open.
  [[nodiscard]] Eigen::MatrixXd open_law() const;
  [[nodiscard]] double angle_scale() const noexcept { return scale_; }  ///< Of the states that are twists.
  [[nodiscard]] double first_stiffness() const noexcept { return first_stiffness_; }

  /// Pieces of a time over which dry friction is constant.
  [[nodiscard]] unsigned pieces(double duration_s, bool dry) const;

  /// State in which all masses move alike under these torques, the driven side at `angle`, and the command
  /// that holds it (last).
  [[nodiscard]] Eigen::VectorXd balance(double factor, double velocity, double angle,
                                        const Eigen::VectorXd& torques) const;

  [[nodiscard]] SampledDrive sampled(double factor, double early_s) const;

  Machine machine;

 private:
  [[nodiscard]] ContinuousDrive continuous(double factor) const;
  bool lags_;
  double sample_time_s_;
  double scale_ = 0.0;
  double first_stiffness_ = 0.0;
};

/// Zero-order-hold step over `duration_s` of dx/dt = law [state; inputs], by columns as the law: next state =
/// step [state; inputs]. Rows of the masses that are locked stay as they are.
void zoh_step(const double* law, int states, int inputs, int locked_first, int locked_second,
              double duration_s, double* step) noexcept;

}  // namespace resonid::plant
