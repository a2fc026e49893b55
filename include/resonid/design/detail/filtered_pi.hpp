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
    /// In plain arithmetic, without the checks for infinities that std::complex makes: searches ask often.
    [[nodiscard]] std::complex<double> at(std::complex<double> inverse_z) const {
      const double x = inverse_z.real(), y = inverse_z.imag(), xx = x * x - y * y, xy = 2.0 * x * y;
      const double n_re = b[0] + b[1] * x + b[2] * xx, n_im = b[1] * y + b[2] * xy;
      const double d_re = a[0] + a[1] * x + a[2] * xx, d_im = a[1] * y + a[2] * xy;
      const double square = d_re * d_re + d_im * d_im;
      return {(n_re * d_re + n_im * d_im) / square, (n_im * d_re - n_re * d_im) / square};
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
