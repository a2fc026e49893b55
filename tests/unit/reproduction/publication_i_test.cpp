// SPDX-License-Identifier: MIT
// The controllers of Publication I against the simulated machine's own response and against the definitions
// of S, T, SG and CS.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <reproduce/i_design.hpp>
#include <reproduce/runs.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/io/shipped_experiments.hpp>

namespace resonid::reproduction::i {
namespace {

struct Drive {
  plant::Truth truth;
  double step = 0.0;
  fit::DriveModel model;
};
/// With the response of the machine at these frequencies.
Drive drive_at(const std::vector<double>& grid) {
  const auto config = io::shipped_experiment("i_prbs");
  Drive drive;
  drive.truth = simulated(config, grid).truth;
  drive.step = 1.0 / config.run.sample_rate_hz;
  drive.model = machine_of(drive.truth, drive.step);
  return drive;
}

TEST(PublicationI, DesignsForTheSimulatedMachine) {
  const auto grid = grid_hz(0.5, 240.0, 0.5);
  const Drive drive = drive_at(grid);
  EXPECT_EQ(drive.truth.delay_s, 0.004);
  const auto values = drive.model.values(grid);
  for (std::size_t k = 0; k < grid.size(); ++k)
    EXPECT_LT(std::abs(values[k] / drive.truth.response.value[k] - 1.0), 1e-9) << grid[k];
}

/// By the simulation's own response and the two sums of the controller written out.
TEST(PublicationI, SensitivitiesAreWhatTheirDefinitionsSay) {
  const auto cascade = cascade_for(drive_at({}).model);
  ASSERT_TRUE(cascade);
  const Drive first = drive_at({});
  const auto found = sensitivities("", first.model, design::linear_controller(*cascade, first.step));
  const Drive drive = drive_at(found.frequency_hz);
  double largest = 0.0;
  for (std::size_t k = 0; k < found.frequency_hz.size(); ++k) {
    const auto inverse_z = std::polar(1.0, -kTwoPi * found.frequency_hz[k] * drive.step);
    const auto q = drive.step / (1.0 - inverse_z);
    const auto g = drive.truth.response.value[k] * inverse_z * inverse_z;  // 4 ms are two samples
    const auto c = (cascade->velocity.kp + cascade->velocity.ki * q) * (1.0 + cascade->kv * q);
    const auto s = 1.0 / (1.0 + c * g);
    EXPECT_NEAR(found.s[k] / std::abs(s), 1.0, 1e-8);
    EXPECT_NEAR(found.t[k] / std::abs(c * g * s), 1.0, 1e-8);
    EXPECT_NEAR(found.sg[k] / std::abs(g * s), 1.0, 1e-8);
    EXPECT_NEAR(found.cs[k] / std::abs(c * s), 1.0, 1e-8);
    largest = std::max(largest, std::abs(s));
  }
  EXPECT_LT(largest, 1.4 * (1.0 + 1e-6));
  EXPECT_GT(largest, 1.39);  // nothing is left unused
}

/// No gain at the Nyquist frequency, and none of an offset of the torque at the motor is left.
TEST(PublicationI, RstKeepsItsFixedParts) {
  const Drive drive = drive_at({});
  const auto rst = rst_for(drive.model);
  ASSERT_TRUE(rst);
  double at_nyquist = 0.0, most = 0.0, at_zero = 0.0;
  for (std::size_t k = 0; k < rst->r.size(); ++k) {
    at_nyquist += k % 2 == 0 ? rst->r[k] : -rst->r[k];
    most = std::max(most, std::abs(rst->r[k]));
  }
  for (const double x : rst->s) at_zero += x;
  EXPECT_LT(std::abs(at_nyquist), 1e-9 * most);
  EXPECT_LT(std::abs(at_zero), 1e-9);
  const auto found = sensitivities("", drive.model, design::LinearController(rst->controller(drive.step)));
  EXPECT_LT(*std::max_element(found.s.begin(), found.s.end()), 1.401);
  EXPECT_LT(*std::max_element(found.cs.begin(), found.cs.end()), 6.01);
}

TEST(PublicationI, ReadsTwoMassesFromTheirResponse) {
  const auto grid = grid_hz(2.0, 33.0, 0.5);
  const Drive drive = drive_at(grid);
  const auto read = read_as_two_masses(drive.truth.response, drive.step, drive.truth.delay_s);
  const auto machine = drive.truth.two_mass.value();
  EXPECT_NEAR(read.parameters.driven_inertia / machine.driven_inertia, 1.0, 1e-6);
  EXPECT_NEAR(read.parameters.load_inertia / machine.load_inertia, 1.0, 1e-6);
  EXPECT_NEAR(read.parameters.stiffness / machine.stiffness, 1.0, 1e-6);
  EXPECT_NEAR(read.parameters.damping / machine.damping, 1.0, 1e-5);
  EXPECT_EQ(read.delay_s, 0.004);
}

TEST(PublicationI, PageShowsTheFourSensitivities) {
  Options options;
  options.seeds = 2;
  const auto page = publication_i(options);
  ASSERT_EQ(page.sections.size(), 2U);
  const auto& charts = page.sections[1].charts;
  ASSERT_EQ(charts.size(), 4U);
  const char* names[] = {"S = ", "T = C G S", "S G", "C S"};
  for (std::size_t i = 0; i < charts.size(); ++i) {
    EXPECT_NE(charts[i].title.find(names[i]), std::string::npos);
    ASSERT_EQ(charts[i].curves.size(), 4U);
    for (const auto& curve : charts[i].curves)
      EXPECT_TRUE(std::all_of(curve.y.begin(), curve.y.end(), [](double y) { return std::isfinite(y); }));
  }
  const auto largest = [](const report::Curve& curve) {
    return std::pow(10.0, *std::max_element(curve.y.begin(), curve.y.end()) / 20.0);
  };
  const auto& s = charts[0].curves;
  EXPECT_LT(largest(s[0]), 1.4 * (1.0 + 1e-6));  // from the machine itself
  EXPECT_GT(largest(s[1]), 1.45);                // from the reference model, whose inertia is 15 % larger
  EXPECT_NEAR(largest(s[2]), 1.4, 0.02);         // identified
}

}  // namespace
}  // namespace resonid::reproduction::i
