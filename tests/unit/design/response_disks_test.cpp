// SPDX-License-Identifier: MIT
// Gains from a response alone against an independent implementation (tests/golden/e_tune_robust.json),
// against responses inside the disks, and against loops that lines cannot tell.
#include "design/response_disks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>
#include <resonid/base/constants.hpp>

#include "design/closed_loop.hpp"
#include "design/ends_of_lines.hpp"
#include "design/figures.hpp"
#include "design/first_sign_change.hpp"
#include "design/normal.hpp"
#include "design/pid.hpp"
#include "design/polynomial.hpp"
#include "golden_posteriors.hpp"

namespace resonid::design {
namespace {

constexpr double kStep = 0.002;

struct GoldenDisks {
  nlohmann::json golden = test::golden_json("e_tune_robust.json").at("disk");
  AntiResonance load{golden.at("antiresonance_hz"), golden.at("antiresonance_damping")};

  [[nodiscard]] ResponseDisks of(double relative_radius) const {
    ResponseDisks disks;
    disks.sample_time_s = kStep;
    disks.frequencies_hz = golden.at("frequency_hz").get<std::vector<double>>();
    for (std::size_t i = 0; i < disks.frequencies_hz.size(); ++i) {
      disks.centres.emplace_back(golden.at("real")[i].get<double>(), golden.at("imag")[i].get<double>());
      disks.radii.push_back(relative_radius * std::abs(disks.centres.back()));
    }
    return disks;
  }
};

Bounds sensitivity_only() {
  Bounds bounds = test::calm();
  bounds.load_transfer.reset();
  return bounds;
}

ResponseDisks part_of(const ResponseDisks& all, double from_hz, double to_hz) {
  ResponseDisks some;
  some.sample_time_s = kStep;
  for (std::size_t i = 0; i < all.frequencies_hz.size(); ++i) {
    if (all.frequencies_hz[i] < from_hz || all.frequencies_hz[i] > to_hz) continue;
    some.frequencies_hz.push_back(all.frequencies_hz[i]);
    some.centres.push_back(all.centres[i]);
    some.radii.push_back(all.radii[i]);
  }
  return some;
}

/// An inertia of 0.05 kgm2, every half Hz.
ResponseDisks inertia(double to_hz) {
  ResponseDisks disks;
  disks.sample_time_s = kStep;
  for (double f = 0.5; f <= to_hz; f += 0.5) {
    disks.frequencies_hz.push_back(f);
    disks.centres.push_back(1.0 / std::complex(0.0, kTwoPi * f * 0.05));
    disks.radii.push_back(0.01 * std::abs(disks.centres.back()));
  }
  return disks;
}

data::TransferFunction pi_of(double kp, double ki) { return FilteredPi{kp, ki, {}}.transfer_function(kStep); }

TEST(ResponseDisks, GiveTheGoldenGains) {
  const GoldenDisks g;
  ASSERT_EQ(g.golden.at("cases").size(), 5U);
  for (const auto& c : g.golden.at("cases")) {
    const auto disks = g.of(c.at("relative_radius"));
    SCOPED_TRACE(c.at("relative_radius").dump());
    const auto alone = largest_integral_gain(disks, {}, sensitivity_only());
    const auto both = largest_integral_gain(disks, {}, test::calm(), g.load);
    ASSERT_TRUE(alone && both);
    const double golden_alone = c.at("ms_only").at("ki"), golden_both = c.at("ms_and_load").at("ki");
    EXPECT_NEAR(alone->controller.ki, golden_alone, 2e-3 * golden_alone);
    EXPECT_NEAR(both->controller.ki, golden_both, 2e-3 * golden_both);
    EXPECT_NEAR(both->controller.kp, c.at("ms_and_load").at("kp").get<double>(), 0.02 * both->controller.kp);
    for (const Peak& peak : both->worst) EXPECT_LT(peak.value, peak.bound * (1.0 + 1e-6));
    EXPECT_LT(both->largest_turn_deg, 90.0);
  }
}

/// With nothing uncertain they are the exact ones of the model, but for the lines and N.
TEST(ResponseDisks, GiveTheExactGainsWithoutUncertainty) {
  const GoldenDisks g;
  const auto golden = test::golden_json("e_tune_robust.json").at("cases")[0].at("nominal");
  const auto found = largest_integral_gain(g.of(0.0), {}, test::calm(), g.load);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->controller.ki, golden.at("ki").get<double>(), 0.01 * found->controller.ki);
  const auto figures = figures_of(
      Machine(test::golden_posterior(test::golden_json("e_tune_robust.json").at("cases")[0]).nominal()),
      found->controller);
  EXPECT_TRUE(figures.stable);
  EXPECT_NEAR(found->crossover_hz, figures.crossings.back().frequency_hz, 0.2);
}

/// Random responses on the edges of the disks, all bounds and a filter: none exceeds, and some come near.
TEST(ResponseDisks, BoundEveryResponseInThem) {
  const GoldenDisks g;
  const auto disks = g.of(0.08);
  Bounds bounds = test::calm();
  bounds.complementary = 1.25;
  bounds.controller_sensitivity = 2.6;
  bounds.disk = 1.7;
  const std::vector<Biquad> filters = {{20.0, 0.4, 0.6}};
  const auto found = largest_integral_gain(disks, filters, bounds, g.load);
  ASSERT_TRUE(found);
  ASSERT_EQ(found->worst.size(), 6U);
  const auto c = LinearController(found->controller, kStep).at(disks.frequencies_hz);
  StandardNormal normal(5);
  std::vector<double> largest(kTransfers.size(), 0.0);
  for (std::size_t i = 0; i < c.size(); ++i) {
    const std::complex<double> s(0.0, disks.frequencies_hz[i] / g.load.frequency_hz);
    const auto n = (2.0 * g.load.damping_ratio * s + 1.0) / (s * s + 2.0 * g.load.damping_ratio * s + 1.0);
    for (int draw = 0; draw < 3000; ++draw) {
      const auto plant =
          disks.centres[i] +
          disks.radii[i] * std::polar(1.0, std::arg(std::complex(normal.next(), normal.next())));
      const auto loop = c[i] * plant;
      const LoopFunctions::Values v{loop, c[i], n * plant, c[i], i + 1 == c.size() ? 1.0 / 0.9 : 0.0};
      for (const Transfer transfer : kTransfers)
        largest[static_cast<std::size_t>(transfer)] =
            std::max(largest[static_cast<std::size_t>(transfer)], v.size_of(transfer));
    }
  }
  bool active = false;
  for (const Peak& peak : found->worst) {
    const double seen = largest[static_cast<std::size_t>(peak.transfer)];
    EXPECT_LE(seen, peak.value * (1.0 + 1e-9));
    EXPECT_GT(seen, peak.value * (1.0 - 1e-4));  // the worst of a disk is reached
    EXPECT_LE(peak.value, peak.bound * (1.0 + 1e-6));
    active = active || peak.value > 0.999 * peak.bound;
  }
  EXPECT_TRUE(active);
}

TEST(ResponseDisks, HoldAllLinesAtOnce) {
  data::FrequencyResponse measured;
  for (int i = 1; i <= 20; ++i) {
    measured.frequency_hz.push_back(i);
    measured.value.emplace_back(1.0, 0.0);
    measured.std.push_back(0.01 * i);
  }
  const auto disks = response_disks(measured, 0.95, kStep);
  ASSERT_TRUE(disks);
  EXPECT_NEAR(disks->radii[2], 0.03 * std::sqrt(-std::log(0.05 / 20.0)), 1e-12);
  measured.std.clear();
  EXPECT_EQ(response_disks(measured, 0.95, kStep).error().field, "std");
}

TEST(ResponseDisks, RefuseWhatTheLinesCannotTell) {
  const GoldenDisks g;
  const auto part = [&](double from_hz, double to_hz) { return part_of(g.of(0.01), from_hz, to_hz); };
  // Whole up to the Nyquist frequency; up to where |L| is still large; from beyond the crossover.
  EXPECT_TRUE(largest_integral_gain(part(0.0, 250.0), {}, sensitivity_only()));
  const auto why = [&](const ResponseDisks& some, const Bounds& bounds) {
    const auto found = largest_integral_gain(some, {}, bounds, g.load);
    return found ? std::string() : found.error().requirement.str();
  };
  EXPECT_NE(why(part(0.0, 13.0), sensitivity_only()).find("must not end below a resonance"),
            std::string::npos);
  // Past the resonance |L| has fallen to less than half, and what lies below it is no flank.
  EXPECT_EQ(why(part(0.0, 21.0), sensitivity_only()).find("must not end below a resonance"),
            std::string::npos);
  auto reversed = part(0.0, 250.0);  // a velocity of the wrong sign
  for (auto& value : reversed.centres) value = -value;
  EXPECT_NE(why(reversed, sensitivity_only()).find("told stable"), std::string::npos);
  EXPECT_EQ(why(part(8.0, 250.0), sensitivity_only()), "must begin where |L| is above 1");
  EXPECT_EQ(largest_integral_gain(g.of(0.01), {}, test::calm()).error().field, "load_transfer");
  EXPECT_EQ(largest_integral_gain(part(0.0, 3.0), {}, sensitivity_only()).error().field, "frequencies_hz");
  EXPECT_FALSE(why(g.of(1.0), sensitivity_only()).empty());
}

/// An inertia of 0.05 kgm2 crosses at 6.4 Hz with kp = 2: where lines end at 8 Hz the gain has to be less.
TEST(ResponseDisks, KeepTheCrossoverWellInsideTheLines) {
  Bounds bounds = sensitivity_only();
  bounds.controller_sensitivity = 2.2;
  const auto whole = largest_integral_gain(inertia(40.0), {}, bounds);
  ASSERT_TRUE(whole);
  EXPECT_NEAR(whole->crossover_hz, 6.4, 0.7);
  const auto part = largest_integral_gain(inertia(8.0), {}, bounds);
  ASSERT_TRUE(part);
  // |L| of the largest response at 8 Hz is 1/2, by its closed form.
  const auto c = LinearController(part->controller, kStep).at(std::array{8.0}).front();
  EXPECT_NEAR(std::abs(c) * 1.01 / (kTwoPi * 8.0 * 0.05), 0.5, 1e-9);
  EXPECT_NEAR(part->worst.back().value, 1.0, 1e-9);
  EXPECT_EQ(part->worst.back().transfer, Transfer::beyond_band);
  EXPECT_LT(part->crossover_hz, 5.0);
  EXPECT_LT(part->controller.kp, 0.8 * whole->controller.kp);
  EXPECT_LT(whole->worst.back().value, 0.5);
}

/// System 2 has its anti-resonance at 10.7 Hz and its resonance at 15.1 Hz.
TEST(ResponseDisks, DoNotEndOnTheFlankOfAResonance) {
  const GoldenDisks g;
  auto some = g.of(0.01);
  const auto end = std::ranges::upper_bound(some.frequencies_hz, 14.0) - some.frequencies_hz.begin();
  some.frequencies_hz.resize(static_cast<std::size_t>(end));
  some.centres.resize(static_cast<std::size_t>(end));
  some.radii.resize(static_cast<std::size_t>(end));
  const auto found = largest_integral_gain(some, {}, sensitivity_only());
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().requirement,
            "must not end below a resonance, where it rises or falls as before an anti-resonance; excite "
            "beyond it");
}

