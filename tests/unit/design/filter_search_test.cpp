// SPDX-License-Identifier: MIT
// Searches with free biquads against the best that an independent implementation found
// (tests/golden/e_tune_filters.json).
#include "design/filter_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "design/figures.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

TEST(FilterSearch, ComesNearTheGoldenOnes) {
  const auto golden = test::golden_json("e_tune_filters.json");
  for (const auto& c : golden.at("cases")) {
    SCOPED_TRACE(c.at("plant").dump() + " " + c.at("bounds").dump());
    Machines machines(test::golden_machines(c), 0.5);
    FilterSearch how;
    how.biquads = static_cast<int>(c.at("biquads").size());
    const auto found = search_filters(machines, test::golden_bounds(c.at("bounds")), how);
    ASSERT_TRUE(found);
    EXPECT_LT(found->iae, 1.03 * c.at("load_step").at("iae").get<double>());
  }
}

/// What one biquad takes off the load-step error of the best PI, |CS| at most twice that of the PI: at least
/// 17 % at R = 1, 38 % at R = 2, 72 % at R = 5. The PI of system 2 leaves 0.0535 rad.
TEST(FilterSearch, OneBiquadTakesOffWhatIsPromised) {
  struct Share {
    const char* plant;
    double pi_iae, left;
  };
  const auto golden = test::golden_json("e_tune_filters.json");
  for (const Share& share :
       {Share{"system2", 0.0535, 0.83}, Share{"R2", 0.0914, 0.62}, Share{"R5", 0.3015, 0.28}}) {
    SCOPED_TRACE(share.plant);
    const auto found_case = std::find_if(golden.at("cases").begin(), golden.at("cases").end(),
                                         [&](const auto& c) { return c.at("plant") == share.plant; });
    ASSERT_NE(found_case, golden.at("cases").end());
    Bounds bounds;
    bounds.sensitivity = 1.4;
    bounds.load_transfer = 1.3;
    const Machine machine = test::golden_machines(*found_case).front();
    Machines alone({machine});
    const auto gains = largest_integral_gain(alone, {}, bounds);
    ASSERT_TRUE(gains);
    const auto pi = figures_of(machine, FilteredPi{gains->kp, gains->ki, {}});
    ASSERT_TRUE(pi.stable);
    EXPECT_LE(pi.peak(Transfer::sensitivity).value, 1.4 * (1.0 + 1e-6));
    EXPECT_LE(pi.peak(Transfer::load_transfer).value, 1.3 * (1.0 + 1e-6));
    EXPECT_LE(pi.load_step.iae, share.pi_iae);

    bounds.controller_sensitivity = 2.0 * pi.peak(Transfer::controller_sensitivity).value;
    Machines searched({machine}, 0.5);
    const auto found = search_filters(searched, bounds, {});
    ASSERT_TRUE(found);
    ASSERT_EQ(found->controller.biquads.size(), 1U);
    const auto filtered = figures_of(machine, found->controller);
    ASSERT_TRUE(filtered.stable);
    for (const Transfer transfer :
         {Transfer::sensitivity, Transfer::load_transfer, Transfer::controller_sensitivity})
      EXPECT_LE(filtered.peak(transfer).value, *bound_of(bounds, transfer) * (1.0 + 1e-6));
    EXPECT_LE(filtered.load_step.iae, share.left * pi.load_step.iae);
  }
}

/// The filter may not raise |CS| beyond its bound, and the gains are those of the exact design.
TEST(FilterSearch, KeepsTheBounds) {
  Bounds bounds;
  bounds.sensitivity = 1.4;
  bounds.load_transfer = 1.3;
  bounds.controller_sensitivity = 4.0;
  Machines machines({test::golden_machine({0.032, 0.032, 143.75, 0.3}, 0.002, 0.004)}, 0.5);
  const auto found = search_filters(machines, bounds, {});
  ASSERT_TRUE(found);
  const Machine& machine = machines.all.front();
  const LoopFunctions loop(machine.response(), found->controller, machine.sample_time_s());
  const auto lines = first_lines_hz(machine.model(), 4.0);
  for (const Transfer transfer :
       {Transfer::sensitivity, Transfer::load_transfer, Transfer::controller_sensitivity})
    EXPECT_LT(loop.largest(transfer, lines).value, *bound_of(bounds, transfer) * (1.0 + 1e-6));
}

}  // namespace
}  // namespace resonid::design
