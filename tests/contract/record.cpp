// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/online/models/detail/regression.hpp>
#include <tooth_belt.hpp>
#include <vector>

#include "subject.hpp"

namespace resonid::test {
namespace {

/// The tooth belt at 0.8 m under its soft controller, output a sample late and with noise.
std::vector<Sample> simulate() {
  const auto machine = tooth_belt(0.8, 1.0 / kRateHz);
  const auto coefficients = tooth_belt_controller(1.0 / kRateHz);
  auto controller =
      DiscreteFilter<double, 4>::create(coefficients.numerator, coefficients.denominator).value();
  online::Regression<double, 3> past(0, false);
  online::Regression<double, 3>::Vector f;
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  std::vector<Sample> samples(kPeriod);
  double measured = 0.0;
  for (std::size_t k = 0; k < kPeriod; ++k) {
    past.fill(f);
    double velocity = 0.0;
    for (std::size_t i = 0; i < 3; ++i) velocity += machine.b[i] * f[i] + machine.a[i] * f[3 + i];
    const double t = static_cast<double>(k) / kRateHz;
    const double y = measured + 0.02 * normal(generator);
    measured = velocity;
    const double ru = ((generator() & 1U) != 0 ? 1.0 : -1.0) + 0.5 * std::cos(kTwoPi * 12.0 * t) +
                      0.5 * std::cos(kTwoPi * 31.0 * t);
    const double u = ru + controller.step(-y);
    samples[k] = {ru, u, y};
    past.push(u, velocity);
  }
  return samples;
}

}  // namespace

const Sample& record(std::size_t k) noexcept {
  static const std::vector<Sample> samples = simulate();
  return samples[k % kPeriod];
}

const std::vector<Case>& cases() {
  static const std::vector<Case> all = [] {
    std::vector<Case> c;
    add_excitation_cases(c);
    add_tracking_cases(c);
    add_model_cases(c);
    add_other_cases(c);
    add_axis_cases(c);
    add_control_cases(c);
    return c;
  }();
  return all;
}

}  // namespace resonid::test