/// Nor is a loop judged stable there that a design would refuse: |L| of kp = 0.6 rises to 0.35 at 14 Hz, and
/// from 0.04 at the anti-resonance. Of an inertia |L| falls, to 0.8 at 8 Hz.
TEST(ResponseDisks, TellNoStabilityWhereTheLinesEndTooEarly) {
  const GoldenDisks g;
  const auto judged = [](const ResponseDisks& disks, double kp) {
    const auto found = judged_by_response(disks, pi_of(kp, 0.5), sensitivity_only());
    EXPECT_TRUE(found);
    return found ? *found : ResponseLoop{};
  };
  const auto whole = judged(g.of(0.01), 0.6);
  EXPECT_EQ(whole.stability.tells, LinesTell::stable);
  EXPECT_NEAR(whole.crossover_hz, 1.49, 0.01);
  const auto flank = judged(part_of(g.of(0.01), 0.0, 14.0), 0.6);
  EXPECT_EQ(flank.stability.tells, LinesTell::ends_below_resonance);
  EXPECT_EQ(flank.stability.frequency_hz, 14.0);
  EXPECT_NEAR(flank.stability.value, 0.348, 0.02);
  EXPECT_EQ(flank.end.largest_loop(), 0.02);
  EXPECT_EQ(judged(part_of(g.of(0.01), 0.0, 14.0), 0.4).stability.tells, LinesTell::ends_below_resonance);

  const auto large = judged(inertia(8.0), 2.0);
  EXPECT_EQ(large.stability.tells, LinesTell::ends_large);
  EXPECT_NEAR(large.stability.value, 2.0 * 1.01 / (kTwoPi * 8.0 * 0.05), 1e-3);
  EXPECT_EQ(judged(inertia(40.0), 2.0).stability.tells, LinesTell::stable);
  // What was designed up to the limit is told stable by the same rule.
  const auto designed = largest_integral_gain(inertia(8.0), {}, sensitivity_only());
  ASSERT_TRUE(designed);
  const auto again =
      judged_by_response(inertia(8.0), designed->controller.transfer_function(kStep), sensitivity_only());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->stability.tells, LinesTell::stable);
}

