// SPDX-License-Identifier: MIT
// What the running service tells of an axis.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "../io/temporary_folder.hpp"
#include "monitor/service/live_backend.hpp"

namespace resonid::monitor {
namespace {

using monitoring::AlarmId;
using monitoring::AlarmKind;
using monitoring::Phase;
using monitoring::Watched;
using web::AxisState;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr auto kStiffness = static_cast<std::size_t>(Watched::stiffness);

/// An axis at 100 Hz that is followed; its samples come as add() is called.
class LiveStatus : public ::testing::Test {
 protected:
  LiveStatus() {
    axis.columns = {"", "u", "y", ""};
    axis.spec.name = "x";
    axis.spec.sample_rate_hz = 100.0;
    axis.spec.alarms[Watched::stiffness].low = 90.0;
    axis.spec.alarms[Watched::gap].alarm.longest_shelving_s = 60.0;
    auto opened = Ring::open(folder_ / "x.ring", {"x", ring_channels(axis.columns), 100.0, 10'000});
    if (!opened) throw std::runtime_error("no ring");
    ring_ = std::move(*opened);
    intake = std::make_unique<Intake>(*ring_, axis.columns);
    live.phase = Phase::following;
    live.next_sample = 1000;
    live.newest_ns = started_ns - kSecond_ns;
    live.processed_ns = live.row_ns = live.newest_ns;
    live.row.trusted = true;
    live.row.verdict = online::AxisVerdict::trusted;
    live.row[Watched::stiffness] = {99.0, 0.1};
    live.watches[kStiffness] = true;
    live.changes[kStiffness].before = 100.0;
    live.changes[kStiffness].before_std = 0.1;
  }
  void add() {
    static constexpr std::array<std::string_view, 2> kColumns = {"u", "y"};
    const std::vector<double> values(20, 0.0);
    Arrival arrival;
    arrival.columns = kColumns;
    arrival.values = values;
    ASSERT_EQ(intake->add(arrival), Intake::Outcome::taken);
  }
  web::AxisStatus status(double after_s = 0.0) const {
    const auto rules = monitoring::AxisAlarmRules::create(axis.spec.alarms, 100.0).value();
    const auto base = intake->arrived_ns() != 0 ? intake->arrived_ns() : started_ns;
    return status_of({axis, rules, live, *intake, base + static_cast<std::int64_t>(after_s * 1e9), started_ns,
                      3.0, ring_fills, due});
  }

  InstalledAxis axis;
  LiveAxis live;
  std::unique_ptr<Intake> intake;
  bool ring_fills = false;
  AxisView::Due due;
  const std::int64_t started_ns = now_ns();

 private:
  test::TemporaryFolder folder_;
  std::unique_ptr<Ring> ring_;
};

TEST_F(LiveStatus, LimitsAreWhatTheyAreWhereverTheFigureGoes) {
  for (const double stiffness : {99.0, 101.0}) {
    live.row[Watched::stiffness].value = stiffness;
    const auto f = status().figures[kStiffness];
    EXPECT_EQ(f.low, 90.0);
    EXPECT_FALSE(std::isfinite(f.high));
    EXPECT_EQ(f.change, stiffness - 100.0);
  }
  axis.spec.alarms[Watched::stiffness].alarm.enabled = false;
  EXPECT_TRUE(std::isnan(status().figures[kStiffness].low));
}

TEST_F(LiveStatus, AMachineThatWasForgottenHasNoFigures) {
  add();
  EXPECT_EQ(status().figures[kStiffness].now.value, 99.0);
  EXPECT_TRUE(std::isfinite(status().latency_s));
  for (const auto phase : {Phase::gathering, Phase::learning, Phase::resting}) {
    live.phase = phase;
    const auto s = status(0.1);
    EXPECT_EQ(s.state, phase == Phase::resting ? AxisState::waiting : AxisState::learning);
    for (const auto& f : s.figures)
      EXPECT_FALSE(std::isfinite(f.now.value) || std::isfinite(f.baseline) || std::isfinite(f.low));
    EXPECT_FALSE(std::isfinite(s.latency_s) || std::isfinite(s.time_s) || s.trusted);
    EXPECT_EQ(s.verdict, online::AxisVerdict::not_measured);
  }
}

TEST_F(LiveStatus, LatencyIsNotKnownWhileNoSamplesCome) {
  live.stale = true;
  EXPECT_EQ(status().state, AxisState::stale);
  EXPECT_TRUE(std::isnan(status().latency_s));
  EXPECT_EQ(status().figures[kStiffness].now.value, 99.0);
}

TEST_F(LiveStatus, SilenceShowsWhileTheEngineLearns) {
  add();
  live.phase = Phase::learning;
  EXPECT_EQ(status(2.0).state, AxisState::learning);
  EXPECT_NEAR(status(2.0).age_s, 2.0, 1e-6);
  EXPECT_EQ(status(4.0).state, AxisState::stale);
  EXPECT_EQ(status(4.0).why, "no samples come");
  EXPECT_NEAR(status(4.0).age_s, 4.0, 1e-6);
  live.stale = true;  // as it was published before they came again
  EXPECT_EQ(status(1.0).state, AxisState::learning);
}

TEST_F(LiveStatus, WaitsForSamplesOnlyWhereNoneCame) {
  live = {};
  EXPECT_EQ(status(1.0).state, AxisState::waiting);
  EXPECT_EQ(status(1.0).why, "waits for the first samples");
  EXPECT_EQ(status(4.0).state, AxisState::stale);
  add();
  EXPECT_EQ(status(1.0).state, AxisState::learning);  // whatever the engine has published
  EXPECT_EQ(status(1.0).why, "learns what the machine is");
  live.phase = Phase::learning;
  EXPECT_EQ(status(1.0).why, "learns what the machine is");
  live.waits_to_learn = true;
  EXPECT_NE(status(1.0).why.find("waits for its turn to learn"), std::string::npos);
}

TEST_F(LiveStatus, WhatIsFromBeforeARestartIsToldSo) {
  live.stale = true;
  live.row.sample = 900;
  live.newest_ns = live.processed_ns = live.row_ns = started_ns;  // taken in anew, as if they came now
  const auto unknown = status(4.0);
  EXPECT_EQ(unknown.why.find("no samples have come since the service started at 20"), 0U);
  EXPECT_NE(unknown.why.find("; what is known is from before"), std::string::npos);
  EXPECT_TRUE(std::isnan(unknown.age_s) && std::isnan(unknown.time_s));
  due = {1000, started_ns - 7200 * kSecond_ns};
  EXPECT_NEAR(status(4.0).age_s, 7204.0, 1e-3);
  EXPECT_NEAR(status(4.0).time_s, static_cast<double>(started_ns) * 1e-9 - 7201.0, 1e-3);
  live.row_ns = 0;  // nothing was left to be taken in
  EXPECT_NEAR(status(4.0).time_s, static_cast<double>(started_ns) * 1e-9 - 7201.0, 1e-3);
  live.stale = false;  // not yet
  EXPECT_TRUE(std::isnan(status(1.0).latency_s));
  live.phase = Phase::learning;
  EXPECT_EQ(status(4.0).why, unknown.why);
}

TEST_F(LiveStatus, SamplesThatComeAgainEndTheSilenceBeforeTheEngineHasItsTurn) {
  live.stale = true;
  EXPECT_EQ(status(1.0).state, AxisState::stale);
  add();
  const auto s = status(0.5);
  EXPECT_EQ(s.state, AxisState::following);
  EXPECT_FALSE(s.trusted);
  EXPECT_NE(s.why.find("samples come again"), std::string::npos);
  EXPECT_NEAR(s.age_s, 0.5, 1e-6);
  EXPECT_EQ(status(4.0).state, AxisState::stale);
  EXPECT_EQ(status(4.0).why, "no samples come");
}

TEST_F(LiveStatus, ASourceThatWaitsForRoomIsNotSilent) {
  add();
  live.phase = Phase::learning;
  live.waits_to_learn = ring_fills = true;
  EXPECT_EQ(status(10.0).state, AxisState::learning);
  EXPECT_NE(status(10.0).why.find("waits for its turn to learn"), std::string::npos);
  ring_fills = false;
  EXPECT_EQ(status(10.0).state, AxisState::stale);
}

TEST_F(LiveStatus, EachAlarmHasALongestShelvingOfItsOwn) {
  const auto rules = monitoring::AxisAlarmRules::create(axis.spec.alarms, 100.0).value();
  const double gap_s = longest_shelving_s(rules, {AlarmKind::change, Watched::gap}),
               stiffness_s = longest_shelving_s(rules, {AlarmKind::change, Watched::stiffness});
  EXPECT_EQ(gap_s, 60.0);
  EXPECT_EQ(stiffness_s, 604'800.0);
  const auto refused = [](double longest_s) {
    return refusal_of(monitoring::ActionKind::shelve, {}, 3600.0, longest_s).has_value();
  };
  EXPECT_TRUE(refused(gap_s));
  EXPECT_FALSE(refused(stiffness_s));
}

TEST_F(LiveStatus, DetectorsAreThoseThatWatch) {
  EXPECT_EQ(detectors_of(axis.spec, live).count, 0U);
  live.detector_interval_s = 1.1e7;
  axis.spec.alarms[Watched::gap].changes = false;
  axis.spec.alarms[Watched::damping].alarm.enabled = false;
  const auto detectors = detectors_of(axis.spec, live);
  EXPECT_EQ(detectors.count, monitoring::kWatched - 2);
  EXPECT_EQ(detectors.false_alarm_interval_s, 1.1e7);
  EXPECT_DOUBLE_EQ(monitoring::installation_interval_s(std::array{detectors, monitoring::Detectors{}}),
                   1.1e7 / 9.0);
}

}  // namespace
}  // namespace resonid::monitor
