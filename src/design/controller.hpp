// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>
#include <functional>
#include <resonid/data/transfer_function.hpp>
#include <resonid/design/detail/filtered_pi.hpp>
#include <span>
#include <utility>
#include <vector>

namespace resonid::design {

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
