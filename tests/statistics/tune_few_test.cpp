// SPDX-License-Identifier: MIT
// What judges tuned controllers on the true machine, against golden figures and the simulator; five of the
// seeds that tune_test.cpp counts on.
#include <gtest/gtest.h>

#include <golden.hpp>
#include <tuned_seeds.hpp>
#include <vector>

namespace resonid {
namespace {

TEST(TrueTwoMass, HasTheGoldenMaximaAndPoles) {
  const auto golden = test::golden_json("e_tune_pi.json");
  int cases = 0;
  for (const auto& c : golden.at("cases")) {
    const auto& told = c.at("parameters");
    if (told.size() != 4 || c.at("delay_s") == 0.0) continue;
    const std::vector<double> p = told;
    SCOPED_TRACE(c.at("plant").dump() + c.at("bounds").dump());
    const double step = c.at("sample_time_s"), kp = c.at("kp"), ki = c.at("ki"), delay_s = c.at("delay_s");
    const test::TrueTwoMass machine({p[0], p[1], p[2], p[3], 0.0}, delay_s, step);
    const auto found = machine.under(data::pi_controller(kp, kp / ki, step));
    EXPECT_TRUE(found.stable);
    EXPECT_NEAR(found.sensitivity, c.at("sensitivity").at("max").get<double>(), 2e-6);
    EXPECT_NEAR(found.load_transfer, c.at("load_transfer").at("max").get<double>(), 2e-6);
    EXPECT_NEAR(found.spectral_radius, c.at("spectral_radius").get<double>(), 1e-6);
    ++cases;
  }
  EXPECT_GE(cases, 30);
}

/// A delay of parts of a sample, too.
TEST(TrueTwoMass, HasTheLoopOfTheSimulator) {
  auto c = io::shipped_experiment("vi_chirp_a");
  for (const double delay_s : {0.004, 0.00437, 0.0031}) {
    c.measurement.delay_s = delay_s;
    const auto truth = test::simulated(c, std::vector<double>{5.0}).truth;
    const test::TrueTwoMass machine(test::true_masses(c), delay_s, 1.0 / c.run.sample_rate_hz);
    for (std::size_t i = 100; i < truth.loop.frequency_hz.size(); i += 500) {
      const auto ours = machine.loop(*truth.controller, truth.loop.frequency_hz[i]);
      EXPECT_LT(std::abs(ours / truth.loop.value[i] - 1.0), 1e-6) << truth.loop.frequency_hz[i];
    }
  }
}

/// Of 95 % three of five are inside but once in 900 times.
TEST(TuneOnTheTruth, KeepsItsBoundsWithFiveSeeds) {
  identification::TuneOptions o;
  o.structure = identification::ControllerStructure::pi;
  o.draws = 2000;
  const auto found = test::tuned_seeds("vi_chirp_a", 1, 5, o);
  EXPECT_EQ(found.unstable + found.untrusted + found.refused, 0);
  EXPECT_GE(found.inside, 3);
}

}  // namespace
}  // namespace resonid
