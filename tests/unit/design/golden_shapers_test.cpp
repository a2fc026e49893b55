// SPDX-License-Identifier: MIT
// Input shapers against an independent implementation (tests/golden/e_tune_structures.json, "shapers").
#include <gtest/gtest.h>

#include <cmath>
#include <golden.hpp>
#include <numeric>
#include <resonid/design/detail/bounds.hpp>

#include "design/normal.hpp"
#include "design/shaper_choice.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

nlohmann::json golden_shapers() { return test::golden_json("e_tune_structures.json").at("shapers"); }

void expect_impulses(const Shaper& shaper, const nlohmann::json& golden) {
  ASSERT_EQ(shaper.amplitudes.size(), golden.at("amplitude").size());
  for (std::size_t i = 0; i < shaper.amplitudes.size(); ++i) {
    EXPECT_NEAR(shaper.amplitudes[i], golden.at("amplitude")[i].get<double>(), 1e-9);
    EXPECT_NEAR(shaper.times_s[i], golden.at("time_s")[i].get<double>(), 1e-9);
  }
}

/// Frequency and damping as they are drawn there: normal, the damping in its logarithm.
std::vector<ModesOfDraw> drawn(const ShapedMode& mode, double f_std, double zeta_std) {
  StandardNormal normal(5);
  std::vector<ModesOfDraw> draws(20000);
  for (auto& modes : draws) {
    const double f = mode.frequency_hz * (1.0 + f_std * normal.next());
    modes = {{f, mode.damping_ratio * std::exp(zeta_std * normal.next())}};
  }
  return draws;
}

TEST(GoldenShapers, ImpulsesVibrationAndBands) {
  const auto golden = golden_shapers().at("cases");
  ASSERT_EQ(golden.size(), 15U);
  for (const auto& c : golden) {
    SCOPED_TRACE(c.at("shaper").dump() + " at " + c.at("f").dump());
    const ShapedMode mode{c.at("f"), c.at("zeta")};
    const auto kind = from_name<ShaperKind>(c.at("shaper").get<std::string>());
    ASSERT_TRUE(kind);
    const Shaper shaper = shaper_for(*kind, mode).value();
    expect_impulses(shaper, c);
    for (const auto& [factor, vibration] : c.at("vibration").items())
      EXPECT_NEAR(residual_vibration(shaper, {std::stod(factor) * mode.frequency_hz, mode.damping_ratio}),
                  vibration.get<double>(), 1e-6);
    EXPECT_NEAR(residual_vibration(shaper, {mode.frequency_hz, 0.5 * mode.damping_ratio}),
                c.at("vibration_other_damping").get<double>(), 1e-6);
    const Band band = insensitive_band(shaper, mode);
    EXPECT_NEAR(band.from_hz / mode.frequency_hz, c.at("band_5_percent")[0].get<double>(), 1e-3);
    EXPECT_NEAR(band.to_hz / mode.frequency_hz, c.at("band_5_percent")[1].get<double>(), 1e-3);
    const Shaper on_samples = sampled(shaper, 0.002);
    expect_impulses(on_samples, c.at("sampled_2ms"));
    EXPECT_NEAR(residual_vibration(on_samples, mode), c.at("sampled_2ms").at("vibration").get<double>(),
                1e-6);
    const double q95 = vibration_quantile(shaper, drawn(mode, 0.02, 0.3));
    EXPECT_NEAR(q95 / c.at("q95_f2_zeta30").get<double>(), 1.0, 0.03);
  }
}

TEST(GoldenShapers, TheShortestBelowTheLimit) {
  const auto golden = golden_shapers().at("choice");
  const ShapedMode mode{10.0, golden.at("zeta")};
  for (const auto& row : golden.at("rows")) {
    SCOPED_TRACE(row.at("f_std").dump());
    const auto choice = choose_shaper({mode}, drawn(mode, row.at("f_std"), golden.at("zeta_std"))).value();
    ASSERT_EQ(choice.candidates.size(), 5U);
    for (const auto& candidate : choice.candidates) {
      const double q95 = row.at("quantiles").at(std::string(name_of(candidate.kinds.front())));
      EXPECT_NEAR(candidate.quantile / q95, 1.0, 0.03) << name_of(candidate.kinds.front());
    }
    EXPECT_EQ(choice.chosen.has_value(), !row.at("choice").is_null());
    if (!choice.chosen) continue;
    EXPECT_EQ(name_of(choice.candidates[*choice.chosen].kinds.front()), row.at("choice").get<std::string>());
  }
}