/// A controller that is given as a fraction: with one, two or no integrators, of any order.
TEST(ResponseDisks, JudgeAnyController) {
  const GoldenDisks g;
  const auto disks = g.of(0.01);
  const auto tells = [&](const data::TransferFunction& controller) {
    const auto found = judged_by_response(disks, controller, sensitivity_only());
    EXPECT_TRUE(found) << found.error().requirement.str();
    return found ? found->stability.tells : LinesTell::wrong_sign;
  };
  EXPECT_EQ(tells({{0.6}, {1.0}, kStep}), LinesTell::stable);
  EXPECT_EQ(tells({{20.0}, {1.0}, kStep}), LinesTell::unstable);
  EXPECT_EQ(tells({{-0.6}, {1.0}, kStep}), LinesTell::unstable);
  EXPECT_EQ(tells(pi_of(6.0, 0.5)), LinesTell::stable);
  EXPECT_EQ(tells(pi_of(20.0, 0.5)), LinesTell::unstable);
  EXPECT_EQ(tells(Pid{0.6, 0.5, 0.002, 0.004}.transfer_function(kStep)), LinesTell::stable);
  const std::array position = {1.0 + kStep, -1.0}, sum = {1.0, -1.0};  // 1 + q
  auto twice = pi_of(0.6, 0.5);
  twice.numerator = polynomial_product(twice.numerator, position);
  twice.denominator = polynomial_product(twice.denominator, sum);
  EXPECT_EQ(tells(twice), LinesTell::stable);
  // The same in other terms is the same.
  auto scaled = pi_of(6.0, 0.5);
  for (double& term : scaled.numerator) term *= 3.0;
  for (double& term : scaled.denominator) term *= 3.0;
  EXPECT_EQ(tells(scaled), LinesTell::stable);

  // Worst cases are those that the design of the same controller tells.
  Bounds bounds = test::calm();
  bounds.complementary = 1.25;
  bounds.controller_sensitivity = 2.6;
  const std::vector<Biquad> filters = {{20.0, 0.4, 0.6}};
  const auto designed = largest_integral_gain(g.of(0.08), filters, bounds, g.load);
  ASSERT_TRUE(designed);
  const auto judged =
      judged_by_response(g.of(0.08), designed->controller.transfer_function(kStep), bounds, g.load);
  ASSERT_TRUE(judged);
  EXPECT_EQ(judged->stability.tells, LinesTell::stable);
  EXPECT_NEAR(judged->crossover_hz, designed->crossover_hz, 1e-9);
  ASSERT_EQ(judged->worst.size(), designed->worst.size());
  for (std::size_t i = 0; i + 1 < judged->worst.size(); ++i)
    EXPECT_NEAR(judged->worst[i].value, designed->worst[i].value, 1e-6);
}

