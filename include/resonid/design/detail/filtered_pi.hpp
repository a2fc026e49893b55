// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <resonid/data/transfer_function.hpp>
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

/// C = (kp + ki Ts z/(z-1)) F, F the product of biquads (docs/methods/tune.md 1). Where ki is 0 there is no
/// integrator, and no pole at 1.
struct FilteredPi {
  double kp = 0.0;  ///< Nm/(rad/s)
  double ki = 0.0;  ///< Nm/rad
  std::vector<Biquad> biquads;

  [[nodiscard]] data::TransferFunction transfer_function(double sample_time_s) const;
};

}  // namespace resonid::design
