// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <golden.hpp>
#include <numbers>
#include <resonid/base/constants.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <resonid/fit/drive_model.hpp>

namespace resonid::diagnostics {
namespace {

data::FrequencyResponse system_2_loop(double low_hz, double high_hz, std::size_t points, double delay_s) {
  fit::DriveModel drive;
  drive.sample_time_s = 0.002;
  drive.parameters = {0.032, 0.032, 143.75, 0.3, 0.0};
  const auto controller = data::pi_controller(1.03598193204, 0.147023908851, 0.002);
  data::FrequencyResponse loop;
  for (std::size_t i = 0; i < points; ++i) {
    const double f = low_hz + (high_hz - low_hz) * static_cast<double>(i) / static_cast<double>(points - 1);
    loop.frequency_hz.push_back(f);
    loop.value.push_back(controller.response(f) * drive.response(f) * std::polar(1.0, -kTwoPi * f * delay_s));
  }
  return loop;
}

TEST(LoopMargins, GoldenNyquistValuesOfTheDelayFreeLoop) {
  const auto golden = test::golden_json("b_expected.json").at("nyquist_true");
  const auto loop = system_2_loop(1.8, 33.0, 3121, 0.0);
  const auto margins = loop_margins(loop);
  EXPECT_NEAR(*margins.crossover_hz(), golden.at("fc").get<double>(), 1e-5);
  EXPECT_NEAR(*margins.phase_margin_deg(), golden.at("Pm").get<double>(), 1e-3);
  EXPECT_NEAR(nyquist_resonance(loop).resonance_hz.value(), golden.at("fres").get<double>(), 1e-9);
  EXPECT_NEAR(nyquist_resonance(loop).antiresonance_hz.value(), golden.at("fares").get<double>(), 1e-9);
}

TEST(LoopMargins, RealLoopOfThePublishedDesign) {
  const auto margins = loop_margins(system_2_loop(0.5, 249.0, 20000, 0.004));
  EXPECT_NEAR(*margins.crossover_hz(), 2.7, 1e-4);
  EXPECT_NEAR(*margins.phase_margin_deg(), 63.5, 0.01);
  EXPECT_NEAR(margins.modulus_margin, 0.849, 0.001);  // the true minimum, at 27 Hz
  EXPECT_NEAR(margins.modulus_margin_hz, 27.0, 1.0);
  EXPECT_GT(*margins.gain_margin_db, 10.0);
}

/// L = k / (s (s+1)^2): gain margin 2/k at w = 1, by hand.
TEST(LoopMargins, GainMarginOfAThirdOrderLag) {
  data::FrequencyResponse loop;
  for (double w = 0.05; w < 20.0; w *= 1.01) {
    const std::complex<double> s(0.0, w);
    loop.frequency_hz.push_back(w / kTwoPi);
    loop.value.push_back(0.5 / (s * (s + 1.0) * (s + 1.0)));
  }
  const auto margins = loop_margins(loop);
  EXPECT_NEAR(*margins.gain_margin_db, 20.0 * std::log10(4.0), 1e-3);
  EXPECT_NEAR(*margins.gain_margin_hz * kTwoPi, 1.0, 1e-3);
}

TEST(LoopMargins, UnstableLoopHasANegativePhaseMargin) {
  data::FrequencyResponse loop;
  for (double w = 0.05; w < 20.0; w *= 1.02) {
    const std::complex<double> s(0.0, w);
    loop.frequency_hz.push_back(w / kTwoPi);
    loop.value.push_back(8.0 / (s * (s + 1.0) * (s + 1.0)));
  }
  EXPECT_LT(*loop_margins(loop).phase_margin_deg(), 0.0);
}

TEST(LoopMargins, ResonanceThatCrossesAgainIsListedAndTheWorstMarginIsKept) {
  data::FrequencyResponse loop;
  for (double w = 0.2; w < 30.0; w *= 1.002) {
    const std::complex<double> s(0.0, w);
    const auto peak = 100.0 / (s * s + 0.1 * s + 100.0);
    loop.frequency_hz.push_back(w / kTwoPi);
    loop.value.push_back(1.0 / s * peak);
  }
  const auto margins = loop_margins(loop);
  ASSERT_EQ(margins.crossovers.size(), 2U);
  EXPECT_NEAR(margins.crossovers[0].frequency_hz * kTwoPi, 1.0, 0.02);
  EXPECT_NEAR(margins.crossovers[1].frequency_hz * kTwoPi, 10.0, 0.6);
  EXPECT_LT(std::abs(*margins.worst_phase_margin_deg), 90.0);
}

TEST(LoopMargins, AbsentWhatTheBandDoesNotShow) {
  const auto margins = loop_margins(system_2_loop(5.0, 33.0, 500, 0.004));
  EXPECT_FALSE(margins.crossover_hz().has_value());
  EXPECT_FALSE(margins.phase_margin_deg().has_value());
  EXPECT_TRUE(loop_margins({}).crossovers.empty());
}

TEST(NyquistDistances, LawOfCosinesGivesThePhaseMargin) {
  const auto on_circle = std::polar(1.0, -(180.0 - 63.5) * kPi / 180.0);
  const double d2 = online::nyquist_distances(on_circle).d2;
  EXPECT_NEAR(std::acos((2.0 - d2 * d2) / 2.0) * 180.0 / kPi, 63.5, 1e-9);
}

}  // namespace
}  // namespace resonid::diagnostics
