// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/transfer_function.hpp>

namespace resonid::data {

/// A controller from velocity error to torque: a transfer function, or a PI law that takes the sample time of
/// the record that it is used with.
struct Controller : TransferFunction {
  /// C(z) = gain (1 + Ts/integral_time * z/(z-1)) (backward Euler).
  struct Pi {
    double gain = 0.0;
    double integral_time_s = 0.0;
  };
  std::optional<Pi> law;  ///< Not sampled yet: numerator and denominator are empty.

  Controller() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): a sampled transfer function is a controller
  Controller(TransferFunction sampled) : TransferFunction(std::move(sampled)) {}
  explicit Controller(const Pi& pi) : law(pi) {}

  /// At that sample time; one that is sampled already stays as it is.
  [[nodiscard]] Controller sampled(double at_sample_time_s) const {
    return law ? Controller(pi_controller(law->gain, law->integral_time_s, at_sample_time_s)) : *this;
  }
};

}  // namespace resonid::data

namespace resonid {

/// PI controller from velocity error to torque, for records of any sample time.
[[nodiscard]] inline data::Controller pi(double gain, double integral_time_s) {
  return data::Controller(data::Controller::Pi{gain, integral_time_s});
}

}  // namespace resonid
