// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <cstdint>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/linear_system.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/data/two_mass.hpp>
#include <vector>

namespace resonid::test {

/// System 2 at 2 ms in the loop of the golden files: PI, two samples of delay, white noise on the
/// measurement.
struct BeltDrive {
  double step_s = 0.002;
  double gain = 1.03598193204;
  double integral_time_s = 0.147023908851;
  data::TwoMassParameters parameters{0.032, 0.032, 5.75e4 * 0.0025, 120 * 0.0025, 0.0};
  LinearSystem<double, 3> system = zero_order_hold(data::continuous_system(parameters), step_s);

  [[nodiscard]] std::complex<double> response(double f_hz) const {
    const auto z = std::polar(1.0, kTwoPi * f_hz * step_s);
    const Eigen::Matrix3cd m = z * Eigen::Matrix3cd::Identity() - system.a.cast<std::complex<double>>();
    return (system.c.cast<std::complex<double>>() * m.inverse() * system.b.cast<std::complex<double>>())(0);
  }

  [[nodiscard]] data::TransferFunction controller() const {
    return data::pi_controller(gain, integral_time_s, step_s);
  }

  /// Closed loop from rest at the operating point `speed`.
  [[nodiscard]] data::Record run(const std::vector<double>& excitation, double noise, std::uint64_t seed,
                                 double speed = 0.0) const {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    data::Record record;
    record.sample_rate_hz = 1.0 / step_s;
    record.excitation.samples = excitation;
    Eigen::Vector3d state(speed, speed, 0.0);
    double integral = 0.0;
    double delayed[2] = {speed, speed};
    for (const double ru : excitation) {
      const double y = delayed[0] + noise * normal(engine);
      integral += gain * step_s / integral_time_s * (speed - y);
      const double u = gain * (speed - y) + integral + ru;
      record.input.samples.push_back(u);
      record.output.samples.push_back(y);
      delayed[0] = delayed[1];
      delayed[1] = state(0);
      state = (system.a * state + system.b * u).eval();
    }
    return record;
  }
};

inline std::vector<double> chirp(double f0_hz, double f1_hz, double duration_s, double step_s) {
  std::vector<double> samples;
  const double rate = (f1_hz - f0_hz) / duration_s;
  for (long k = 0; k < std::lround(duration_s / step_s); ++k) {
    const double t = static_cast<double>(k) * step_s;
    samples.push_back(std::cos(kTwoPi * (f0_hz * t + 0.5 * rate * t * t)));
  }
  return samples;
}

/// sqrt(mean |G/truth - 1|^2) over the lines.
template <class Truth>
double relative_rms(const std::vector<double>& f_hz, const std::vector<std::complex<double>>& value,
                    Truth&& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < f_hz.size(); ++i) sum += std::norm(value[i] / truth(f_hz[i]) - 1.0);
  return std::sqrt(sum / static_cast<double>(f_hz.size()));
}

inline std::vector<double> range_hz(double first, double last, double step) {
  std::vector<double> f;
  for (long i = 0; first + static_cast<double>(i) * step <= last + 1e-9; ++i)
    f.push_back(first + static_cast<double>(i) * step);
  return f;
}

}  // namespace resonid::test
