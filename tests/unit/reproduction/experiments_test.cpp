// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <resonid/io/experiment.hpp>
#include <resonid/reproduction/experiments.hpp>

namespace resonid::reproduction {
namespace {

TEST(ShippedExperiments, AreValidAndRun) {
  const auto all = shipped_experiments();
  ASSERT_GE(all.size(), 9U);
  EXPECT_TRUE(
      std::is_sorted(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; }));
  for (const auto& shipped : all) {
    auto config = io::parse_experiment(shipped.text, shipped.name);
    ASSERT_TRUE(config) << shipped.name << ": " << config.error().message;
    config->run.duration_s = 0.5;
    const auto simulation = plant::simulate_closed_loop(*config);
    ASSERT_TRUE(simulation) << shipped.name << ": " << simulation.error().field << ": "
                            << simulation.error().requirement;
  }
}

TEST(ShippedExperiments, AreFoundByName) {
  EXPECT_EQ(shipped_experiment("iv_multisine_a").drive.damping, 100.0);  // Pub. IV, Table 1
  EXPECT_EQ(shipped_experiment("iv_multisine_b").drive.stiffness, 3.1e4);
  EXPECT_EQ(shipped_experiment("iv_multisine_a").excitation.lines_hz.count, 8U);
}

}  // namespace
}  // namespace resonid::reproduction