TEST(Shapers, BandsWithoutDamping) {  // docs/methods/tune.md 11.1
  const std::array widths = {0.064, 0.104, 0.288, 0.400, 0.725};
  for (std::size_t i = 0; i < widths.size(); ++i) {
    const Band band = insensitive_band(shaper_for(kShaperKinds[i], {10.0, 0.0}).value(), {10.0, 0.0});
    EXPECT_NEAR((band.to_hz - band.from_hz) / 10.0, widths[i], 0.01) << name_of(kShaperKinds[i]);
  }
}

TEST(Shapers, TwoModesAreLeftAtRestOneAfterTheOther) {
  const ShapedMode low{10.0, 0.05}, high{27.0, 0.02};
  const Shaper both =
      convolved(shaper_for(ShaperKind::zv, low).value(), shaper_for(ShaperKind::mzv, high).value());
  EXPECT_EQ(both.amplitudes.size(), 6U);
  EXPECT_NEAR(std::accumulate(both.amplitudes.begin(), both.amplitudes.end(), 0.0), 1.0, 1e-12);
  EXPECT_LT(residual_vibration(both, low), 1e-12);
  EXPECT_LT(residual_vibration(both, high), 1e-12);
  const auto choice = choose_shaper({low, high}, {{low, high}}).value();
  EXPECT_EQ(choice.candidates.size(), 25U);
  ASSERT_TRUE(choice.chosen);
  EXPECT_EQ(choice.candidates[*choice.chosen].kinds, (std::vector{ShaperKind::zv, ShaperKind::zv}));
  EXPECT_GT(choose_shaper({low}, {{low, high}}).value().candidates.front().quantile, 0.4);
}

TEST(Shapers, OfSeveralPositionsTheWorstCounts) {
  const Shaper zv = shaper_for(ShaperKind::zv, {10.0, 0.05}).value();
  const ShapedMode near{10.1, 0.05}, far{12.0, 0.05};
  EXPECT_DOUBLE_EQ(vibration_quantile(zv, {{near, far}}), residual_vibration(zv, far));
  EXPECT_DOUBLE_EQ(vibration_quantile(zv, {{near}, {far}}, 0.5),
                   0.5 * (residual_vibration(zv, near) + residual_vibration(zv, far)));
}

TEST(Shapers, TheMiddleModeSuitsAllPositions) {
  const std::vector<ModesOfDraw> draws(9, {{10.0, 0.04}, {11.0, 0.05}, {12.0, 0.06}});
  const auto middle = middle_mode(draws);
  ASSERT_TRUE(middle);
  EXPECT_NEAR(middle->frequency_hz, std::sqrt(120.0), 1e-9);
  EXPECT_NEAR(middle->damping_ratio, 0.05, 1e-12);
  const auto worst = [&](const ShapedMode& made_for) {
    return vibration_quantile(shaper_for(ShaperKind::zvd, made_for).value(), draws);
  };
  EXPECT_LT(worst(*middle), 0.5 * worst({10.0, 0.04}));
  EXPECT_LT(worst(*middle), 0.5 * worst({12.0, 0.06}));
  EXPECT_FALSE(middle_mode({{}, {}}));
}

TEST(Shapers, RefuseWhatHasNoShaper) {
  EXPECT_EQ(shaper_for(ShaperKind::zv, {0.0, 0.1}).error().field, "frequency_hz");
  EXPECT_EQ(shaper_for(ShaperKind::zv, {10.0, 1.0}).error().field, "damping_ratio");
  EXPECT_EQ(shaper_for(ShaperKind::ei, {10.0, 0.1}, 0.0).error().field, "limit");
  EXPECT_EQ(choose_shaper({}, {{{10.0, 0.1}}}).error().field, "designed");
  EXPECT_EQ(choose_shaper({{10.0, 0.1}}, {}).error().field, "draws");
}

