// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>
#include <memory>
#include <resonid/fit/drive_model.hpp>
#include <span>
#include <vector>

namespace resonid::fit {

/// A drive as a loop around it sees it, sampled by zero-order hold with every delay inside:
/// x(k+1) = a x(k) + command u(k) + load_torque m(k), with the commanded torque u and a torque m on the load
/// (Nm; positive: it drives); y(k) = measured x(k) is the measured velocity, v(k) = load x(k) the load's
/// (rad/s). A rigid drive's load is the drive itself; x(0) is the velocity of the driven side.
struct SampledStates {
  Eigen::MatrixXd a;
  Eigen::VectorXd command, load_torque;
  Eigen::RowVectorXd measured, load;
  double sample_time_s = 0.0;
  /// The first states are those of the motion; then come the lagging torque, the commanded torque and that on
  /// the load of the sample before, the filter of the velocity, and `whole_delay` velocities on their way.
  Eigen::Index motion = 0, whole_delay = 0;
};

/// Torque lag, filter of the measured velocity, encoder differences, springs to the ground, known and fitted
/// delay included; a fraction of a sample is exact (docs/methods/drive_models.md).
[[nodiscard]] SampledStates sampled_states(const DriveModel& model);

/// The same at frequencies; sampled once, for many calls.
class SampledResponse {
 public:
  struct Value {
    std::complex<double> measured;  ///< Commanded torque to measured velocity, every delay inside.
    std::complex<double> load;      ///< Commanded torque to the load's velocity, without delay or filter.
  };
  explicit SampledResponse(const DriveModel& model);
  [[nodiscard]] std::vector<Value> at(std::span<const double> frequencies_hz) const {
    return of_->at(frequencies_hz);
  }

 private:
  struct Base {
    Base() = default;
    Base(const Base&) = delete;
    Base& operator=(const Base&) = delete;
    virtual ~Base() = default;
    [[nodiscard]] virtual std::vector<Value> at(std::span<const double> frequencies_hz) const = 0;
  };
  template <int Masses>
  struct OfMasses;
  std::shared_ptr<const Base> of_;
};

}  // namespace resonid::fit