TEST(ResponseDisks, KeepToControllersThatTheLinesCanTell) {
  const GoldenDisks g;
  const auto refused = [&](const data::TransferFunction& controller) {
    const auto found = judged_by_response(g.of(0.01), controller, sensitivity_only());
    EXPECT_FALSE(found);
    return found ? std::string() : found.error().field.str();
  };
  // Lines are half a Hz apart at 20 Hz: this resonance is 0.1 Hz wide to either side.
  const FilteredPi narrow{0.6, 0.5, {{20.0, 0.02, 0.005}}}, wide{0.6, 0.5, {{20.0, 0.02, 0.2}}};
  EXPECT_EQ(refused(narrow.transfer_function(kStep)), "controller");
  EXPECT_TRUE(judged_by_response(g.of(0.01), wide.transfer_function(kStep), sensitivity_only()));
  EXPECT_EQ(refused({{0.6}, {1.0, -1.1}, kStep}), "controller");
  EXPECT_EQ(refused({{0.6}, {1.0, 0.0, 1.0}, kStep}), "controller");  // on the circle, no integrator

  // A resonance of the controller above the last line counts there: |L| is 0.16 at 20 Hz.
  const FilteredPi plain{1.0, 0.5, {}}, resonant{1.0, 0.5, {{100.0, 0.5, 0.01}}};
  const auto tells = [](const FilteredPi& controller) {
    const auto found =
        judged_by_response(inertia(20.0), controller.transfer_function(kStep), sensitivity_only());
    EXPECT_TRUE(found);
    return found ? found->stability.tells : LinesTell::wrong_sign;
  };
  EXPECT_EQ(tells(plain), LinesTell::stable);
  EXPECT_EQ(tells(resonant), LinesTell::ends_large);
}

