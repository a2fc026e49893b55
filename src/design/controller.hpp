// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <resonid/data/controller.hpp>
#include <span>
#include <vector>

namespace resonid::design {

/// (s^2 + 2 zn w s + w^2)/(s^2 + 2 zd w s + w^2) by Tustin's rule, prewarped at its own frequency; 1 at
/// standstill. A notch where zn < zd, a lead below its frequency where zn > zd (docs/methods/tune.md 6.1).
struct Biquad {
  double frequency_hz = 0.0;
  double numerator_damping = 1.0;
  double denominator_damping = 1.0;

  /// In powers of z^-1, a0 = 1.
  struct Coefficients {
    std::array<double, 3> b{}, a{};
    [[nodiscard]] std::complex<double> at(std::complex<double> inverse_z) const {
      return (b[0] + inverse_z * (b[1] + inverse_z * b[2])) / (a[0] + inverse_z * (a[1] + inverse_z * a[2]));
    }
  };
  [[nodiscard]] Coefficients coefficients(double sample_time_s) const;
};

/// C = (kp + ki Ts z/(z-1)) F, F the product of biquads (docs/methods/tune.md 1).
struct FilteredPi {
  double kp = 0.0;  ///< Nm/(rad/s)
  double ki = 0.0;  ///< Nm/rad
  std::vector<Biquad> biquads;

  [[nodiscard]] data::TransferFunction transfer_function(double sample_time_s) const;
};

/// F at frequencies.
[[nodiscard]] std::vector<std::complex<double>> filter_values(std::span<const Biquad> biquads,
                                                              std::span<const double> frequencies_hz,
                                                              double sample_time_s);

/// A controller from error to torque by its states; sections in series, since the coefficients of their
/// product lose digits at frequencies far below the sample rate.
struct ControllerStates {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  Eigen::RowVectorXd c;
  double d = 0.0;
};
[[nodiscard]] ControllerStates states_of(const FilteredPi& controller, double sample_time_s);
[[nodiscard]] ControllerStates states_of(const data::TransferFunction& controller);

}  // namespace resonid::design
