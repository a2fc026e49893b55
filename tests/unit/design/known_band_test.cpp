// SPDX-License-Identifier: MIT
// Loops that stay small above the band in which a machine is known, by the definition on dense frequencies.
#include "design/known_band.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "design/cascade.hpp"
#include "design/figures.hpp"
#include "design/largest_gain.hpp"
#include "design/normal.hpp"
#include "design/pid.hpp"
#include "design/robust.hpp"
#include "golden_posteriors.hpp"

namespace resonid::design {
namespace {

constexpr double kKnown_hz = 3.0, kNyquist_hz = 250.0;

fit::DriveModel system_2() {
  return test::golden_posterior(test::golden_json("e_tune_robust.json").at("cases")[0]).nominal();
}

Bounds calm_and_small() {
  Bounds bounds = test::calm();
  bounds.beyond_band = 1.0;
  return bounds;
}

/// The largest of min(2, f/known) |L| from there on, and the least of |1 + L| - rho |L|: what the worst of
/// all responses in the disk leaves of |1 + L|.
struct Seen {
  double largest = 0.0, least_distance = 1.0;
};
Seen seen_above(const LoopFunctions& loop, double known_hz, int count) {
  std::vector<double> lines;
  for (int i = 0; i <= count; ++i)
    lines.push_back(known_hz * std::pow(kNyquist_hz / known_hz, static_cast<double>(i) / count));
  Seen seen;
  const auto values = loop.at(lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double rho = lines[i] < 2.0 * known_hz ? lines[i] / known_hz - 1.0 : 1.0,
                 size = std::abs(values[i].loop);
    seen.largest = std::max(seen.largest, (1.0 + rho) * size);
    seen.least_distance = std::min(seen.least_distance, std::abs(1.0 + values[i].loop) - rho * size);
  }
  return seen;
}

TEST(KnownBand, GrowsFromItsEndOverAnOctave) {
  EXPECT_EQ(weight_beyond(2.9, 3.0), 0.0);
  EXPECT_EQ(weight_beyond(3.0, 3.0), 1.0);
  EXPECT_DOUBLE_EQ(weight_beyond(4.5, 3.0), 1.5);
  EXPECT_EQ(weight_beyond(60.0, 3.0), 2.0);
  EXPECT_EQ(weight_beyond(1e6, kKnownEverywhere), 0.0);
}

/// To its bound, and no gain within the bounds has more ki (by a dense scan).
TEST(KnownBand, BoundsTheExactGains) {
  const Machine machine(system_2(), kKnown_hz);
  Machines machines({machine});
  const auto found = largest_integral_gain(machines, {}, calm_and_small());
  ASSERT_TRUE(found);
  const FilteredPi controller{found->kp, found->ki, {}};
  const auto seen =
      seen_above(LoopFunctions(machine.response(), controller, machine.sample_time_s()), kKnown_hz, 100'000);
  EXPECT_NEAR(seen.largest, 1.0, 1e-6);
  EXPECT_LE(seen.largest, 1.0 + 1e-8);
  EXPECT_GT(seen.least_distance, 0.0);
  const auto figures = figures_of(machine, controller);
  EXPECT_TRUE(figures.stable);
  EXPECT_LE(figures.crossings.back().frequency_hz, kKnown_hz * (1.0 + 1e-9));
  EXPECT_NEAR(figures.peak(Transfer::beyond_band).value, seen.largest, 1e-6);
  for (int i = 1; i < 60; ++i) {
    const FilteredPi other{2.0 * found->kp * i / 60.0, 1.01 * found->ki, {}};
    const LoopFunctions loop(machine.response(), other, machine.sample_time_s());
    const auto lines = first_lines_hz(machine.model());
    const bool met = loop.largest(Transfer::sensitivity, lines).value <= 1.4 &&
                     loop.largest(Transfer::load_transfer, lines).value <= 1.3 &&
                     seen_above(loop, kKnown_hz, 2000).largest <= 1.0;
    EXPECT_FALSE(met) << other.kp;
  }
}

TEST(KnownBand, BoundsOtherStructures) {
  const Machine machine(system_2(), kKnown_hz);
  const auto expect_small = [&](const LinearController& controller) {
    EXPECT_LE(seen_above(LoopFunctions(machine.response(), controller), kKnown_hz, 20'000).largest,
              1.0 + 1e-3);
    EXPECT_TRUE(closed_loop(machine.states(), controller.states()).is_stable());
  };
  Bounds bounds = default_cascade_bounds();
  Machines free({Machine(system_2())}), known({machine});
  const auto stiffer = largest_kv(free, {2.0, 10.0, {}}, bounds);
  bounds.beyond_band = 1.0;
  EXPECT_FALSE(largest_kv(known, {2.0, 10.0, {}}, bounds));  // the velocity loop alone is too large
  const auto kv = largest_kv(known, {0.5, 2.0, {}}, bounds);
  ASSERT_TRUE(stiffer && kv);
  expect_small(linear_controller({{0.5, 2.0, {}}, *kv}, machine.sample_time_s()));
  bounds = calm_and_small();
  bounds.controller_sensitivity = 4.0;
  Machines again({machine});
  const auto pid = search_pid(again, bounds, {16, 12, 1});
  ASSERT_TRUE(pid);
  expect_small(LinearController(pid->controller.transfer_function(machine.sample_time_s())));
}

TEST(KnownBand, ChangesNothingWhereItIsWide) {
  Machines wide({Machine(system_2(), 100.0)}), everywhere({Machine(system_2())});
  const auto bounded = largest_integral_gain(wide, {}, calm_and_small());
  const auto free = largest_integral_gain(everywhere, {}, test::calm());
  ASSERT_TRUE(bounded && free);
  EXPECT_NEAR(bounded->ki, free->ki, 1e-7 * free->ki);
}

/// With the confidence, on draws that the design did not see; with and without a filter.
TEST(KnownBand, HoldsOverThePosterior) {
  auto model = system_2();
  for (const auto p : {fit::kDrivenInertia, fit::kLoadInertia, fit::kStiffness, fit::kDamping}) {
    model.estimated[p] = true;
    model.covariance(p, p) = std::pow(0.03 * model.value(p), 2);
  }
  const Posterior posterior(model, 2e-4, kKnown_hz);
  for (const int biquads : {0, 1}) {
    FilterSearch how;
    how.biquads = biquads;
    const auto found =
        confident_design(posterior, how, calm_and_small(), {0.95, Guarantee::probability, 4000, 1});
    ASSERT_TRUE(found);
    StandardNormal normal(77);
    int exceeding = 0, crossing = 0;
    constexpr int kDraws = 1000;
    for (int i = 0; i < kDraws; ++i) {
      const Machine drawn(posterior.at(normal.next(posterior.dimension())));
      const LoopFunctions loop(drawn.response(), found->design.controller, drawn.sample_time_s());
      const auto lines = first_lines_hz(drawn.model());
      const bool small = seen_above(loop, kKnown_hz, 400).largest <= 1.0 + 1e-6;
      exceeding += !small || loop.largest(Transfer::sensitivity, lines).value > 1.4 ||
                   loop.largest(Transfer::load_transfer, lines).value > 1.3;
      crossing += figures_of(drawn, found->design.controller).crossings.back().frequency_hz > kKnown_hz;
    }
    // 5 % are allowed: 50, and three standard deviations of the count.
    EXPECT_LE(exceeding, 71) << biquads;
    EXPECT_GE(exceeding, 15) << biquads;
    EXPECT_LE(crossing, exceeding) << biquads;
  }
}

}  // namespace
}  // namespace resonid::design
