// SPDX-License-Identifier: MIT
// State feedback with an observer against an independent implementation
// (tests/golden/e_tune_structures.json).
#include <gtest/gtest.h>

#include <cmath>

#include "design/figures.hpp"
#include "design/state_feedback.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

StateWeights weights_of(const nlohmann::json& w) {
  return {w.at("load_speed"),       w.at("twist"),        w.at("motor_speed"),      w.at("torque"),
          w.at("load_torque_walk"), w.at("torque_noise"), w.at("measurement_noise")};
}

LinearController golden_controller(const nlohmann::json& lqg, const Machine& machine) {
  const auto s = state_feedback(machine.model(), weights_of(lqg.at("weights")));
  EXPECT_TRUE(s);
  return {s->controller, machine.sample_time_s()};
}

TEST(GoldenStateFeedback, Response) {
  test::for_each_rst_and_lqg([](const auto& c, const Machine& machine) {
    const auto& g = c.at("lqg");
    const std::vector<double> f = g.at("frequency_hz"), re = g.at("controller_real"),
                              im = g.at("controller_imag");
    const auto found = golden_controller(g, machine).at(f);
    for (std::size_t i = 0; i < f.size(); ++i)
      EXPECT_LT(std::abs(found[i] - std::complex<double>(re[i], im[i])), 1e-6 * std::abs(found[i])) << f[i];
  });
}

TEST(GoldenStateFeedback, Figures) {
  test::for_each_rst_and_lqg([](const auto& c, const Machine& machine) {
    const auto& g = c.at("lqg");
    const auto f = figures_of(machine, golden_controller(g, machine));
    const auto expect = [&](double found, const auto& golden, double room) {
      EXPECT_NEAR(found / golden.template get<double>(), 1.0, room) << golden;
    };
    expect(f.peak(Transfer::sensitivity).value, g.at("sensitivity"), 1e-5);
    expect(f.peak(Transfer::complementary).value, g.at("complementary"), 1e-5);
    expect(f.peak(Transfer::controller_sensitivity).value, g.at("controller_sensitivity"), 1e-5);
    expect(f.peak(Transfer::load_transfer).value, g.at("load_transfer"), 1e-5);
    expect(f.noise_gain, g.at("noise_gain"), 1e-3);
    expect(f.spectral_radius, g.at("spectral_radius"), 1e-6);
    expect(f.load_step.iae, g.at("load_step").at("iae"), 1e-5);
    expect(f.load_step.ie, g.at("load_step").at("ie"), 1e-5);
    expect(f.load_step.peak, g.at("load_step").at("peak"), 1e-5);
    EXPECT_NEAR(f.load_step.rebound, g.at("load_step").at("rebound").template get<double>(), 1e-5);
  });
}

TEST(GoldenStateFeedback, SearchIsBetterThanTheGoldenOne) {
  test::for_each_rst_and_lqg([](const auto& c, const Machine& machine) {
    Machines machines({machine}, 0.5);
    const auto found = search_state_feedback(machines, test::golden_bounds(c.at("bounds")));
    ASSERT_TRUE(found);
    EXPECT_LT(found->iae, c.at("lqg").at("load_step").at("iae").template get<double>());
    const auto f = figures_of(machine, LinearController(found->feedback.controller, machine.sample_time_s()));
    EXPECT_TRUE(f.stable);
    EXPECT_NEAR(f.load_step.iae / found->iae, 1.0, 1e-6);
    const Bounds bounds = test::golden_bounds(c.at("bounds"));
    for (const Transfer transfer : kTransfers)
      if (const auto bound = bound_of(bounds, transfer)) {
        EXPECT_LT(f.peak(transfer).value, *bound * (1.0 + 2e-3));
      }
  });
}

fit::DriveModel any_model(fit::Structure structure) {
  fit::DriveModel model;
  model.structure = structure;
  model.sample_time_s = 0.002;
  model.known_delay_s = 0.0033;
  model.torque_lag_s = 0.001;
  model.output_filter_s = 0.0015;
  model.parameters = {0.03, 0.03, 140.0, 0.3, 0.01};
  model.parameters.middle_inertia = 0.01;
  model.parameters.stiffness_2 = 900.0;
  model.parameters.damping_2 = 0.2;
  return model;
}

/// Every structure, with a fraction of a sample in its delay, torque lag, filter and friction.
TEST(StateFeedback, TakesTheSpeedToZeroAndFindsTheLoadTorque) {
  for (const auto structure : {fit::Structure::rigid, fit::Structure::two_mass, fit::Structure::three_mass}) {
    SCOPED_TRACE(static_cast<int>(structure));
    const Machine machine(any_model(structure));
    const auto s = state_feedback(machine.model(), {10.0, 1.0, 1.0, 1.0, 1e-3, 0.1, 1.0});
    ASSERT_TRUE(s);
    const auto& drive = machine.states();
    Eigen::VectorXd x = Eigen::VectorXd::Zero(drive.a.rows()), seen = Eigen::VectorXd::Zero(s->gain.cols());
    double load_speed = 1.0, worst = 0.0;
    const auto& c = s->controller;
    constexpr double kPush = -0.7;
    for (int k = 0; k < 5000; ++k) {
      const double error = -drive.measured * x;
      const double torque = c.c * seen + c.d * error;
      load_speed = drive.load * x;
      if (k > 500) worst = std::max(worst, std::abs((s->load_speed * seen).value() - load_speed));
      seen = (c.a * seen + c.b * error).eval();
      x = (drive.a * x + drive.command * torque + drive.load_torque * kPush).eval();
    }
    EXPECT_NEAR(load_speed, 0.0, 1e-6);
    EXPECT_NEAR(seen(seen.size() - 1), kPush, 1e-6);
    EXPECT_LT(worst, 0.02);
    const double twist = structure == fit::Structure::rigid      ? 0.0
                         : structure == fit::Structure::two_mass ? -kPush / 140.0
                                                                 : -kPush / 140.0 - kPush / 900.0;
    EXPECT_NEAR((s->twist * seen).value(), twist, 1e-6);
  }
}

TEST(StateFeedback, HasNoneWithoutAWeightOnAnything) {
  auto model = any_model(fit::Structure::two_mass);
  model.parameters.viscous_friction = 0.0;  // so that it goes on for ever
  EXPECT_FALSE(state_feedback(model, {0.0, 0.0, 0.0, 1.0, 1e-3, 0.1, 1.0}));
}

}  // namespace
}  // namespace resonid::design
