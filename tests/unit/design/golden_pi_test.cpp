// SPDX-License-Identifier: MIT
// The exact PI design and its table against an independent implementation (tests/golden/e_tune_pi.json,
// e_tune_filters.json), within the tolerances that stand in the files.
#include <gtest/gtest.h>

#include <cmath>

#include "design/figures.hpp"
#include "design/largest_gain.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

double relative(double a, double b) { return std::abs(a / b - 1.0); }

/// Where two maxima are alike, either is the largest.
void expect_peak(const LoopFunctions& loop, const LoopFigures& f, Transfer transfer,
                 const nlohmann::json& golden) {
  const Peak& p = f.peak(transfer);
  EXPECT_LT(relative(p.value, golden.at("max")), 1e-6);
  const double f_hz = golden.at("frequency_hz");
  const bool alike =
      f_hz > 0.0 && loop.at(std::array{f_hz}).front().size_of(transfer) > p.value * (1.0 - 1e-6);
  EXPECT_TRUE(alike || std::abs(p.frequency_hz - f_hz) < 2e-2 * f_hz + 1e-2)
      << static_cast<int>(transfer) << ": " << p.frequency_hz << " Hz, golden " << f_hz;
}

/// The table at the golden gains.
void expect_figures(const Machine& machine, const FilteredPi& controller, const nlohmann::json& c) {
  const auto f = figures_of(machine, controller);
  const LoopFunctions loop(machine.response(), controller, machine.sample_time_s());
  EXPECT_TRUE(f.stable);
  EXPECT_NEAR(f.spectral_radius, c.at("spectral_radius").get<double>(), 1e-6);
  expect_peak(loop, f, Transfer::sensitivity, c.at("sensitivity"));
  expect_peak(loop, f, Transfer::complementary, c.at("complementary"));
  expect_peak(loop, f, Transfer::load_transfer, c.at("load_transfer"));
  expect_peak(loop, f, Transfer::controller_sensitivity, c.at("controller_sensitivity"));
  expect_peak(loop, f, Transfer::process_sensitivity, c.at("process_sensitivity"));
  expect_peak(loop, f, Transfer::disk, c.at("s_minus_t"));
  ASSERT_EQ(f.crossings.size(), c.at("crossings").get<std::size_t>());
  EXPECT_LT(relative(f.crossings.front().frequency_hz, c.at("crossover_hz")), 1e-5);
  EXPECT_NEAR(f.crossings.front().phase_margin_deg, c.at("phase_margin_deg").get<double>(), 1e-3);
  EXPECT_NEAR(f.worst_phase_margin_deg.value(), c.at("worst_phase_margin_deg").get<double>(), 1e-3);
  EXPECT_LT(relative(f.delay_margin_s.value(), c.at("delay_margin_s")), 1e-5);
  EXPECT_EQ(f.gain_margin_db.has_value(), !c.at("gain_margin_db").is_null());
  if (f.gain_margin_db) {
    EXPECT_NEAR(*f.gain_margin_db, c.at("gain_margin_db").get<double>(), 1e-3);
  }
  EXPECT_LT(relative(f.load_bandwidth_hz.value(), c.at("load_bandwidth_hz")), 1e-5);
  EXPECT_LT(relative(f.noise_gain, c.at("noise_gain")), 1e-3);
  const auto& step = c.at("load_step");
  EXPECT_LT(relative(f.load_step.iae, step.at("iae")), 1e-5);
  EXPECT_LT(relative(f.load_step.ie, step.at("ie")), 1e-5);
  EXPECT_LT(relative(f.load_step.peak, step.at("peak")), 1e-5);
  EXPECT_NEAR(f.load_step.rebound, step.at("rebound").get<double>(), 1e-5);
  for (const auto& mode : c.at("closed_loop_modes"))
    EXPECT_TRUE(std::any_of(f.modes.begin(), f.modes.end(), [&](const ClosedLoopMode& m) {
      return relative(m.frequency_hz, mode[0]) < 1e-5 && relative(m.damping_ratio, mode[1]) < 1e-4;
    })) << mode;
}

void expect_design(const nlohmann::json& c) {
  Machines machines(test::golden_machines(c));
  const auto biquads = test::golden_biquads(c);
  const Bounds bounds = test::golden_bounds(c.at("bounds"));
  const auto found = largest_integral_gain(machines, biquads, bounds);
  ASSERT_TRUE(found);
  EXPECT_LT(relative(found->ki, c.at("ki")), 1e-6);
  const double low = c.at("kp_range")[0], high = c.at("kp_range")[1];
  EXPECT_GT(found->kp, low * (1.0 - 5e-4));
  EXPECT_LT(found->kp, high * (1.0 + 5e-4));
  EXPECT_LT(found->exceeded, 1e-9);
}

void expect_all(const char* file) {
  const auto golden = test::golden_json(file);
  ASSERT_GT(golden.at("cases").size(), 5U);
  for (const auto& c : golden.at("cases")) {
    SCOPED_TRACE(c.at("plant").dump() + " " + c.at("bounds").dump());
    expect_design(c);
    const auto machines = test::golden_machines(c);
    if (machines.size() > 1 || !c.contains("load_step")) continue;
    expect_figures(machines.front(), {c.at("kp"), c.at("ki"), test::golden_biquads(c)}, c);
  }
}

TEST(GoldenPi, GainsAndFigures) { expect_all("e_tune_pi.json"); }
TEST(GoldenPi, WithFilters) { expect_all("e_tune_filters.json"); }

}  // namespace
}  // namespace resonid::design