TEST(ControllerByLines, TellsWhatStandsOutsideThem) {
  const auto lines_hz = inertia(20.0).frequencies_hz;
  const auto pi = controller_by_lines(FilteredPi{1.0, 0.5, {}}.transfer_function(kStep), lines_hz);
  ASSERT_TRUE(pi);
  EXPECT_EQ(pi->integrators, 1);
  EXPECT_FALSE(pi->grows);
  const auto p = controller_by_lines({{0.6}, {1.0}, kStep}, lines_hz);
  ASSERT_TRUE(p);
  EXPECT_EQ(p->integrators, 0);
  EXPECT_NEAR(p->largest_beyond, 0.6, 1e-12);
  // 1.1 - z^-1 is 2.1 at half the rate.
  const auto lead = controller_by_lines({{1.1, -1.0}, {1.0}, kStep}, lines_hz);
  ASSERT_TRUE(lead);
  EXPECT_NEAR(lead->largest_beyond, 2.1, 1e-12);
  EXPECT_TRUE(lead->grows);
}

/// 1 + z^-1 is 0 at half the rate, where the lines end: nothing stands beyond.
TEST(ResponseDisks, JudgeANotchAtHalfTheRate) {
  for (const double to_hz : {245.0, 250.0}) {
    const auto found = judged_by_response(inertia(to_hz), {{1.0, 1.0}, {1.0}, kStep}, sensitivity_only());
    ASSERT_TRUE(found) << to_hz;
    EXPECT_EQ(found->stability.tells, LinesTell::stable) << to_hz;
    for (const Peak& peak : found->worst) EXPECT_TRUE(std::isfinite(peak.value)) << to_hz;
  }
}

/// A zero on the last line hides what the controller does above it: 10 (2 + 2 cos w) at half the rate.
TEST(ResponseDisks, JudgeAZeroAtTheLastLineByWhatIsBeyond) {
  const double cosine = std::cos(kTwoPi * 20.0 * kStep);
  const auto found =
      judged_by_response(inertia(20.0), {{10.0, -20.0 * cosine, 10.0}, {1.0}, kStep}, sensitivity_only());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->stability.tells, LinesTell::ends_large);
  EXPECT_NEAR(found->stability.value, 20.0 * (1.0 + cosine) * 1.01 / (kTwoPi * 20.0 * 0.05),
              1e-2 * found->stability.value);
}

/// |G| at lines 2 % apart from 1 to 20 Hz, each to a part of it.
template <class Size>
MachineEnd end_of(Size&& size, double part = 0.0) {
  std::vector<double> f, sizes, radii;
  for (double hz = 1.0; hz <= 20.0; hz *= 1.02) {
    f.push_back(hz);
    sizes.push_back(size(hz));
    radii.push_back(part * sizes.back());
  }
  return machine_end(f, sizes, radii, kStep);
}

