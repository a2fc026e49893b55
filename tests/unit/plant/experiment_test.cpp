// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <resonid/plant/experiment.hpp>

namespace resonid::plant {
namespace {

ExperimentConfig demo() {
  ExperimentConfig c;
  c.drive = {Structure::two_mass, data::Motion::rotary, 0.032, 0.032, 5.75e4, 120.0, 0.05, 0.0};
  c.controller.kind = ControllerKind::pi;
  c.controller.gain = 1.03598193204;
  c.controller.integral_time_s = 0.147023908851;
  c.excitation.kind = online::Kind::chirp;
  c.excitation.from_hz = 35.0;
  c.excitation.to_hz = 1.5;
  c.excitation.duration_s = 17.0;
  c.measurement = {0.004, 0.0};
  c.run = {500.0, 0.0, 1};
  return c;
}

TEST(Experiment, ReproducesTheGoldenRecordFromItsConfiguration) {
  const auto result = simulate_closed_loop(demo());
  ASSERT_TRUE(result.has_value());
  const auto& record = result->record;
  const auto u = test::golden_column("b_chirp_sys2.csv", "u_clean");
  const auto y = test::golden_column("b_chirp_sys2.csv", "y_clean");
  ASSERT_EQ(record.samples(), u.size());
  for (std::size_t k = 0; k < u.size(); ++k) {
    ASSERT_NEAR(record.input.samples[k], u[k], 3e-8);
    ASSERT_NEAR(record.output.samples[k], y[k], 3e-8);
  }
  EXPECT_EQ(record.sample_rate_hz, 500.0);
  EXPECT_TRUE(record.reference.present());
}

TEST(Experiment, TrueResponseMatchesTheGoldenOne) {
  const auto golden = test::golden_json("b_expected.json");
  const auto f = golden.at("f").get<std::vector<double>>();
  const auto expected = test::golden_complex(golden.at("G_true"));
  const auto result = simulate_closed_loop(demo(), f);
  ASSERT_TRUE(result.has_value());
  for (std::size_t i = 0; i < f.size(); ++i)
    EXPECT_LT(std::abs(result->truth.response.value[i] - expected[i]), 1e-9 * std::abs(expected[i]));
  EXPECT_NEAR(data::resonance_hz(result->truth.two_mass.value()), 15.0856513721, 1e-9);
  EXPECT_EQ(result->truth.delay_s, 0.004);
}

TEST(Experiment, LinesOfTheTrueResponseFollowTheExcitation) {
  auto c = demo();
  const auto chirp = simulate_closed_loop(c)->truth.response;
  ASSERT_EQ(chirp.lines(), 200U);
  EXPECT_NEAR(chirp.frequency_hz.front(), 1.5, 1e-12);
  EXPECT_NEAR(chirp.frequency_hz.back(), 35.0, 1e-12);
  c.excitation.kind = online::Kind::multisine;
  c.excitation.lines_hz.assign(std::vector{2.5, 5.0, 10.0});
  const auto multisine = simulate_closed_loop(c);
  EXPECT_EQ(multisine->truth.response.frequency_hz, (std::vector{2.5, 5.0, 10.0}));
  EXPECT_EQ(multisine->record.samples(), 200U);
}

TEST(Experiment, OperatingPointIsMerelyAdded) {
  auto c = demo();
  c.measurement.noise_rms = 0.1;
  const auto still = simulate_closed_loop(c)->record;
  c.motion = {MotionKind::constant, 10.0};
  const auto moving = simulate_closed_loop(c)->record;
  for (std::size_t k = 0; k < still.samples(); ++k)
    ASSERT_NEAR(moving.output.samples[k] - still.output.samples[k], 10.0, 1e-9);
}

TEST(Experiment, SeedDecidesTheNoise) {
  auto c = demo();
  c.measurement.noise_rms = 0.1;
  const auto one = simulate_closed_loop(c)->record.output.samples;
  EXPECT_EQ(one, simulate_closed_loop(c)->record.output.samples);
  c.run.seed = 2;
  EXPECT_NE(one, simulate_closed_loop(c)->record.output.samples);
}

TEST(Experiment, RigidMachineInOpenLoop) {
  auto c = demo();
  c.drive = {Structure::rigid, data::Motion::linear, 2.0, 0.0, 0.0, 0.0, 0.0, 3.0};
  c.controller.kind = ControllerKind::none;
  const auto result = simulate_closed_loop(c);
  ASSERT_TRUE(result.has_value());
  EXPECT_FALSE(result->truth.two_mass.has_value());
  EXPECT_FALSE(result->record.reference.present());
  EXPECT_EQ(result->record.output.unit, "m/s");
  EXPECT_EQ(result->record.input.samples, result->record.excitation.samples);
  // Zero-order hold of 1/(J s + b): (1 - p)/b / (z - p), p = exp(-b Ts/J).
  const double p = std::exp(-3.0 * 0.002 / 2.0);
  EXPECT_NEAR(result->truth.plant.numerator[1], (1.0 - p) / 3.0, 1e-15);
  EXPECT_NEAR(result->truth.plant.denominator[1], -p, 1e-15);
}

TEST(Experiment, NamesTheFieldThatIsWrong) {
  const auto field = [](auto change) {
    auto c = demo();
    change(c);
    const auto result = simulate_closed_loop(c);
    return result ? std::string("accepted") : result.error().field.str();
  };
  EXPECT_EQ(field([](auto&) {}), "accepted");
  EXPECT_EQ(field([](auto& c) { c.measurement.delay_s = -0.004; }), "measurement.delay_s");
  EXPECT_EQ(field([](auto& c) { c.measurement.noise_rms = -0.1; }), "measurement.noise_rms");
  EXPECT_EQ(field([](auto& c) { c.drive.stiffness = 0.0; }), "drive.stiffness");
  EXPECT_EQ(field([](auto& c) { c.controller.integral_time_s = 0.0; }), "controller.integral_time_s");
  EXPECT_EQ(field([](auto& c) { c.excitation.from_hz = 300.0; }), "excitation.from_hz");
  EXPECT_EQ(field([](auto& c) { c.run.sample_rate_hz = 0.0; }), "run.sample_rate_hz");
  EXPECT_EQ(field([](auto& c) { c.run.duration_s = -1.0; }), "run.duration_s");
  EXPECT_EQ(field([](auto& c) { c.excitation.kind = online::Kind::none; }), "run.duration_s");
  EXPECT_EQ(field([](auto& c) { c.controller.gain = 100.0; }), "controller.gain");
}

}  // namespace
}  // namespace resonid::plant
