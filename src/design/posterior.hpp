// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <resonid/fit/drive_model.hpp>
#include <vector>

namespace resonid::design {

/// What identification leaves open of a machine (docs/methods/tune.md 7.1): its parameters, normal in the
/// logarithms of those that are positive by nature, and its delay, which always has a variance: a delay that
/// was known was known to `delay_std_s`.
class Posterior {
 public:
  Posterior(fit::DriveModel nominal, double delay_std_s);
  /// With a covariance of its own over these parameters, in those coordinates.
  Posterior(fit::DriveModel nominal, std::vector<fit::Parameter> parameters,
            const Eigen::MatrixXd& covariance);

  /// How many axes the ellipsoid has: the covariance's rank.
  [[nodiscard]] Eigen::Index dimension() const { return spread_.cols(); }
  [[nodiscard]] const fit::DriveModel& nominal() const { return nominal_; }
  /// The machine at u standard deviations along the axes of the ellipsoid.
  [[nodiscard]] fit::DriveModel at(const Eigen::VectorXd& u) const;
  /// The same deviations around another machine: relative ones of what is positive by nature.
  [[nodiscard]] Posterior around(fit::DriveModel nominal) const {
    Posterior other = *this;
    other.nominal_ = std::move(nominal);
    return other;
  }
  /// The same with every variance times `factor`.
  [[nodiscard]] Posterior scaled(double factor) const;

 private:
  void spread_by(const Eigen::MatrixXd& covariance);
  fit::DriveModel nominal_;
  std::vector<fit::Parameter> parameters_;
  Eigen::MatrixXd spread_;  ///< covariance = spread spread'
};

}  // namespace resonid::design
