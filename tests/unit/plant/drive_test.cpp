// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <resonid/plant/detail/drive.hpp>

namespace resonid::plant {
namespace {

DriveConfig two_mass(double driven, double load, double stiffness, double damping, double radius = 0.0,
                     double viscous = 0.0) {
  return {Structure::two_mass, data::Motion::rotary, driven, load, stiffness, damping, radius, viscous};
}

std::unique_ptr<Drive> drive_of(const DriveConfig& config, double sample_time_s,
                                double early_fraction = 0.0) {
  return make_drive({config, {}, {}, 0.0}, 1.0 / sample_time_s, early_fraction).value();
}

DriveConfig golden_system(const nlohmann::json& model) {
  const auto& p = model.at("params");
  const bool first = model.at("driven_roller").get<int>() == 1;
  return two_mass(p.at(first ? "J1" : "J2"), p.at(first ? "J2" : "J1"), p.at("K"), p.at("D"), 0.05);
}

TEST(LinearDrive, TransferFunctionAndResponseMatchTheGoldenModels) {
  const auto models = test::golden_json("models.json");
  for (const char* name : {"belt1", "belt2", "belt3"})
    for (const double step : {0.001, 0.002}) {
      const auto& golden = models.at(name).at(step == 0.001 ? "Ts=0.001" : "Ts=0.002");
      const auto sampled = drive_of(golden_system(models.at(name)), step)->sampled(1.0);
      const auto model = transfer_function(sampled);
      for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(model.numerator[i], golden.at("b")[i].get<double>(), 1e-11) << name;
        EXPECT_NEAR(model.denominator[i], golden.at("a")[i].get<double>(), 1e-10) << name;
      }
      const auto f = models.at(name).at("f").get<std::vector<double>>();
      const auto expected = test::golden_complex(golden.at("G_zoh"));
      for (std::size_t i = 0; i < f.size(); ++i)
        EXPECT_LT(std::abs(response(sampled, f[i]) - expected[i]), 1e-9 * std::abs(expected[i])) << name;
    }
}

TEST(LinearDrive, RigidResponseStepsAsItsFormulaSays) {
  const double inertia = 0.05;
  const double friction = 0.2;
  const auto drive =
      drive_of({Structure::rigid, data::Motion::rotary, inertia, 0.0, 0.0, 0.0, 0.0, friction}, 0.01, 0.25);
  EXPECT_NEAR(drive->settle(3.0, 0.0), 0.6, 1e-15);
  for (int k = 0; k < 40; ++k) {  // W(t) = T/b + (W0 - T/b) exp(-b t/J)
    const double t = 0.01 * (k + 0.75);
    EXPECT_NEAR(drive->advance(1.0).velocity, 5.0 - 2.0 * std::exp(-friction / inertia * t), 1e-13);
  }
}

// The velocity part-way through a sample is the one that a drive sampled four times as fast has there.
TEST(LinearDrive, EarlyOutputLiesExactlyBetweenTheSamples) {
  const DriveConfig config = two_mass(0.032, 0.02, 143.75, 0.3, 0.0, 0.1);
  const auto drive = drive_of(config, 0.004, 0.75);
  const auto fine = drive_of(config, 0.001);
  EXPECT_NEAR(drive->settle(7.0, 0.0), 0.7, 1e-13);
  fine->settle(7.0, 0.0);
  for (int k = 0; k < 200; ++k) {
    const double torque = std::sin(0.37 * k * k);
    const MassMotion early = drive->advance(torque);
    const MassMotion same = fine->advance(torque);
    EXPECT_NEAR(early.velocity, same.velocity, 1e-11);
    EXPECT_NEAR(early.angle, same.angle, 1e-11);
    for (int i = 0; i < 3; ++i) fine->advance(torque);
  }
}

TEST(LinearDrive, StaysAtItsOperatingPoint) {
  const auto drive = drive_of(two_mass(0.032, 0.02, 143.75, 0.3, 0.0, 0.05), 0.002);
  const double torque = drive->settle(10.0, 0.0);
  EXPECT_NEAR(torque, 0.5, 1e-13);
  for (int k = 0; k < 5000; ++k) ASSERT_NEAR(drive->advance(torque).velocity, 10.0, 1e-11);
  EXPECT_NEAR(drive->place(), 100.0, 1e-9);
}

TEST(DriveConfig, BeltValuesAreReferredToTheShaft) {
  const DriveConfig belt = two_mass(0.032, 0.032, 5.75e4, 120.0, 0.05);
  const auto p = at_driven_shaft(belt);
  EXPECT_NEAR(p.stiffness, 143.75, 1e-12);
  EXPECT_NEAR(p.damping, 0.3, 1e-15);
}

TEST(DriveConfig, NamesTheFieldThatIsWrong) {
  const DriveConfig good = two_mass(0.032, 0.032, 143.75, 0.3);
  ASSERT_TRUE(make_drive({good, {}, {}, 0.0}, 500.0, 0.0).has_value());
  const auto field = [&](double DriveConfig::*member, double value) {
    DriveConfig bad = good;
    bad.*member = value;
    return make_drive({bad, {}, {}, 0.0}, 500.0, 0.0).error().field;
  };
  EXPECT_EQ(field(&DriveConfig::driven_inertia, 0.0), "driven_inertia");
  EXPECT_EQ(field(&DriveConfig::load_inertia, -1.0), "load_inertia");
  EXPECT_EQ(field(&DriveConfig::stiffness, 0.0), "stiffness");
  EXPECT_EQ(field(&DriveConfig::damping, -0.1), "damping");
  EXPECT_EQ(field(&DriveConfig::viscous_friction, std::nan("")), "viscous_friction");
  EXPECT_EQ(make_drive({good, {}, {}, 0.0}, 0.0, 0.0).error().field, "sample_rate_hz");
  EXPECT_EQ(make_drive({good, {}, {}, 0.0}, 500.0, 1.0).error().field, "early_fraction");
}

}  // namespace
}  // namespace resonid::plant
