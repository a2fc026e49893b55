// SPDX-License-Identifier: MIT
// Position loops against an independent implementation (tests/golden/e_tune_structures.json).
#include <gtest/gtest.h>

#include <cmath>

#include "design/cascade.hpp"
#include "design/figures.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

template <class Check>
void for_each_case(const Check& check) {
  const auto golden = test::golden_json("e_tune_structures.json");
  ASSERT_EQ(golden.at("cascade").at("cases").size(), 3U);
  for (const auto& c : golden.at("cascade").at("cases")) {
    SCOPED_TRACE(c.dump());
    check(c, FilteredPi{c.at("kp"), c.at("ki"), {}});
  }
}

double ratio(double value, const nlohmann::json& golden) { return value / golden.get<double>(); }

TEST(GoldenCascade, LargestKv) {
  for_each_case([](const auto& c, const FilteredPi& velocity) {
    Machines machines(test::golden_machines(c));
    const auto kv = largest_kv(machines, velocity, default_cascade_bounds());
    ASSERT_TRUE(kv);
    EXPECT_NEAR(ratio(*kv, c.at("kv_exact")), 1.0, 1e-5);
    // It stands at a bound, and within the others.
    const auto f =
        figures_of(machines.all.front(), linear_controller({velocity, *kv}, c.at("sample_time_s")));
    const double s = f.peak(Transfer::sensitivity).value / 1.4,
                 t = f.peak(Transfer::load_transfer).value / 1.05;
    EXPECT_TRUE(f.stable);
    EXPECT_NEAR(std::max(s, t), 1.0, 1e-8);
  });
}

TEST(GoldenCascade, LoadStepOfThePosition) {
  for_each_case([](const auto& c, const FilteredPi& velocity) {
    const Machine machine = test::golden_machines(c).front();
    const auto step = position_step_of(machine, {velocity, c.at("kv")});
    const auto& golden = c.at("position_step");
    EXPECT_NEAR(ratio(step.iae, golden.at("iae")), 1.0, 1e-6);
    EXPECT_NEAR(ratio(step.ie, golden.at("ie")), 1.0, 1e-6);
    EXPECT_NEAR(ratio(step.peak, golden.at("peak")), 1.0, 1e-6);
    EXPECT_NEAR(step.ie * velocity.ki * c.at("kv").template get<double>(), 1.0, 1e-6);
  });
}

TEST(GoldenCascade, SearchIsAtLeastAsGood) {
  for_each_case([](const auto& c, const FilteredPi&) {
    Machines machines(test::golden_machines(c));
    const auto found = search_cascade(machines, default_cascade_bounds());
    ASSERT_TRUE(found);
    EXPECT_LT(ratio(found->iae, c.at("position_step").at("iae")), 1.0);
    const auto f = figures_of(machines.all.front(), linear_controller(found->cascade, c.at("sample_time_s")));
    EXPECT_LT(f.peak(Transfer::sensitivity).value, 1.4 * (1.0 + 1e-8));
    EXPECT_LT(f.peak(Transfer::load_transfer).value, 1.05 * (1.0 + 1e-8));
  });
}

TEST(Cascade, AVelocityLoopAtItsBoundLeavesNoRoom) {
  const auto golden = test::golden_json("e_tune_structures.json");
  Machines machines({test::golden_plant(golden, "system2")});
  const auto kv = largest_kv(machines, {2.112725983, 21.52729938, {}}, default_cascade_bounds());
  EXPECT_LT(kv.value_or(0.0), 0.05);
}

TEST(Cascade, AnUnstableOneHasNoFiniteError) {
  const auto golden = test::golden_json("e_tune_structures.json");
  const Machine machine = test::golden_plant(golden, "system2");
  EXPECT_FALSE(std::isfinite(position_step_of(machine, {{1.9, 19.0, {}}, 2000.0}).iae));
}

}  // namespace
}  // namespace resonid::design
