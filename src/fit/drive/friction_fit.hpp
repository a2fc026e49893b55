// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <fit/drive/drive_simulation.hpp>
#include <fit/least_squares.hpp>
#include <functional>
#include <optional>
#include <resonid/fit/detail/noise_model.hpp>
#include <vector>

// Records fitted with the course of dry friction as a part of the simulation: a parameter that moves takes
// along the instants at which the driven side sticks and turns back. Slopes at a fixed course leave that out.
namespace resonid::fit::detail {

struct FrictionRecord {
  const DriveSignals& raw;
  NoiseModel noise;
  double weight;
  std::vector<int> coordinates;  ///< [coordinate of DriveSimulation] its place among those of all records.
};

struct FrictionProblem {
  const SimulationSetup& setup;
  std::vector<FrictionRecord> records;
  std::vector<int> active;  ///< Places, ascending.
  std::function<bool(const std::vector<double>&)> allowed;
  std::vector<Bound> bounds;  ///< Of places.

  [[nodiscard]] std::vector<double> local(const FrictionRecord& record, const std::vector<double>& x) const;
  /// Whitened residual, not weighted, of the samples that are used.
  [[nodiscard]] Eigen::VectorXd residual(const FrictionRecord& record, const std::vector<double>& x) const;
  /// Weighted sum of squares; infinite where x is not allowed.
  [[nodiscard]] double cost(const std::vector<double>& x) const;
  /// Rows whose normal matrix is that of all records' weighted [J r], [active, residual]. J by central
  /// differences of `steps` [active]: the residual has a kink wherever a sample starts or ends to stick, so
  /// steps are as wide as the parameters are in doubt. A step of 0 gives a slope of 0.
  [[nodiscard]] Eigen::MatrixXd factor(const std::vector<double>& x, const Eigen::VectorXd& steps) const;
  /// Slopes of one record's residual, `samples` to the end, by one place.
  [[nodiscard]] Eigen::VectorXd slope(const FrictionRecord& record, const std::vector<double>& x, int place,
                                      double step, Eigen::Index samples) const;
  [[nodiscard]] Eigen::Index samples(const std::vector<double>& x) const;  ///< Of all records.

 private:
  [[nodiscard]] double clamped(int place, double value) const;
};

struct FrictionFit {
  std::vector<double> x;
  double cost;
  Eigen::MatrixXd covariance;  ///< [active, active] At the best x that was found.
  bool converged;
  bool rough = false;  ///< Converged as far as a rough cost tells.
};

/// Gauss-Newton steps from x, whose `deviations` [active] are known about. Nothing where the slopes do not
/// determine the coordinates.
[[nodiscard]] std::optional<FrictionFit> fit_with_friction(const FrictionProblem& problem,
                                                           std::vector<double> x, Eigen::VectorXd deviations);

}  // namespace resonid::fit::detail
