// SPDX-License-Identifier: MIT
// An axis is a value and a pure function of its state and the samples, whatever it estimates.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <resonid/online/axis.hpp>
#include <string>
#include <vector>

#include "allocation_counter.hpp"
#include "axis_loop_run.hpp"

namespace resonid::test {
namespace {

using online::Axis;
using online::AxisConfig;
using online::AxisMethod;
using online::AxisRow;

constexpr double kNoise = 0.005;

std::vector<AxisRow> rows_of(Axis& axis, std::span<const BeltLoop::Sample> samples) {
  std::vector<AxisRow> rows;
  axis.run(samples, [&](const AxisRow& row) { rows.push_back(row); });
  return rows;
}

void expect_same(const std::vector<AxisRow>& a, const std::vector<AxisRow>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_TRUE(same(a[i], b[i])) << i;
}

class EveryAxis : public testing::TestWithParam<AxisMethod> {
 protected:
  [[nodiscard]] AxisConfig config(std::size_t spread = 1) const {
    AxisConfig c = told_.config(GetParam());
    if (GetParam() == AxisMethod::chirp) c.sweep = kSweep;
    c.spread_samples = spread;
    return c;
  }
  [[nodiscard]] static std::vector<BeltLoop::Sample> samples(std::size_t count = 1500) {
    BeltLoop loop(kNoise);
    if (GetParam() == AxisMethod::chirp) loop.sweep = kSweep;
    return loop.run(count);
  }
  static constexpr online::SweepLaw kSweep{5.0, 100.0, 12.0, online::Sweep::linear};
  BeltTold told_;
};

TEST_P(EveryAxis, GivesTheSameRowsInWhateverPortions) {
  const auto all = samples();
  const auto whole = make_axis(config());
  const auto rows = rows_of(*whole, all);
  ASSERT_EQ(rows.size(), 150U);
  for (const std::size_t portion : {1U, 7U, 1000U}) {
    const auto axis = make_axis(config());
    std::vector<AxisRow> got;
    for (std::size_t from = 0; from < all.size(); from += portion)
      axis->run(std::span(all).subspan(from, std::min(portion, all.size() - from)),
                [&](const AxisRow& row) { got.push_back(row); });
    expect_same(rows, got);
  }
}

TEST_P(EveryAxis, ACopyOfItsBytesGoesOnBitForBit) {
  for (const std::size_t spread : {1U, 10U}) {
    const auto all = samples();
    const auto axis = make_axis(config(spread));
    const std::size_t at = 733;  // in the middle of a row's work
    rows_of(*axis, std::span(all).first(at));
    const auto other = make_axis(config(spread));
    rows_of(*other, std::span(all).subspan(100, 450));  // it held something else
    std::memcpy(static_cast<void*>(other.get()), static_cast<const void*>(axis.get()), sizeof(Axis));
    expect_same(rows_of(*axis, std::span(all).subspan(at)), rows_of(*other, std::span(all).subspan(at)));
  }
}

TEST_P(EveryAxis, ResetBeginsAnewBitForBit) {
  const auto all = samples();
  const auto axis = make_axis(config());
  const auto first = rows_of(*axis, all);
  axis->reset();
  EXPECT_EQ(axis->result().samples, 0U);
  expect_same(first, rows_of(*axis, all));
}

TEST_P(EveryAxis, TakesNoMemory) {
  const auto all = samples();
  for (const std::size_t spread : {1U, 10U}) {
    const auto axis = make_axis(config(spread));
    const std::size_t before = allocations();
    double sum = 0.0;
    for (const auto& s : all)
      if (axis->step(s)) sum += axis->row().resonance_hz.value;
    axis->miss(1000);
    axis->reset();
    EXPECT_EQ(allocations(), before) << sum;
  }
}

TEST_P(EveryAxis, LostSamplesAreThoseThatAreNotFinite) {
  const auto all = samples(3000);
  const auto missed = make_axis(config()), told = make_axis(config());
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr std::size_t kAt = 2000, kLost = 10;
  for (const auto& axis : {missed.get(), told.get()}) rows_of(*axis, std::span(all).first(kAt));
  missed->miss(kLost);
  for (std::size_t i = 0; i < kLost; ++i) told->step({kNan, kNan, kNan});
  EXPECT_EQ(missed->result().samples, told->result().samples);
  EXPECT_EQ(missed->result().skipped_samples, told->result().skipped_samples);
  const auto a = rows_of(*missed, std::span(all).subspan(kAt + kLost)),
             b = rows_of(*told, std::span(all).subspan(kAt + kLost));
  ASSERT_EQ(a.size(), b.size());
  // The row that fell into the gap was not made: a fit that goes on from the one before needs a few rows for
  // it.
  constexpr std::size_t kAlike = 10;
  const double close = GetParam() == AxisMethod::chirp ? 1e-6 : 1e-9;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].sample, b[i].sample);
    if (i < kAlike || !std::isfinite(b[i].resonance_hz.value)) continue;
    EXPECT_NEAR(a[i].resonance_hz.value, b[i].resonance_hz.value, close * b[i].resonance_hz.value) << i;
  }
}