TEST(MachineEnd, IsThatOfAnInertia) {
  const auto end = end_of([](double f) { return 1.0 / f; }, 0.1);
  EXPECT_FALSE(end.is_below_resonance() || end.is_whole);
  EXPECT_NEAR(end.size, 1.1 / 20.0, 0.02 * end.size);
  EXPECT_EQ(end.largest_loop(), 0.5);
  EXPECT_FALSE(ends_too_large(end, 0.499 / end.size));
  EXPECT_TRUE(ends_too_large(end, 0.51 / end.size));
  EXPECT_TRUE(ends_too_large(end, std::nan("")));
}

/// With an anti-resonance at fa, and without damping, |1 - (f/fa)^2|/|1 - (f/fr)^2| of an inertia.
TEST(MachineEnd, TellsWhichSideOfAResonanceItIs) {
  const auto end = [](double fa, double fr) {
    return end_of([&](double f) {
      const double a = f / fa, r = f / fr;
      return std::hypot(1.0 - a * a, 0.02 * a) / std::hypot(1.0 - r * r, 0.02 * r) / f;
    });
  };
  EXPECT_TRUE(end(10.0, 25.0).rises);
  EXPECT_TRUE(end(14.0, 22.0).rises);
  EXPECT_TRUE(end(24.0, 40.0).dips);
  EXPECT_TRUE(end(20.0, 40.0).dips);
  EXPECT_EQ(end(10.0, 25.0).largest_loop(), 0.02);
  for (const double fr : {7.0, 12.0, 15.0, 18.0}) EXPECT_FALSE(end(0.6 * fr, fr).is_below_resonance()) << fr;
  // Far below nothing tells of it, but the dip does not count: that of an inertia is larger.
  EXPECT_FALSE(end(40.0, 80.0).is_below_resonance());
  EXPECT_GE(end(40.0, 80.0).size, 0.98 / 20.0);
}

/// A lag of 100 or 10 Hz is no dip, friction no rise, noise neither.
TEST(MachineEnd, TakesNoLagAndNoNoiseForAResonance) {
  for (const double corner_hz : {10.0, 100.0})
    EXPECT_FALSE(
        end_of([&](double f) { return 1.0 / f / std::hypot(1.0, f / corner_hz); }).is_below_resonance());
  EXPECT_FALSE(end_of([](double f) { return 1.0 / std::hypot(f, 2.0); }).is_below_resonance());
  constexpr double kDeviation = 0.1, kTimes = 3.0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const auto end = end_of(
        [&](double hz) {
          return std::hypot(1.0 + kDeviation * normal(random), kDeviation * normal(random)) / hz;
        },
        kTimes * kDeviation);
    EXPECT_FALSE(end.is_below_resonance()) << seed;
  }
}

/// Beyond one resonance lines may end before the next; friction lets w rise too, which is no peak.
TEST(MachineEnd, TellsTheNextResonanceAndFriction) {
  const auto pair = [](double f, double fa, double fr) {
    const double a = f / fa, r = f / fr;
    return std::hypot(1.0 - a * a, 0.02 * a) / std::hypot(1.0 - r * r, 0.02 * r);
  };
  const auto two = [&](double fa2, double fr2) {
    return end_of([&](double f) { return pair(f, 6.0, 8.0) * pair(f, fa2, fr2) / f; });
  };
  EXPECT_TRUE(two(20.0, 25.0).dips);
  EXPECT_GT(two(20.0, 25.0).size, 0.9 / 20.0);
  EXPECT_TRUE(two(16.0, 23.0).rises);
  EXPECT_FALSE(two(9.0, 12.0).is_below_resonance());
  EXPECT_FALSE(two(60.0, 80.0).is_below_resonance());
  const auto rubbing = [&](double corner_hz) {
    return end_of([&](double f) { return pair(f, 21.0, 30.0) / std::hypot(f, corner_hz); });
  };
  for (const double corner_hz : {1.0, 5.0, 8.0}) EXPECT_TRUE(rubbing(corner_hz).dips) << corner_hz;
}

