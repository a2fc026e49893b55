// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>
#include <resonid/planning/detail/nominal_drive.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::planning {

/// A quantity that users want to know, with its predicted error bar.
struct Figure {
  std::string name;  ///< "stiffness", "resonance", "phase_margin" ...
  std::string unit;  ///< "Nm/rad"
  double value = 0.0;
  double std = 0.0;
};

/// Names of all figures that a drive has: its estimated parameters; resonance, antiresonance and their
/// damping ratios (resonance_damping, antiresonance_damping) unless it is rigid, of three masses the higher
/// ones too (resonance_2, antiresonance_2_damping ...); with a controller crossover, phase_margin and
/// modulus_margin of the loop.
[[nodiscard]] std::vector<std::string> figure_names(const NominalDrive& drive);

/// The figures of a model with the error bars that its covariance gives; only `names` when there are any.
[[nodiscard]] std::vector<Figure> figures_of(const NominalDrive& drive,
                                             const std::vector<std::string>& names = {},
                                             bool linear_motion = false);

/// Derivative of a figure by the estimated parameters, each in parts of its scale(): [figure, parameter].
[[nodiscard]] Eigen::MatrixXd figure_gradients(const NominalDrive& drive,
                                               const std::vector<std::string>& names);

/// Indices of the estimated parameters, and the unit in which each is counted: its value, or where that may
/// be 0 something of the size that matters (friction: J w_ares; delay: a sample).
[[nodiscard]] std::vector<int> estimated_of(const fit::DriveModel& model);
[[nodiscard]] double scale(const fit::DriveModel& model, int parameter);

/// Derivatives of the measured response by the estimated parameters in parts of their scale, times the loop's
/// sensitivity, over the noise's density: a line of power p (its amplitude squared over two) in the
/// excitation gives the Fisher information  p Re( column* column^T )  per sample. [parameter, line]
[[nodiscard]] Eigen::MatrixXcd line_sensitivities(const NominalDrive& drive,
                                                  std::span<const double> frequency_hz);

/// Fisher information of a record, in its two parts.
struct FisherInformation {
  /// Part of the excitation; parameters in parts of their scale, then initial state and constant load torque.
  /// Grows with the square of the amplitude in the first `parameters` rows and columns.
  Eigen::MatrixXd excitation;
  Eigen::MatrixXd noise;  ///< [parameter, parameter] of the noise that the controller feeds back.

  /// Covariance of the parameters in parts of their scale, with `amplitude` times the excitation; infinite
  /// where the record does not tell them all.
  [[nodiscard]] Eigen::MatrixXd covariance(double amplitude = 1.0) const;
};

/// What fed-back noise tells per sample: mean over all frequencies of Re(D* D^T) |C S|^2, whatever its
/// colour.
[[nodiscard]] Eigen::MatrixXd fisher_information_of_noise(const NominalDrive& drive);

/// Standard deviation of the torque that the controller makes of noise; 0 without a controller.
[[nodiscard]] double torque_of_noise(const NominalDrive& drive);

/// Fisher information of the record that the excitation makes from rest; `noise`:
/// fisher_information_of_noise(drive).
[[nodiscard]] FisherInformation fisher_information(const NominalDrive& drive,
                                                   std::span<const double> excitation,
                                                   const Eigen::MatrixXd& noise);

/// The model with a covariance of its parameters that is given in parts of their scale.
[[nodiscard]] NominalDrive with_covariance(const NominalDrive& drive, const Eigen::MatrixXd& covariance);

/// The model with the covariance that an unbiased fit of a record can reach: the inverse of Fisher's
/// information
///
///   F = X^T X / s^2 + N F_n,    X = d y/d theta, u being measured; F_n: what the noise teaches that the
///   controller feeds back
///
/// for the record that the excitation makes from rest, transients included; initial state and a constant load
/// torque are unknown as well, as fit::fit_output_error() has them. Coloured noise whitens X. Sources: Ljung
/// 1999, ch. 7 and 13; Goodwin and Payne 1977, ch. 6.
[[nodiscard]] NominalDrive predicted(const NominalDrive& drive, std::span<const double> excitation);

}  // namespace resonid::planning
