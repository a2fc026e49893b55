// SPDX-License-Identifier: MIT
// Searches with free biquads against the best that an independent implementation found
// (tests/golden/e_tune_filters.json).
#include "design/filter_search.hpp"

#include <gtest/gtest.h>

#include "design/closed_loop.hpp"
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