/// By differences an inertia's is |cos(pi f Ts)| less, 0.05 at the last of these lines.
TEST(MachineEnd, TakesNoVelocityByDifferencesForADip) {
  for (const double to_hz : {120.0, 170.0, 200.0, 236.0}) {
    std::vector<double> f, sizes;
    for (double hz = 1.0; hz <= to_hz; hz += 1.0) {
      f.push_back(hz);
      sizes.push_back(1.0 / (2.0 * std::tan(kPi * hz * kStep)));
    }
    EXPECT_FALSE(machine_end(f, sizes, std::vector<double>(f.size(), 0.0), kStep).is_below_resonance())
        << to_hz;
  }
}

TEST(MachineEnd, AsksForLinesInTheLastOctave) {
  const std::vector<double> f = {1.0, 2.0, 4.0, 6.0, 8.0}, sizes = {1.0, 0.5, 0.25, 1.0 / 6.0, 0.125};
  const auto end = machine_end(f, sizes, std::vector<double>(5, 0.0), kStep);
  EXPECT_TRUE(end.is_sparse && end.is_below_resonance());
  EXPECT_FALSE(end.rises || end.dips);
}

/// Two masses whose lines end anywhere from the anti-resonance to beyond the resonance: by the poles of the
/// loop none is unstable that is told stable.
TEST(ResponseDisks, TellNoUnstableLoopStableAroundAResonance) {
  constexpr double kInertia = 0.05, kAntiResonance_hz = 30.0;
  int stable = 0, unstable = 0;
  for (const double ratio : {0.7, 2.0, 5.0})
    for (const double damping : {0.01, 0.04})
      for (const double end : {0.9, 1.0, 1.15, 1.3, 1.6, 2.0, 2.4, 3.0}) {
        const double load = kInertia * ratio / (1.0 + ratio), w = kTwoPi * kAntiResonance_hz;
        const auto machine = test::golden_machine(
            {kInertia - load, load, load * w * w, 2.0 * damping * load * w}, kStep, 2.0 * kStep);
        ResponseDisks disks;
        disks.sample_time_s = kStep;
        for (double f = 0.5; f <= end * kAntiResonance_hz; f += 0.25) disks.frequencies_hz.push_back(f);
        for (const auto& value : machine.response().at(disks.frequencies_hz)) {
          disks.centres.push_back(value.measured);
          disks.radii.push_back(0.02 * std::abs(value.measured));
        }
        for (const double at_end : {0.01, 0.05, 0.1, 0.2, 0.3, 0.45}) {
          const double kp = at_end / std::abs(disks.centres.back());
          const FilteredPi controller{kp, kp / 0.3, {}};
          const auto found =
              judged_by_response(disks, controller.transfer_function(kStep), sensitivity_only());
          if (!found) continue;
          const bool is_stable = closed_loop(machine.states(), states_of(controller, kStep)).is_stable();
          const bool told = found->stability.tells == LinesTell::stable;
          EXPECT_FALSE(told && !is_stable) << ratio << " " << damping << " " << end << " " << at_end;
          stable += told ? 1 : 0;
          unstable += is_stable ? 0 : 1;
        }
      }
  EXPECT_GT(stable, 20);
  EXPECT_GT(unstable, 50);
}

