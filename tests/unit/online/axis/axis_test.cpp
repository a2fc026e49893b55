// SPDX-License-Identifier: MIT
// What an axis says of a simulated closed loop, against the truth of that loop.
#include <gtest/gtest.h>

#include <cmath>
#include <resonid/online/axis.hpp>
#include <string>

#include "axis_loop_run.hpp"

namespace resonid::test {
namespace {

using online::Axis;
using online::AxisConfig;
using online::AxisMethod;
using online::AxisRow;
using online::AxisVerdict;

constexpr double kNoise = 0.005;  // output rms 0.3

struct Expected {
  AxisMethod method;
  double resonance = 0.01, antiresonance = 0.01;  // relative
  double crossover = 0.02, phase_margin_deg = 1.5, modulus_margin = 0.03;
};

class EveryMethod : public testing::TestWithParam<Expected> {};

TEST_P(EveryMethod, FindsTheBeltAndItsLoop) {
  const BeltTold told;
  const Expected e = GetParam();
  const auto axis = make_axis(told.config(e.method));
  BeltLoop loop(kNoise);
  std::size_t rows = 0;
  for (const auto& s : loop.run(7500)) rows += axis->step(s) ? 1 : 0;
  EXPECT_EQ(rows, 750U);
  const AxisRow& row = axis->row();
  EXPECT_EQ(row.verdict, AxisVerdict::trusted) << name_of(row.verdict) << ' ' << row.uncertainty;
  EXPECT_NEAR(row.resonance_hz.value, loop.resonance_hz(), e.resonance * loop.resonance_hz());
  EXPECT_NEAR(row.antiresonance_hz.value, loop.antiresonance_hz(), e.antiresonance * loop.antiresonance_hz());
  EXPECT_GT(row.resonance_hz.std, 0.0);
  const auto truth = loop.margins();
  EXPECT_NEAR(row.crossover_hz.value, truth.crossover_hz, e.crossover * truth.crossover_hz);
  EXPECT_NEAR(row.phase_margin_deg.value, truth.phase_margin_deg, e.phase_margin_deg);
  EXPECT_NEAR(row.modulus_margin.value, truth.modulus_margin, e.modulus_margin);
  EXPECT_FALSE(row.controller_differs);
  EXPECT_FALSE(axis->parameter_name(0).empty() && axis->lines() == 0);
  EXPECT_NEAR(row.stiffness, 233.0, 10.0);
}

INSTANTIATE_TEST_SUITE_P(
    , EveryMethod,
    testing::Values(Expected{AxisMethod::arx, 0.05, 0.05, 0.1, 6.0, 0.1}, Expected{AxisMethod::output_error},
                    Expected{AxisMethod::prediction_error}, Expected{AxisMethod::closed_loop},
                    Expected{AxisMethod::filtered_closed_loop}, Expected{AxisMethod::damped_closed_loop},
                    Expected{AxisMethod::instrumental_variables}, Expected{AxisMethod::physical},
                    Expected{AxisMethod::lines}, Expected{AxisMethod::sliding_dft}),
    [](const auto& test) {
      std::string name(name_of(test.param.method));
      std::erase(name, '-');
      return name;
    });

TEST(Axis, FollowsAChirpAndFindsTheResonanceThatItPassed) {
  const BeltTold told;
  AxisConfig c = told.config(AxisMethod::chirp);
  c.lines_hz = {};
  c.sweep = {5.0, 100.0, 40.0, online::Sweep::linear};
  const auto axis = make_axis(c);
  BeltLoop loop(0.1 * kNoise);
  loop.sweep = c.sweep;
  for (const auto& s : loop.run(10'000)) axis->step(s);
  const AxisRow& row = axis->row();
  EXPECT_TRUE(row.trusted);
  EXPECT_NEAR(row.resonance_hz.value, loop.resonance_hz(), 0.01 * loop.resonance_hz());
  EXPECT_NEAR(row.antiresonance_hz.value, loop.antiresonance_hz(), 0.01 * loop.antiresonance_hz());
  EXPECT_GT(row.resonance_hz.std, 0.0);
  ASSERT_EQ(axis->lines(), 1U);
  const auto line = axis->line(0);
  EXPECT_GT(line.frequency_hz, 95.0);
  EXPECT_LT(line.frequency_hz, 100.0);
  const auto there = online::response(loop.model(), line.frequency_hz, BeltLoop::kRateHz);
  EXPECT_LT(std::abs(line.response - there), 0.05 * std::abs(there));
}

TEST(Axis, TellsTheResponseAtItsLines) {
  const BeltTold told;
  const auto axis = make_axis(told.config(AxisMethod::lines));
  BeltLoop loop(0.0);
  for (const auto& s : loop.run(5000)) axis->step(s);
  ASSERT_EQ(axis->lines(), BeltLoop::kLines);
  for (std::size_t i = 0; i < axis->lines(); ++i) {
    const auto line = axis->line(i);
    const auto truth = online::response(loop.model(), line.frequency_hz, BeltLoop::kRateHz);
    EXPECT_TRUE(line.settled);
    EXPECT_LT(std::abs(line.response - truth), 1e-3 * std::abs(truth)) << line.frequency_hz;
  }
}

TEST(Axis, MeasuresTheLoopWithoutKnowingTheController) {
  const BeltTold told;
  AxisConfig c = told.config(AxisMethod::lines);
  c.controller_numerator = c.controller_denominator = {};
  c.loop = online::AxisLoop::measured;
  const auto axis = make_axis(c);
  BeltLoop loop(0.0);
  for (const auto& s : loop.run(5000)) axis->step(s);
  online::MarginScan<double> truth;  // as the lines show it
  for (const double hz : BeltLoop::lines()) truth.step(hz, loop.loop_at(hz));
  const auto& m = truth.margins();
  EXPECT_NEAR(axis->row().crossover_hz.value, m.crossover_hz, 1e-3 * m.crossover_hz);
  EXPECT_NEAR(axis->row().phase_margin_deg.value, m.phase_margin_deg, 0.1);
  EXPECT_NEAR(axis->row().modulus_margin.value, m.modulus_margin, 1e-3);
}

TEST(Axis, SaysThatTheControllerToldIsNotTheOneThatRuns) {
  BeltTold told;
  for (double& b : told.controller.numerator) b *= 1.2;
  const auto axis = make_axis(told.config(AxisMethod::physical));
  BeltLoop loop(kNoise);
  for (const auto& s : loop.run(5000)) axis->step(s);
  EXPECT_TRUE(axis->row().controller_differs);
  EXPECT_NEAR(axis->row().controller_difference, 1.0 - 1.0 / 1.2, 0.03);
}

TEST(Axis, GapIsThatOfTheStiffness) {
  const BeltTold told;
  const auto before = tooth_belt(0.5, 1.0 / BeltLoop::kRateHz);
  AxisConfig c = told.config(AxisMethod::physical);
  c.baseline_b = before.b;
  c.baseline_a = before.a;
  const auto axis = make_axis(c);
  BeltLoop loop(kNoise);
  for (const auto& s : loop.run(5000)) axis->step(s);
  double truth = 0.0;
  for (double hz = 0.2; hz < 0.49 * BeltLoop::kRateHz; hz *= 1.0003) {
    const auto w = BeltLoop::controller(hz);
    const auto a = w * online::response(loop.model(), hz, BeltLoop::kRateHz);
    const auto b = w * online::response(before, hz, BeltLoop::kRateHz);
    truth = std::max(truth, std::abs(a - b) / std::sqrt((1.0 + std::norm(a)) * (1.0 + std::norm(b))));
  }
  EXPECT_NEAR(axis->row().gap.value, truth, 0.02 * truth);
  EXPECT_GT(truth, 0.1);
}

TEST(Axis, FindsAChangeOfTheStiffness) {
  const BeltTold told;
  AxisConfig c = told.config(AxisMethod::instrumental_variables);
  c.memory_s = 0.5;
  c.row_every_samples = 25;
  c.change_of = online::AxisFigure::resonance;
  c.change = {.block_s = 1.0, .baseline_s = 60.0, .false_alarm_interval_s = 1e4};
  const auto axis = make_axis(c);
  BeltLoop before(kNoise), after(kNoise, BeltLoop::kPlace_m - 0.03, 2);
  for (const auto& s : before.run(25'000)) axis->step(s);
  EXPECT_FALSE(axis->result().changed);
  for (const auto& s : after.run(5000)) axis->step(s);
  ASSERT_TRUE(axis->result().changed);
  EXPECT_NEAR(axis->result().change.time_s, 100.0, 2.0);
  EXPECT_NEAR(axis->result().change.size, after.resonance_hz() - before.resonance_hz(), 0.05);
}

TEST(Axis, ClosesItsGates) {
  const BeltTold told;
  const auto axis = make_axis(told.config(AxisMethod::physical));
  BeltLoop loop(kNoise);
  for (const auto& s : loop.run(5000)) axis->step(s);
  ASSERT_TRUE(axis->row().trusted);
  for (int k = 0; k < 1500; ++k) axis->step({0.0, 0.0, 0.0});
  EXPECT_FALSE(axis->row().trusted);
  EXPECT_FALSE(axis->row().gates.excited);
  const auto& n = axis->result().counts;
  EXPECT_EQ(n.rows, 650U);
  EXPECT_LT(n.excited, n.ready);
  EXPECT_GT(n.all, 300U);
}

TEST(Axis, CountsMissingSamplesAndDistrustsTooMany) {
  const BeltTold told;
  const auto axis = make_axis(told.config(AxisMethod::physical));
  BeltLoop loop(kNoise);
  for (int k = 0; k < 7500; ++k) {
    auto s = loop.step();
    if (k >= 5000 && k % 7 == 0) s.output = std::numeric_limits<double>::quiet_NaN();
    axis->step(s);
    if (k == 4999) {
      EXPECT_TRUE(axis->row().trusted);
    }
  }
  EXPECT_EQ(axis->row().verdict, AxisVerdict::samples_missing);
  EXPECT_EQ(axis->result().skipped_samples, 357U);
  EXPECT_NEAR(axis->row().resonance_hz.value, loop.resonance_hz(), 0.01 * loop.resonance_hz());
}

TEST(Axis, SpreadWorkGivesTheFiguresOfTheSampleWhereItBegan) {
  const BeltTold told;
  AxisConfig c = told.config(AxisMethod::damped_closed_loop);
  const auto at_once = make_axis(c);
  c.spread_samples = 10;
  const auto spread = make_axis(c);
  c.row_every_samples = 1;
  c.spread_samples = 1;
  const auto every = make_axis(c);
  BeltLoop loop(kNoise);
  std::vector<AxisRow> rows;
  for (const auto& s : loop.run(3000)) {
    every->step(s);
    rows.push_back(every->row());
    const bool row = at_once->step(s);
    ASSERT_EQ(spread->step(s), row);
    if (row) {
      ASSERT_EQ(spread->row().sample + 9, at_once->row().sample);
    }
  }
  const AxisRow& begun = rows[spread->row().sample];
  EXPECT_EQ(spread->row().resonance_hz.value, begun.resonance_hz.value);
  EXPECT_EQ(spread->row().phase_margin_deg.value, begun.phase_margin_deg.value);
}

TEST(Axis, TakesAPosition) {
  const BeltTold told;
  AxisConfig c = told.config(AxisMethod::physical);
  c.output = online::AxisOutput::position;
  const auto axis = make_axis(c);
  BeltLoop loop(0.0);
  // The velocity at the samples, exact between them up to second order: trapezoidal rule.
  double position = 0.0, last = 0.0;
  for (int k = 0; k < 7500; ++k) {
    auto s = loop.step();
    position += 0.5 * (s.output + last) / BeltLoop::kRateHz;
    last = s.output;
    s.output = position;
    axis->step(s);
  }
  EXPECT_NEAR(axis->row().resonance_hz.value, loop.resonance_hz(), 0.01 * loop.resonance_hz());
}

TEST(Axis, RefusesWithTheNameOfItsField) {
  const BeltTold told;
  const auto field = [&](auto change, AxisMethod method) {
    AxisConfig c = told.config(method);
    change(c);
    std::vector<std::byte> memory(sizeof(Axis) + alignof(Axis));
    const auto made = Axis::create_in(memory.data(), c);
    return made ? std::string() : made.error().field.str();
  };
  using M = AxisMethod;
  const auto none = [](AxisConfig&) {};
  EXPECT_EQ(field(none, M::closed_loop), "");
  EXPECT_EQ(field([](AxisConfig& c) { c.sample_rate_hz = 0.0; }, M::lines), "sample_rate_hz");
  EXPECT_EQ(field([](AxisConfig& c) { c.row_every_samples = 0; }, M::lines), "row_every_samples");
  EXPECT_EQ(field([](AxisConfig& c) { c.spread_samples = 11; }, M::lines), "spread_samples");
  EXPECT_EQ(field([](AxisConfig& c) { c.lines_hz = {}; }, M::lines), "lines_hz");
  EXPECT_EQ(field([](AxisConfig& c) { c.window_samples = 101; }, M::sliding_dft), "lines_hz");
  EXPECT_EQ(field([](AxisConfig& c) { c.start_b = c.start_a = {}; }, M::output_error), "start_b");
  EXPECT_EQ(field([](AxisConfig& c) { c.output = online::AxisOutput::acceleration; }, M::physical), "output");
  EXPECT_EQ(field([](AxisConfig& c) { c.memory_s = 0.001; }, M::arx), "memory_s");
  EXPECT_EQ(field([](AxisConfig& c) { c.controller_numerator = {}; }, M::closed_loop),
            "controller_denominator");
  static const std::array<double, 40> long_one{1.0};
  EXPECT_EQ(field([](AxisConfig& c) { c.controller_numerator = long_one; }, M::lines),
            "controller_numerator");
  EXPECT_EQ(field([](AxisConfig& c) { c.sweep = {}; }, M::chirp), "sweep");
  EXPECT_EQ(field([](AxisConfig& c) { c.physical.stiffness.value = -1.0; }, M::physical), "stiffness");
  static const std::array<double, 3> unstable{-3.0, 3.0, -1.0};
  EXPECT_EQ(field([](AxisConfig& c) { c.start_a = unstable; }, M::instrumental_variables), "start_b");
}

/// A small one, as in firmware.
struct SmallRoom : online::AxisRoom {
  using Real = float;
  static constexpr std::size_t kInjectedLines = 0, kBaselinePoints = 0, kChangeWindow = 0;
  static constexpr bool kControllerCheck = false;
};
using SmallAxis = online::BasicAxis<SmallRoom, online::AxisLines<float, 43>, online::AxisClosedLoop<float>>;

TEST(Axis, InSinglePrecisionWithTwoEstimatorsIsSmall) {
  EXPECT_LT(sizeof(SmallAxis), 40'000U);
  BeltTold told;
  for (const auto method : {AxisMethod::lines, AxisMethod::damped_closed_loop}) {
    auto axis = SmallAxis::create(told.config(method)).value();
    BeltLoop loop(kNoise);
    for (const auto& s : loop.run(7500))
      axis.step(
          {static_cast<float>(s.excitation), static_cast<float>(s.torque), static_cast<float>(s.output)});
    EXPECT_TRUE(axis.row().trusted);
    EXPECT_NEAR(axis.row().resonance_hz.value, loop.resonance_hz(), 0.01 * loop.resonance_hz());
  }
  EXPECT_EQ(SmallAxis::create(told.config(AxisMethod::physical)).error().field, "method");
}

}  // namespace
}  // namespace resonid::test