TEST_P(EveryAxis, WhatIsNotFiniteLeavesItWhole) {
  const auto all = samples(3000);
  const auto undisturbed = make_axis(config());
  rows_of(*undisturbed, std::span(all).first(1000));
  const auto until_there = make_axis(config());
  std::memcpy(static_cast<void*>(until_there.get()), undisturbed.get(), sizeof(Axis));
  rows_of(*undisturbed, std::span(all).subspan(1000));
  const double there = undisturbed->row().resonance_hz.value;
  const auto axis = make_axis(config());
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (int which = 0; which < 3; ++which) {
      std::memcpy(static_cast<void*>(axis.get()), until_there.get(), sizeof(Axis));
      auto s = all[1000];
      (which == 0 ? s.excitation : which == 1 ? s.torque : s.output) = bad;
      axis->step(s);
      const auto rows = rows_of(*axis, std::span(all).subspan(1001));
      EXPECT_EQ(axis->result().skipped_samples, 1U);
      if (std::isfinite(there)) {
        EXPECT_NEAR(rows.back().resonance_hz.value, there, 0.01 * there) << which;
      }
    }
}

INSTANTIATE_TEST_SUITE_P(, EveryAxis,
                         testing::Values(AxisMethod::arx, AxisMethod::output_error,
                                         AxisMethod::prediction_error, AxisMethod::closed_loop,
                                         AxisMethod::filtered_closed_loop, AxisMethod::damped_closed_loop,
                                         AxisMethod::instrumental_variables, AxisMethod::physical,
                                         AxisMethod::lines, AxisMethod::sliding_dft, AxisMethod::chirp),
                         [](const auto& test) {
                           std::string name(name_of(test.param));
                           std::erase(name, '-');
                           return name;
                         });

AxisConfig injecting(const BeltTold& told) {
  AxisConfig c = told.config(AxisMethod::lines);
  c.injects = true;
  return c;
}
online::AxisInjection injection() {
  online::AxisInjection what;
  what.guard.amplitude = 0.1;
  what.guard.velocity_limit = 5.0;
  return what;
}

TEST(AxisInjects, ItsOwnExcitationAndFindsTheMachineByIt) {
  const BeltTold told;
  const auto axis = make_axis(injecting(told));
  EXPECT_EQ(axis->excite({.torque = 0.0, .velocity = 0.0}), 0.0);
  ASSERT_TRUE(axis->start(injection()));
  EXPECT_FALSE(axis->result().settled);
  const auto m = tooth_belt(BeltLoop::kPlace_m, 1.0 / BeltLoop::kRateHz);
  std::array<double, 4> u{}, v{};
  double peak = 0.0;
  for (int k = 0; k < 5000; ++k) {
    const double y = v[1], control = -0.05 * y;
    const double x = axis->excite({.torque = control, .velocity = y});
    peak = std::max(peak, std::abs(x));
    u = {control + x, u[0], u[1], u[2]};
    axis->step({x, u[0], y});
    v = {m.b[0] * u[0] + m.b[1] * u[1] + m.b[2] * u[2] - m.a[0] * v[0] - m.a[1] * v[1] - m.a[2] * v[2], v[0],
         v[1], v[2]};
    EXPECT_EQ(axis->injected(), x);
  }
  EXPECT_NEAR(peak, 0.1, 0.002);
  EXPECT_TRUE(axis->result().settled);
  EXPECT_TRUE(axis->row().trusted);
  const BeltLoop truth(0.0);
  EXPECT_NEAR(axis->row().resonance_hz.value, truth.resonance_hz(), 0.01 * truth.resonance_hz());
  // Ramping out, and after it, what was found stays.
  const AxisRow found = axis->row();
  axis->stop();
  for (int k = 0; k < 500; ++k) {
    axis->excite({.torque = 0.0, .velocity = 0.0});
    EXPECT_FALSE(axis->step({axis->injected(), 0.0, 0.0}));
  }
  EXPECT_FALSE(axis->result().injecting);
  EXPECT_TRUE(same(found, axis->row()));
}

TEST(AxisInjects, AndStopsAtALimit) {
  const BeltTold told;
  const auto axis = make_axis(injecting(told));
  ASSERT_TRUE(axis->start(injection()));
  double velocity = 0.0;
  int injected = 0;
  for (int k = 0; k < 1000; ++k, velocity += 0.01)
    if (axis->excite({.torque = 0.0, .velocity = velocity}) != 0.0) injected = k;
  EXPECT_NEAR(0.01 * injected, 0.9 * 5.0, 0.02);
  EXPECT_EQ(axis->result().stop_reason, online::StopReason::velocity);
  EXPECT_EQ(axis->row().verdict, online::AxisVerdict::stopped);
  axis->reset();
  EXPECT_EQ(axis->result().stop_reason, online::StopReason::none);
  EXPECT_TRUE(axis->start(injection()));
}

TEST(AxisInjects, OnlyWhatItWasMadeFor) {
  const BeltTold told;
  AxisConfig c = told.config(AxisMethod::lines);
  const auto silent = make_axis(c);
  EXPECT_EQ(silent->start(injection()).error().field, "kind");
  const auto axis = make_axis(injecting(told));
  auto what = injection();
  what.guard.amplitude = 0.0;
  EXPECT_EQ(axis->start(what).error().field, "amplitude");
  EXPECT_EQ(axis->excite({.torque = 0.0, .velocity = 0.0}), 0.0);
  what = injection();
  what.kind = online::AxisInjection::Kind::given;
  ASSERT_TRUE(axis->start(what));
  for (int k = 0; k < 250; ++k) axis->excite({.torque = 0.0, .velocity = 0.0}, 0.07);
  EXPECT_NEAR(axis->injected(), 0.07, 1e-12);
}

}  // namespace
}  // namespace resonid::test