/// Lines much farther apart than a resonance is wide, from below the anti-resonance to well above.
TEST(ResponseDisks, TellNoUnstableLoopStableWhereAResonanceStandsBetweenLines) {
  constexpr double kInertia = 0.05, kAntiResonance_hz = 30.0;
  int stable = 0, unstable = 0;
  for (const double ratio : {0.7, 2.0, 5.0})
    for (const double damping : {0.001, 0.003, 0.01})
      for (const double per_line : {1.03, 1.06, 1.1, 1.15, 1.17}) {
        const double load = kInertia * ratio / (1.0 + ratio), w = kTwoPi * kAntiResonance_hz;
        const auto machine = test::golden_machine(
            {kInertia - load, load, load * w * w, 2.0 * damping * load * w}, kStep, 2.0 * kStep);
        ResponseDisks disks;
        disks.sample_time_s = kStep;
        disks.known_delay_s = 2.0 * kStep;
        for (double f = 0.5; f <= 220.0; f *= per_line) disks.frequencies_hz.push_back(f);
        for (const auto& value : machine.response().at(disks.frequencies_hz)) {
          disks.centres.push_back(value.measured);
          disks.radii.push_back(0.003 * std::abs(value.measured));
        }
        SCOPED_TRACE(testing::Message() << ratio << " " << damping << " " << per_line);
        const auto design = damping == 0.003 && ratio < 5.0
                                ? std::optional(largest_integral_gain(disks, {}, sensitivity_only()))
                                : std::nullopt;
        if (design && *design) {
          EXPECT_TRUE(closed_loop(machine.states(), states_of((*design)->controller, kStep)).is_stable());
          ++stable;
        }
        for (const double gain : {0.3, 0.5, 0.8, 1.2, 2.0, 4.0}) {  // crossover over anti-resonance, roughly
          const double kp = gain * w * kInertia;
          const FilteredPi controller{kp, kp / 0.3, {}};
          const auto found =
              judged_by_response(disks, controller.transfer_function(kStep), sensitivity_only());
          if (!found) continue;
          const bool is_stable = closed_loop(machine.states(), states_of(controller, kStep)).is_stable();
          EXPECT_FALSE(found->stability.tells == LinesTell::stable && !is_stable) << gain;
          unstable += is_stable ? 0 : 1;
        }
      }
  EXPECT_GE(stable, 4);
  EXPECT_GT(unstable, 50);
}

/// Sums of many coefficients near 1 leave little at standstill: what is little of a filter's is no zero.
TEST(ControllerByLines, TellsAnIntegratorBehindSlowFilters) {
  std::vector<double> lines;
  for (double f = 0.1; f < 5.0; f += 0.1) lines.push_back(f);
  const Biquad slow{1.0, 0.8, 0.9}, slower{0.5, 0.8, 0.9};
  for (const double ki : {0.0, 10.0}) {
    const FilteredPi two{1.5, ki, {slow, slower}};
    const auto found = controller_by_lines(two.transfer_function(kStep), lines);
    ASSERT_TRUE(found) << ki << ": " << found.error().requirement.str();
    EXPECT_EQ(found->integrators, ki > 0.0 ? 1 : 0);
  }
}

/// Between the last line and half of the rate the controller may resonate, as by a pole near -1; and one
/// without a gain at standstill lets any load run away.
TEST(ResponseDisks, LookAtTheControllerUpToHalfTheRate) {
  const auto tells = [](const data::TransferFunction& controller) {
    return judged_by_response(inertia(238.0), controller, sensitivity_only());
  };
  const auto calm = tells({{0.5 * 1.9}, {1.0, 0.9}, kStep}), loud = tells({{0.8 * 1.99}, {1.0, 0.99}, kStep});
  ASSERT_TRUE(calm && loud);
  EXPECT_EQ(calm->stability.tells, LinesTell::stable);
  EXPECT_EQ(loud->stability.tells, LinesTell::ends_large);
  const auto high_pass = tells({{1.0, -1.0}, {1.0, -0.99874415}, kStep});
  ASSERT_FALSE(high_pass);
  EXPECT_EQ(high_pass.error().field, "controller");
}

/// Roots far apart in size, close by, and one where the sign stays.
TEST(FirstSignChange, MissesNoPairOfRoots) {
  EXPECT_EQ(first_sign_change(std::array{1.0, 0.0, 1.0}), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(first_sign_change(std::array{6.0, -5.0, 1.0}), 2.0, 1e-14);
  EXPECT_NEAR(first_sign_change(std::array{6e12, -5e6, 1.0}), 2e6, 1e-8);
  const double near = 1.0 + 1e-6;  // (x - 1)(x - near)(x^2 + 1)
  const double b = -(1.0 + near);
  EXPECT_NEAR(first_sign_change(std::array{near, b, near + 1.0, b, 1.0}), 1.0, 1e-8);
  EXPECT_EQ(first_sign_change(std::array{1.0, -2.0, 1.0}),
            std::numeric_limits<double>::infinity());  // touches
}

}  // namespace
}  // namespace resonid::design
