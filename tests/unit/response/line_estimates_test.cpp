// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/response/line_estimates.hpp>

namespace resonid {
namespace {

using Complex = std::complex<double>;

response::LineEstimates one_line(Complex excitation, Complex input, Complex output) {
  response::LineEstimates estimates;
  estimates.sample_time_s = 0.002;
  estimates.has_excitation = true;
  estimates.has_input = true;
  response::LineEstimate line;
  line.frequency_hz = 12.0;
  line.excitation = excitation;
  line.input = input;
  line.output = output;
  estimates.lines.push_back(line);
  return estimates;
}

TEST(LineEstimates, AllApproachesFindThePlantOfAnExactLoop) {
  const Complex plant(0.2, -0.6);
  const auto controller = data::pi_controller(1.0, 0.1, 0.002);
  const Complex c = controller.response(12.0);
  const Complex delayed = plant * std::polar(1.0, -kTwoPi * 12.0 * 0.004);
  const Complex input = 1.0 / (1.0 + c * delayed);
  const auto lines = one_line(1.0, input, delayed * input);
  response::ResponseOptions options;
  options.controller = controller;
  options.delay_s = 0.004;
  for (const auto approach : {Approach::direct, Approach::indirect, Approach::joint}) {
    options.approach = approach;
    EXPECT_LT(std::abs(response::plant_response(lines, options)->value[0] - plant), 1e-14);
  }
  EXPECT_LT(std::abs(response::loop_response(lines)->value[0] - c * delayed), 1e-14);
  EXPECT_LT(std::abs(response::controller_response(lines)->value[0] - c), 1e-13);
}

TEST(LineEstimates, DeviationsArePropagatedToFirstOrder) {
  auto lines = one_line({1.0, 0.2}, {0.6, 0.3}, {-0.2, 0.5});
  Eigen::Matrix3cd root = Eigen::Matrix3cd::Zero();
  root << Complex(1e-4, 0.0), Complex(0.0, 0.0), Complex(0.0, 0.0),  //
      Complex(2e-4, -1e-4), Complex(3e-4, 0.0), Complex(0.0, 0.0),   //
      Complex(-1e-4, 2e-4), Complex(1e-4, 4e-4), Complex(5e-4, 0.0);
  lines.lines[0].covariance = root * root.adjoint();
  response::ResponseOptions options;
  options.controller = data::pi_controller(1.0, 0.1, 0.002);
  std::mt19937_64 engine(7);
  std::normal_distribution<double> normal(0.0, std::sqrt(0.5));
  for (const auto approach : {Approach::direct, Approach::indirect}) {
    options.approach = approach;
    const auto centre = response::plant_response(lines, options);
    double sum = 0.0;
    constexpr int kDraws = 4000;
    for (int i = 0; i < kDraws; ++i) {
      Eigen::Vector3cd white;
      for (int x = 0; x < 3; ++x) white(x) = Complex(normal(engine), normal(engine));
      const Eigen::Vector3cd error = root * white;
      auto moved = lines;
      moved.lines[0].excitation += error(0);
      moved.lines[0].input += error(1);
      moved.lines[0].output += error(2);
      sum += std::norm(response::plant_response(moved, options)->value[0] - centre->value[0]) / kDraws;
    }
    EXPECT_NEAR(std::sqrt(sum) / centre->std[0], 1.0, 0.04);
  }
}

TEST(LineEstimates, FewAveragesWidenTheRegion) {
  // |error|^2/s^2 follows F(2, 2 nu): scipy.stats.f.ppf(0.95, 2, 8) = 4.458970107524511, against -ln 0.05.
  auto lines = one_line(1.0, 1.0, 1.0);
  lines.lines[0].covariance(2, 2) = 1e-4;
  const double known = response::plant_response(lines, {})->std[0];
  lines.lines[0].degrees_of_freedom = 4.0;
  const double estimated = response::plant_response(lines, {})->std[0];
  EXPECT_NEAR(known, 0.01, 1e-12);
  EXPECT_NEAR(estimated / known, std::sqrt(4.458970107524511 / -std::log(0.05)), 1e-9);
}

TEST(LineEstimates, VelocityFactorsInvertTheSamplingOfAnInertia) {
  // Unit inertia under a held torque: v = Ts/(z-1), x = Ts^2/2 (z+1)/(z-1)^2, and a(k) = u(k-1).
  const double ts = 0.002;
  for (const double f : {1.0, 40.0, 200.0}) {
    const Complex z = std::polar(1.0, kTwoPi * f * ts);
    const Complex velocity = ts / (z - 1.0);
    const Complex position = 0.5 * ts * ts * (z + 1.0) / ((z - 1.0) * (z - 1.0));
    const Complex acceleration = 1.0 / z;
    using data::OutputQuantity;
    EXPECT_LT(
        std::abs(position * response::velocity_factor(OutputQuantity::position, f, ts) / velocity - 1.0),
        1e-12);
    EXPECT_LT(
        std::abs(acceleration * response::velocity_factor(OutputQuantity::acceleration, f, ts) / velocity -
                 1.0),
        1e-12);
  }
}

TEST(LineEstimates, RefusesMissingSignalsAndNegativeDelay) {
  auto lines = one_line(1.0, 1.0, 1.0);
  response::ResponseOptions options;
  options.delay_s = -1e-3;
  EXPECT_EQ(response::plant_response(lines, options).error().field, "delay_s");
  options.delay_s = 0.0;
  lines.has_excitation = false;
  EXPECT_EQ(response::plant_response(lines, options).error().field, "excitation");
  EXPECT_EQ(response::loop_response(lines).error().field, "excitation");
  options.approach = Approach::direct;
  EXPECT_TRUE(response::plant_response(lines, options));
}

}  // namespace
}  // namespace resonid
