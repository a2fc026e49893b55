// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/online/control.hpp>
#include <vector>

namespace resonid::test {

/// A biquad by its difference equation (direct form I) in extended precision, its coefficients by Tustin's
/// substitution s = w/tan(w Ts/2) (z - 1)/(z + 1), multiplied out.
class DirectBiquad {
 public:
  DirectBiquad(const online::Biquad& biquad, double rate_hz) {
    const long double w = 2.0L * kPiLong * biquad.frequency_hz, q = w / std::tan(0.5L * w / rate_hz);
    const auto row = [&](long double damping) {
      const long double middle = 2.0L * damping * w * q;
      return std::array<long double, 3>{q * q + middle + w * w, 2.0L * (w * w - q * q),
                                        q * q - middle + w * w};
    };
    b_ = row(biquad.numerator_damping);
    a_ = row(biquad.denominator_damping);
  }
  long double step(long double x) {
    const long double y = (b_[0] * x + b_[1] * x_[0] + b_[2] * x_[1] - a_[1] * y_[0] - a_[2] * y_[1]) / a_[0];
    x_ = {x, x_[0]};
    y_ = {y, y_[0]};
    return y;
  }

 private:
  static constexpr long double kPiLong = 3.14159265358979323846264338327950288L;
  std::array<long double, 3> b_{}, a_{};
  std::array<long double, 2> x_{}, y_{};
};

/// Uniform in -1 ... 1 (xorshift).
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed) {}
  double operator()() {
    state_ ^= state_ << 13U;
    state_ ^= state_ >> 7U;
    state_ ^= state_ << 17U;
    return static_cast<double>(state_ >> 11U) / 4503599627370496.0 - 1.0;
  }

 private:
  std::uint64_t state_;
};

inline constexpr double kRate = 1000.0;
inline constexpr std::array<online::Biquad, 2> kFilters{{{54.0, 0.2, 0.6}, {210.0, 1.2, 0.5}}};

inline online::DriveControlConfig plain_config() {
  online::DriveControlConfig c;
  c.sample_rate_hz = kRate;
  c.kp = 0.6;
  c.ki = 25.0;
  return c;
}
inline online::DriveControlConfig filtered_config() {
  online::DriveControlConfig c = plain_config();
  c.biquads = kFilters;
  return c;
}
template <class Real>
online::ControlInputs<Real> velocity_inputs(double reference, double velocity) {
  return {.reference = static_cast<Real>(reference), .velocity = static_cast<Real>(velocity)};
}

}  // namespace resonid::test