TEST(Shapers, ImpulsesOnSamplesStayThere) {
  const Shaper on_samples = sampled(shaper_for(ShaperKind::zv, {25.0, 0.0}).value(), 0.002);
  EXPECT_EQ(on_samples.times_s, (std::vector{0.0, 0.02}));
}

/// docs/methods/tune.md 11.3: the mode of the closed loop, neither the resonance nor the anti-resonance.
TEST(Shapers, ModeOfTheClosedLoop) {
  const auto system_2 = test::golden_machine({0.032, 0.032, 143.75, 0.3}, 0.002, 0.004);
  const auto calm = shaped_mode_of(system_2.model(), {2.112725983, 21.52729938, {}});
  ASSERT_TRUE(calm);
  EXPECT_NEAR(calm->frequency_hz, 16.3, 0.1);
  EXPECT_NEAR(calm->damping_ratio, 0.37, 0.01);
  Posterior posterior(system_2.model(), {fit::kStiffness}, Eigen::MatrixXd::Constant(1, 1, 0.01));
  const auto draws = shaped_modes(posterior, {2.112725983, 21.52729938, {}}, 200, 1);
  ASSERT_EQ(draws.size(), 200U);
  double low = 1e9, high = 0.0;
  for (const auto& modes : draws) {
    ASSERT_EQ(modes.size(), 1U);
    low = std::min(low, modes.front().frequency_hz);
    high = std::max(high, modes.front().frequency_hz);
  }
  EXPECT_LT(low, 0.95 * calm->frequency_hz);
  EXPECT_GT(high, 1.05 * calm->frequency_hz);
}

TEST(Shapers, TwoModesOfADrawAreToldApart) {
  // 20 and 47 Hz, each moving by a few per cent, the higher one not seen in every draw.
  std::vector<ModesOfDraw> draws;
  for (int i = 0; i < 200; ++i) {
    const double by = 1.0 + 0.02 * std::sin(i);
    draws.push_back({{20.0 * by, 0.05}});
    if (i % 4 != 0) draws.back().push_back({47.0 / by, 0.03});
  }
  const auto two = two_modes(draws);
  ASSERT_TRUE(two);
  const auto low = middle_mode(two->low), high = middle_mode(two->high);
  ASSERT_TRUE(low && high);
  EXPECT_NEAR(low->frequency_hz, 20.0, 0.1);
  EXPECT_NEAR(high->frequency_hz, 47.0, 0.2);
  EXPECT_NEAR(high->damping_ratio, 0.03, 1e-12);
  const auto of_one = choose_shaper({*middle_mode(draws)}, draws),
             of_two = choose_shaper({*low, *high}, draws);
  ASSERT_TRUE(of_one && of_two);
  EXPECT_FALSE(of_one->chosen);
  ASSERT_TRUE(of_two->chosen);
  EXPECT_LE(of_two->candidates[*of_two->chosen].quantile, 0.05);
  for (auto& modes : draws) modes.resize(1);
  EXPECT_FALSE(two_modes(draws));
}

TEST(Shapers, ModesComeByWhatTheLoadShows) {
  const auto machine = test::golden_machine({0.032, 0.032, 143.75, 0.3}, 0.002, 0.004);
  const FilteredPi pi{2.0, 20.0, {}};
  const auto loop = closed_loop(machine.states(), states_of(pi, machine.sample_time_s()));
  const auto modes = shown_modes(loop);
  ASSERT_GE(modes.size(), 2U);
  for (std::size_t i = 1; i < modes.size(); ++i) EXPECT_LE(modes[i].size, modes[i - 1].size);
  EXPECT_EQ(modes.front().mode.frequency_hz, shaped_mode_of(machine.model(), pi)->frequency_hz);
  // Half of every response shows half.
  const auto halves = shown_modes(loop, [](std::complex<double>) { return std::complex<double>(0.5); });
  EXPECT_NEAR(halves.front().size / modes.front().size, 0.5, 1e-12);
}

}  // namespace
}  // namespace resonid::design
