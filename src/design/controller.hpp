// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <functional>
#include <resonid/data/controller.hpp>
#include <span>
#include <utility>
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
/// One after the other: what comes out of `first` goes into `second`.
[[nodiscard]] ControllerStates in_series(const ControllerStates& first, const ControllerStates& second);

/// Any linear controller, u = C (r - y), as every loop function and figure takes it.
class LinearController {
 public:
  using Response = std::function<std::vector<std::complex<double>>(std::span<const double>)>;

  LinearController(const FilteredPi& controller, double sample_time_s);
  explicit LinearController(const data::TransferFunction& controller);
  LinearController(ControllerStates states, double sample_time_s);
  /// By its states and, where that is less work or has more digits, its values at frequencies in Hz.
  LinearController(ControllerStates states, Response response)
      : states_(std::move(states)), response_(std::move(response)) {}

  [[nodiscard]] std::vector<std::complex<double>> at(std::span<const double> frequencies_hz) const {
    return response_(frequencies_hz);
  }
  [[nodiscard]] const ControllerStates& states() const { return states_; }

  /// What the reference meets where that is not C: the position of a cascade through its gain.
  void set_reference_response(Response response) { reference_ = std::move(response); }
  [[nodiscard]] const Response& reference_response() const { return reference_; }

 private:
  ControllerStates states_;
  Response response_, reference_;
};

/// Ts z/(z - 1) at a frequency.
[[nodiscard]] std::complex<double> integrator_at(double frequency_hz, double sample_time_s);

}  // namespace resonid::design
