// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <experiments.hpp>
#include <vector>

// Cramer-Rao bound of a simulated two-mass drive, from the simulator's own matrices by differences: nothing
// of the fits is used.
namespace resonid::test {

/// Figures that are judged: J1, J2, K, D, resonance, anti-resonance.
inline constexpr int kFigures = 6;
inline const std::vector<const char*> kFigureNames = {"driven inertia", "load inertia", "stiffness",
                                                      "damping",        "resonance",    "anti-resonance"};

/// Parameters at the driven shaft.
Eigen::Vector4d drive_parameters(const plant::ExperimentConfig& c);
Eigen::VectorXd drive_figures(const Eigen::Vector4d& p);

/// Slopes of the simulated output: columns of the logarithms of the four parameters first, then those of load
/// torque and state at the start, which are unknown unless it starts at rest. The delay must be whole
/// samples.
Eigen::MatrixXd output_slopes(const plant::ExperimentConfig& c, const data::Record& record,
                              bool at_rest = false);

/// What the logarithms of the parameters make of the figures'.
Eigen::MatrixXd figure_gradient(const plant::ExperimentConfig& c);

/// Covariance of the logarithms of the figures for the recorded input and white noise at the output.
Eigen::MatrixXd bound_of_logarithms(const plant::ExperimentConfig& c, const data::Record& record,
                                    bool at_rest = false);

/// Fisher information of the logarithms of the four parameters, load torque and state at the start unknown:
/// that of records adds up.
Eigen::Matrix4d fisher_information_of_logarithms(const plant::ExperimentConfig& c,
                                                 const data::Record& record);

/// Errors and intervals of the figures over seeds.
struct Efficiency {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(kFigures);  ///< Of relative errors.
  Eigen::VectorXd bound = Eigen::VectorXd::Zero(kFigures);    ///< Sum of variances.
  Eigen::VectorXd inside = Eigen::VectorXd::Zero(kFigures);   ///< 95 % intervals that hold the truth.
  int seeds = 0;

  void add(const fit::DriveModel& model, const plant::ExperimentConfig& c,
           const Eigen::MatrixXd& covariance) {
    const Eigen::VectorXd truth = drive_figures(drive_parameters(c));
    for (int i = 0; i < kFigures; ++i) {
      const auto e = i < 4 ? model.estimate(static_cast<fit::Parameter>(i))
                           : (i == 4 ? model.resonance() : model.antiresonance());
      const double error = e.value / truth(i) - 1.0;
      squares(i) += error * error;
      bound(i) += covariance(i, i);
      if (std::abs(e.value - truth(i)) < 1.96 * e.std) inside(i) += 1.0;
    }
    ++seeds;
  }
  [[nodiscard]] double ratio(int i) const { return std::sqrt(squares(i) / bound(i)); }
  [[nodiscard]] double coverage(int i) const { return inside(i) / seeds; }
  [[nodiscard]] double rms(int i) const { return std::sqrt(squares(i) / seeds); }
};

}  // namespace resonid::test
