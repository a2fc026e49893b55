// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <resonid/fit/drive_model.hpp>
#include <vector>

#include "design/known_band.hpp"

namespace resonid::design {

/// What identification leaves open of a machine (docs/methods/tune.md 7.1): its parameters, normal in the
/// logarithms of those that are positive by nature, and its delay, which always has a variance: a delay that
/// was known was known to `delay_std_s`. Up to `known_to_hz` it was measured; what its model may err by above
/// is no matter of its parameters (weight_beyond()).
class Posterior {
 public:
  Posterior(fit::DriveModel nominal, double delay_std_s, double known_to_hz = kKnownEverywhere);
  /// With a covariance of its own over these parameters, in those coordinates.
  Posterior(fit::DriveModel nominal, std::vector<fit::Parameter> parameters,
            const Eigen::MatrixXd& covariance);

  /// How many axes the ellipsoid has: the covariance's rank.
  [[nodiscard]] Eigen::Index dimension() const { return spread_.cols(); }
  /// Whether no other machine is possible.
  [[nodiscard]] bool is_exact() const { return spread_.size() == 0 || spread_.isZero(0.0); }
  [[nodiscard]] const fit::DriveModel& nominal() const { return nominal_; }
  [[nodiscard]] double known_to_hz() const { return known_to_hz_; }
  /// The machine at u standard deviations along the axes of the ellipsoid.
  [[nodiscard]] fit::DriveModel at(const Eigen::VectorXd& u) const;
  /// The same deviations around another machine: relative ones of what is positive by nature.
  [[nodiscard]] Posterior around(fit::DriveModel nominal) const {
    Posterior other = *this;
    other.nominal_ = std::move(nominal);
    return other;
  }
  /// Around this machine, its covariance a share of the way to that of another posterior; a parameter that
  /// one of them does not know is exact there.
  [[nodiscard]] Posterior blended(const Posterior& other, double share) const;
  /// blended(), and what the course from this machine to the other may differ from a straight line by
  /// (docs/methods/tune.md 12): nothing at its ends, in the middle an eighth of what each parameter, or its
  /// logarithm, changes by.
  [[nodiscard]] Posterior between(const Posterior& other, double share) const;
  /// The same with every variance times `factor`, the delay's times `delay_factor`. A delay that is known
  /// better than the rest tells more of what is correlated with it: the machines that are left are among
  /// those that were (docs/methods/tune.md 7.6).
  [[nodiscard]] Posterior scaled(double factor, double delay_factor) const;
  /// Whether the delay's variance is not of the fit: no experiment makes it smaller.
  [[nodiscard]] bool delay_is_told() const { return delay_is_told_; }

 private:
  void spread_by(const Eigen::MatrixXd& covariance);
  fit::DriveModel nominal_;
  std::vector<fit::Parameter> parameters_;
  Eigen::MatrixXd spread_;  ///< covariance = spread spread'
  double known_to_hz_ = kKnownEverywhere;
  bool delay_is_told_ = false;
};

}  // namespace resonid::design
