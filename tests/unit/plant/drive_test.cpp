// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <resonid/plant/linear_drive.hpp>

namespace resonid::plant {
namespace {

data::TwoMassParameters golden_system(const nlohmann::json& model) {
  const auto& p = model.at("params");
  const double r2 = 0.05 * 0.05;
  const bool first = model.at("driven_roller").get<int>() == 1;
  return {p.at(first ? "J1" : "J2"), p.at(first ? "J2" : "J1"), p.at("K").get<double>() * r2,
          p.at("D").get<double>() * r2, 0.0};
}

TEST(LinearDrive, TransferFunctionAndResponseMatchTheGoldenModels) {
  const auto models = test::golden_json("models.json");
  for (const char* name : {"belt1", "belt2", "belt3"})
    for (const double step : {0.001, 0.002}) {
      const auto& golden = models.at(name).at(step == 0.001 ? "Ts=0.001" : "Ts=0.002");
      const auto sampled = zero_order_hold(data::continuous_system(golden_system(models.at(name))), step);
      const auto model = transfer_function(sampled, step);
      for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(model.numerator[i], golden.at("b")[i].get<double>(), 1e-11) << name;
        EXPECT_NEAR(model.denominator[i], golden.at("a")[i].get<double>(), 1e-10) << name;
      }
      const auto f = models.at(name).at("f").get<std::vector<double>>();
      const auto expected = test::golden_complex(golden.at("G_zoh"));
      for (std::size_t i = 0; i < f.size(); ++i)
        EXPECT_LT(std::abs(response(sampled, step, f[i]) - expected[i]), 1e-9 * std::abs(expected[i]))
            << name;
    }
}

TEST(LinearDrive, RigidResponseStepsAsItsFormulaSays) {
  const double inertia = 0.05;
  const double friction = 0.2;
  RigidDrive drive(rigid_system(inertia, friction), 0.01, 0.25);
  EXPECT_NEAR(drive.settle(3.0), 0.6, 1e-15);
  for (int k = 0; k < 40; ++k) {  // W(t) = T/b + (W0 - T/b) exp(-b t/J)
    const double t = 0.01 * (k + 0.75);
    EXPECT_NEAR(drive.advance(1.0), 5.0 - 2.0 * std::exp(-friction / inertia * t), 1e-13);
  }
}

// The velocity part-way through a sample is the one that a drive sampled four times as fast has there.
TEST(LinearDrive, EarlyOutputLiesExactlyBetweenTheSamples) {
  const data::TwoMassParameters p{0.032, 0.02, 143.75, 0.3, 0.1};
  TwoMassDrive drive(data::continuous_system(p), 0.004, 0.75);
  TwoMassDrive fine(data::continuous_system(p), 0.001, 0.0);
  EXPECT_NEAR(drive.settle(7.0), 0.7, 1e-13);
  fine.settle(7.0);
  for (int k = 0; k < 200; ++k) {
    const double torque = std::sin(0.37 * k * k);
    const double early = drive.advance(torque);
    EXPECT_NEAR(early, fine.advance(torque), 1e-11);
    for (int i = 0; i < 3; ++i) fine.advance(torque);
  }
}

TEST(LinearDrive, StaysAtItsOperatingPoint) {
  TwoMassDrive drive(data::continuous_system(data::TwoMassParameters{0.032, 0.02, 143.75, 0.3, 0.05}), 0.002,
                     0.0);
  const double torque = drive.settle(10.0);
  EXPECT_NEAR(torque, 0.5, 1e-13);
  for (int k = 0; k < 5000; ++k) ASSERT_NEAR(drive.advance(torque), 10.0, 1e-11);
}

TEST(DriveConfig, BeltValuesAreReferredToTheShaft) {
  const DriveConfig belt{Structure::two_mass, data::Motion::rotary, 0.032, 0.032, 5.75e4, 120.0, 0.05, 0.0};
  const auto p = at_driven_shaft(belt);
  EXPECT_NEAR(p.stiffness, 143.75, 1e-12);
  EXPECT_NEAR(p.damping, 0.3, 1e-15);
}

TEST(DriveConfig, NamesTheFieldThatIsWrong) {
  const DriveConfig good{Structure::two_mass, data::Motion::rotary, 0.032, 0.032, 143.75, 0.3, 0.0, 0.0};
  ASSERT_TRUE(make_drive(good, 500.0, 0.0).has_value());
  const auto field = [&](double DriveConfig::*member, double value) {
    DriveConfig bad = good;
    bad.*member = value;
    return make_drive(bad, 500.0, 0.0).error().field;
  };
  EXPECT_EQ(field(&DriveConfig::driven_inertia, 0.0), "driven_inertia");
  EXPECT_EQ(field(&DriveConfig::load_inertia, -1.0), "load_inertia");
  EXPECT_EQ(field(&DriveConfig::stiffness, 0.0), "stiffness");
  EXPECT_EQ(field(&DriveConfig::damping, -0.1), "damping");
  EXPECT_EQ(field(&DriveConfig::viscous_friction, std::nan("")), "viscous_friction");
  EXPECT_EQ(make_drive(good, 0.0, 0.0).error().field, "sample_rate_hz");
  EXPECT_EQ(make_drive(good, 500.0, 1.0).error().field, "early_fraction");
}

}  // namespace
}  // namespace resonid::plant
