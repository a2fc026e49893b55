// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <monitoring/alarm_text.hpp>
#include <monitoring/axis_alarms.hpp>
#include <monitoring/axis_spec.hpp>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include "changed_machine.hpp"

namespace resonid::monitoring {
namespace {

static_assert(std::is_trivially_copyable_v<AxisAlarms>);
static_assert(std::is_trivially_copyable_v<AlarmEvent>);

constexpr double kRateHz = 100.0;
constexpr AlarmId kStiffness{AlarmKind::change, Watched::stiffness},
    kStiffnessLimit{AlarmKind::limit, Watched::stiffness};
constexpr AlarmId of_kind(AlarmKind kind) { return {kind, {}}; }

/// An axis whose rows come every second, with a machine that is known exactly but for its error bars.
struct WatchedAxis {
  AxisAlarmSettings settings;
  AxisAlarms alarms;
  AlarmFacts facts;
  std::vector<AlarmEvent> events;

  WatchedAxis() {
    facts.row.gates.excited = facts.row.trusted = true;
    facts.row.verdict = online::AxisVerdict::trusted;
    facts.controller_known = true;
    look_at({});
    for (std::size_t i = 0; i < kWatched; ++i) {
      facts.changes[i].before = facts.row.figures[i].value;
      facts.changes[i].before_std = facts.row.figures[i].std;
    }
  }
  void look_at(const test::TrueMachine& machine) {
    std::mt19937_64 random(1);
    test::Tracker exact(1e-6, 1e-6, random), usual(0.5, 0.003, random);
    const auto values = exact.look_at(machine), bars = usual.look_at(machine);
    for (std::size_t i = 0; i < kWatched; ++i) facts.row.figures[i] = {values[i].value, bars[i].std};
  }
  /// So many rows, each told as "alarm transition".
  std::vector<std::string> rows(int count) {
    const auto rules = AxisAlarmRules::create(settings, kRateHz).value();
    const std::size_t before = events.size();
    for (int i = 0; i < count; ++i) {
      facts.sample += 100;
      alarms.step(rules, facts, events);
    }
    return told_since(before);
  }
  std::vector<std::string> act(ActionKind kind, AlarmId alarm = kStiffness, std::uint64_t later = 0) {
    const auto rules = AxisAlarmRules::create(settings, kRateHz).value();
    const std::size_t before = events.size();
    const auto done = alarms.act(rules, {facts.sample, kind, alarm, facts.sample + later}, events);
    if (!done) return {done.error().field.str() + " " + done.error().requirement.str()};
    return told_since(before);
  }
  [[nodiscard]] std::vector<std::string> told_since(std::size_t first) const {
    std::vector<std::string> told;
    for (std::size_t i = first; i < events.size(); ++i)
      told.push_back(fmt::format("{} {}", alarm_name(events[i].alarm), name_of(events[i].transition)));
    return told;
  }
  /// What a detector says of a figure that was another one from `time_s` on.
  void change(Watched w, double size, double std, double time_s) {
    FigureChange& c = facts.changes[static_cast<std::size_t>(w)];
    c.changed = true;
    c.change = {time_s, static_cast<double>(facts.sample) / kRateHz, size, std};
  }
  [[nodiscard]] std::string newest_text() const {
    const AlarmWords words{
        [](std::uint64_t sample) { return fmt::format("{:.0f} s", static_cast<double>(sample) / kRateHz); }};
    return alarm_text(events.back(), words);
  }
};

using Told = std::vector<std::string>;

TEST(AxisAlarms, TellABeltThatLoosens) {
  WatchedAxis axis;
  EXPECT_EQ(axis.rows(50), Told{});
  test::TrueMachine looser;
  looser.stiffness = 95.0;
  axis.look_at(looser);
  axis.rows(3);
  axis.change(Watched::stiffness, -5.0, 0.4, 50.25);
  EXPECT_EQ(axis.rows(2), Told{"stiffness raised"});
  const AlarmEvent& e = axis.events.back();
  EXPECT_EQ(e.sample, 5400U);
  EXPECT_EQ(e.since_sample, 5025U);
  EXPECT_TRUE(e.state.active);
  EXPECT_EQ(e.cause.first().cause, Cause::coupling_looser);
  EXPECT_EQ(axis.newest_text(),
            "Stiffness fell by 5.00 +- 0.40 % (100.00 -> 95.00 Nm/rad) since 50 s; likely cause: belt or "
            "coupling looser (inertias unchanged)");
  EXPECT_EQ(axis.act(ActionKind::acknowledge), Told{"stiffness acknowledged"});
  // A new baseline ends it, after the off delay.
  EXPECT_EQ(axis.act(ActionKind::set_baseline), Told{});
  axis.facts.changes[2] = {};
  EXPECT_EQ(axis.rows(10), Told{});
  EXPECT_EQ(axis.rows(2), Told{"stiffness cleared"});
  EXPECT_EQ(axis.newest_text(), "Stiffness is no longer changed: a new baseline counts");
}

TEST(AxisAlarms, TellAChangeThatGrowsOrGoesAgain) {
  WatchedAxis axis;
  axis.change(Watched::stiffness, -5.0, 0.4, 1.0);
  axis.rows(1);
  axis.act(ActionKind::acknowledge);
  axis.change(Watched::stiffness, -40.0, 0.4, 1.0);
  EXPECT_EQ(axis.rows(1), Told{});
  axis.facts.changes[2].grown = true;
  EXPECT_EQ(axis.rows(1), Told{"stiffness realarmed"});
  EXPECT_FALSE(axis.alarms[kStiffness].acknowledged);
  EXPECT_TRUE(axis.newest_text().starts_with("Stiffness fell by 40.00 +- 0.40 %"));
  EXPECT_TRUE(axis.newest_text().ends_with("; more than was told before"));
  axis.facts.changes[2] = {false, {}, 100.0, 0.4};
  EXPECT_EQ(axis.rows(12), Told{"stiffness cleared"});
  EXPECT_EQ(axis.newest_text(), "Stiffness is back at its baseline of 100.00 +- 0.40 Nm/rad");
}

TEST(AxisAlarms, FindTheCauseAlsoUnderAnotherLoadTorque) {
  WatchedAxis axis;
  test::TrueMachine looser;
  looser.stiffness = 90.0;
  axis.look_at(looser);
  const FigureChange usual = axis.facts.changes[static_cast<std::size_t>(Watched::load_torque)];
  axis.facts.row[Watched::load_torque] = {usual.before + 2.0, usual.before_std};
  axis.change(Watched::load_torque, 2.0, usual.before_std, 1.0);
  axis.change(Watched::stiffness, -10.0, 0.4, 50.0);
  EXPECT_EQ(likely_cause(shifts_of(axis.facts)).first().cause, Cause::coupling_looser);
}

TEST(AxisAlarms, StayAsTheyAreWithoutExcitation) {
  WatchedAxis axis;
  axis.settings[Watched::stiffness].low = 90.0;
  axis.change(Watched::stiffness, -5.0, 0.4, 1.0);
  axis.facts.row.gates.excited = axis.facts.row.trusted = false;
  axis.facts.row[Watched::stiffness].value = 10.0;
  EXPECT_EQ(axis.rows(100), Told{});
  axis.facts.row.gates.excited = axis.facts.row.trusted = true;
  EXPECT_EQ(axis.rows(1), (Told{"stiffness raised", "stiffness-limit raised"}));
  axis.facts.row.gates.excited = axis.facts.row.trusted = false;
  axis.facts.changes[2].changed = false;
  axis.facts.row[Watched::stiffness].value = 100.0;
  EXPECT_EQ(axis.rows(100), Told{});
  EXPECT_TRUE(axis.alarms[kStiffness].active);
}

TEST(AxisAlarms, OfFiguresAreSuppressedByBadData) {
  WatchedAxis axis;
  axis.change(Watched::stiffness, -5.0, 0.4, 1.0);
  axis.rows(1);
  axis.facts.data_fault = true;
  axis.change(Watched::resonance, -1.0, 0.1, 1.0);
  EXPECT_EQ(axis.rows(20), (Told{"data raised", "stiffness suppressed"}));
  EXPECT_EQ(axis.newest_text(), "Stiffness: suppressed by data");
  EXPECT_FALSE(axis.alarms[kStiffness].annunciated());
  EXPECT_TRUE(axis.alarms[of_kind(AlarmKind::data)].annunciated());
  axis.facts.data_fault = false;
  // While the alarm of the data waits to clear, what is raised is not told to people.
  EXPECT_EQ(axis.rows(1), Told{"resonance raised"});
  EXPECT_FALSE(axis.events.back().state.annunciated());
  EXPECT_EQ(axis.rows(10), (Told{"data cleared", "resonance unsuppressed", "stiffness unsuppressed"}));
  EXPECT_EQ(axis.newest_text(), "Stiffness: no longer suppressed, still active");
}

TEST(AxisAlarms, AreSuppressedUnderMaintenance) {
  WatchedAxis axis;
  EXPECT_EQ(axis.act(ActionKind::maintenance, {}, 2000), Told{});
  axis.facts.stale = true;
  EXPECT_EQ(axis.rows(10), Told{"stale raised"});
  EXPECT_FALSE(axis.alarms[of_kind(AlarmKind::stale)].annunciated());
  axis.facts.stale = false;
  axis.change(Watched::stiffness, -5.0, 0.4, 1.0);
  EXPECT_EQ(axis.rows(9), (Told{"stale cleared", "stiffness raised"}));
  EXPECT_EQ(axis.rows(1), (Told{"stale unsuppressed", "stiffness unsuppressed"}));
  EXPECT_TRUE(axis.alarms[kStiffness].annunciated());
  // Begun and ended early, both without a row in between.
  EXPECT_EQ(axis.act(ActionKind::maintenance, {}, 1000000),
            (Told{"stiffness suppressed", "stale suppressed"}));
  EXPECT_FALSE(axis.alarms[kStiffness].annunciated());
  EXPECT_EQ(axis.act(ActionKind::maintenance), (Told{"stiffness unsuppressed", "stale unsuppressed"}));
  EXPECT_TRUE(axis.alarms[kStiffness].annunciated());
}

TEST(AxisAlarms, StaySuppressedForAnotherReasonWhenMaintenanceEnds) {
  WatchedAxis axis;
  axis.change(Watched::stiffness, -5.0, 0.4, 1.0);
  EXPECT_EQ(axis.rows(1), Told{"stiffness raised"});
  axis.facts.learning = true;
  EXPECT_EQ(axis.rows(1), Told{"stiffness suppressed"});
  EXPECT_EQ(axis.act(ActionKind::maintenance, {}, 1000000), Told{});
  EXPECT_EQ(axis.act(ActionKind::maintenance), Told{});
  EXPECT_FALSE(axis.alarms[kStiffness].annunciated());
}

TEST(AxisAlarms, LeaveTheTimesOfSilenceToTheClock) {
  WatchedAxis axis;
  axis.settings.stale = {true, Severity::high, 1e6, 1e6, 3.0};
  axis.facts.stale = true;
  EXPECT_EQ(axis.rows(1), Told{"stale raised"});
  EXPECT_EQ(axis.rows(10), Told{});
  EXPECT_EQ(axis.act(ActionKind::remind, of_kind(AlarmKind::stale)), Told{"stale realarmed"});
  axis.act(ActionKind::acknowledge, of_kind(AlarmKind::stale));
  EXPECT_EQ(axis.act(ActionKind::remind, of_kind(AlarmKind::stale)),
            Told{"remind needs an alarm that people are to acknowledge"});
  axis.facts.stale = false;
  EXPECT_EQ(axis.rows(1), Told{"stale cleared"});
}

TEST(AxisAlarms, JudgeNoLimitsWhileLearning) {
  WatchedAxis axis;
  axis.settings[Watched::stiffness].high = 90.0;
  axis.facts.learning = true;
  EXPECT_EQ(axis.rows(20), Told{});
  axis.facts.learning = false;
  EXPECT_EQ(axis.rows(1), Told{"stiffness-limit raised"});
  axis.facts.learning = true;
  EXPECT_EQ(axis.rows(2), Told{"stiffness-limit suppressed"});
  EXPECT_EQ(axis.newest_text(), "Stiffness, limit: suppressed by learning");
}

TEST(AxisAlarms, OfLimitsHaveADeadbandOnBothSides) {
  WatchedAxis axis;
  auto& s = axis.settings[Watched::stiffness];
  s.low = 90.0;
  s.high = 110.0;
  s.deadband = 4.0;
  s.alarm.off_delay_s = 0.0;
  s.changes = false;
  axis.change(Watched::stiffness, -5.0, 0.4, 1.0);  // is no alarm then
  const auto at = [&](double value) {
    axis.facts.row[Watched::stiffness] = {value, 0.5};
    return axis.rows(1);
  };
  EXPECT_EQ(at(111.4), Told{});  // not surely
  EXPECT_EQ(at(112.0), Told{"stiffness-limit raised"});
  EXPECT_EQ(axis.newest_text(),
            "Stiffness is 112.00 +- 0.50 Nm/rad, above its limit of 110 Nm/rad since 2 s");
  EXPECT_EQ(at(110.5), Told{});
  EXPECT_EQ(at(106.5), Told{});
  EXPECT_EQ(at(106.0), Told{"stiffness-limit cleared"});
  EXPECT_EQ(
      axis.newest_text(),
      "Stiffness is back within its limits: 106.00 +- 0.50 Nm/rad; it lasted for less than 10 s: a longer "
      "on_delay_s helps");
  EXPECT_EQ(at(88.0), (Told{"stiffness-limit superseded", "stiffness-limit raised"}));
  EXPECT_EQ(axis.newest_text(), "Stiffness is 88.00 +- 0.50 Nm/rad, below its limit of 90 Nm/rad since 6 s");
  EXPECT_EQ(at(94.0), Told{"stiffness-limit cleared"});
  EXPECT_EQ(axis.alarms[kStiffnessLimit].raised_sample, 600U);
  EXPECT_FALSE(axis.alarms[kStiffness].active);
}

TEST(AxisAlarms, TellSamplesThatStopAndComeAgain) {
  WatchedAxis axis;
  axis.settings.stale.latch = true;
  axis.rows(1);
  axis.facts.row = {};
  axis.facts.stale = true;
  EXPECT_EQ(axis.rows(5), Told{"stale raised"});
  EXPECT_EQ(axis.newest_text(), "No samples since 2 s");
  EXPECT_EQ(axis.events.back().severity, Severity::high);
  axis.facts.stale = false;
  EXPECT_EQ(axis.rows(12), (Told{"stale cleared", "stale latched"}));
  EXPECT_EQ(axis.newest_text(), "No samples: stays until it is reset");
  EXPECT_EQ(axis.act(ActionKind::reset, of_kind(AlarmKind::stale)),
            Told{"reset needs an alarm that is acknowledged"});
  axis.act(ActionKind::acknowledge, of_kind(AlarmKind::stale));
  EXPECT_EQ(axis.act(ActionKind::reset, of_kind(AlarmKind::stale)), Told{"stale reset"});
}

TEST(AxisAlarms, TellEstimatesThatAreNotTrustedAlthoughExcited) {
  WatchedAxis axis;
  axis.facts.row.trusted = false;
  axis.facts.row.verdict = online::AxisVerdict::residual_grown;
  EXPECT_EQ(axis.rows(60), Told{});
  EXPECT_EQ(axis.rows(1), Told{"estimate raised"});
  EXPECT_EQ(axis.newest_text(),
            "Estimates are not valid although the drive is excited (residual grown) since 61 s");
  axis.facts.row.gates.excited = false;
  EXPECT_EQ(axis.rows(60), Told{});
  axis.facts.row.gates.excited = axis.facts.row.trusted = true;
  EXPECT_EQ(axis.rows(12), Told{"estimate cleared"});
  // Excited, and never learned.
  WatchedAxis other;
  other.facts.row = {};
  other.facts.row.verdict = online::AxisVerdict::trusted;  // when it was followed before
  other.facts.learning = other.facts.refused = true;
  EXPECT_EQ(other.rows(60), Told{});
  EXPECT_EQ(other.rows(1), Told{"estimate raised"});
  EXPECT_TRUE(other.events.back().state.annunciated());
  EXPECT_EQ(other.newest_text(), "Nothing could be learned although the drive is excited since 61 s");
  // Never excited: nothing to tell.
  WatchedAxis idle;
  idle.facts.row.trusted = idle.facts.row.gates.excited = false;
  EXPECT_EQ(idle.rows(600), Told{});
}

TEST(AxisAlarms, TellAnotherController) {
  WatchedAxis axis;
  axis.facts.controller_differs = true;
  axis.facts.controller_known = false;
  EXPECT_EQ(axis.rows(60), Told{});
  axis.facts.controller_known = true;
  EXPECT_EQ(axis.rows(11), Told{"controller raised"});
  EXPECT_EQ(axis.newest_text(), "Another controller runs than the one that was given since 71 s");
}

TEST(AxisAlarms, TellAgainAndOfShelving) {
  WatchedAxis axis;
  axis.settings[Watched::stiffness].alarm.realarm_s = 30.0;
  axis.change(Watched::stiffness, -5.0, 0.4, 1.0);
  EXPECT_EQ(axis.rows(31), (Told{"stiffness raised", "stiffness realarmed"}));
  EXPECT_TRUE(axis.newest_text().ends_with("; still not acknowledged"));
  EXPECT_EQ(axis.act(ActionKind::shelve, kStiffness, 5000), Told{"stiffness shelved"});
  EXPECT_EQ(axis.newest_text(), "Stiffness: shelved until 81 s");
  EXPECT_EQ(axis.rows(50), Told{"stiffness shelving-expired"});
  EXPECT_EQ(axis.newest_text(), "Stiffness: shelving is over, still active");
  EXPECT_EQ(axis.act(ActionKind::shelve_once), Told{"stiffness shelved"});
  EXPECT_EQ(axis.newest_text(), "Stiffness: shelved until it clears, at the latest 604881 s");
  EXPECT_EQ(axis.act(ActionKind::unshelve), Told{"stiffness unshelved"});
  EXPECT_EQ(axis.act(ActionKind::unshelve), Told{"unshelve needs an alarm that is shelved"});
}

TEST(AxisAlarms, KnowWhatChangedWhereTheRowIsNotTrusted) {
  WatchedAxis axis;
  axis.facts.row.trusted = false;
  axis.change(Watched::load_torque, 0.4, 0.01, 1.0);
  EXPECT_EQ(axis.rows(1), Told{"load-torque raised"});
  EXPECT_EQ(axis.events.back().cause.first().cause, Cause::load_torque);
  EXPECT_TRUE(
      axis.newest_text().starts_with("Load torque rose by 0.400 +- 0.010 Nm (0.500 -> 0.900 Nm) "
                                     "since 1 s; "));
}

TEST(AxisAlarms, RefuseRulesThatAreNone) {
  AxisAlarmSettings settings;
  EXPECT_EQ(AxisAlarmRules::create(settings, 0.0).error().field.view(), "sample_rate_hz");
  settings.data.realarm_s = -1.0;
  EXPECT_EQ(AxisAlarmRules::create(settings, 1.0).error().field.view(), "data.realarm_s");
  WatchedAxis axis;
  EXPECT_EQ(axis.act(ActionKind::acknowledge, {static_cast<AlarmKind>(77), {}}),
            Told{"alarm must be one of the axis"});
}

/// Anything that can be told of an axis, and what people do: events as text.
std::vector<std::string> wild_run(unsigned seed, bool through_bytes) {
  std::mt19937_64 random(seed);
  const auto chance = [&](double p) { return test::uniform(random, 0.0, 1.0) < p; };
  WatchedAxis axis;
  for (FigureAlarmSettings& s : axis.settings.figures) {
    s.alarm.latch = chance(0.5);
    s.alarm.realarm_s = 20.0;
  }
  axis.settings[Watched::phase_margin].low = 50.0;
  std::vector<std::string> told;
  for (int i = 0; i < 400; ++i) {
    axis.facts.data_fault = chance(0.05);
    axis.facts.stale = chance(0.02);
    axis.facts.learning = chance(0.05);
    axis.facts.controller_differs = chance(0.9);
    axis.facts.row.gates.excited = chance(0.9);
    axis.facts.row.trusted = axis.facts.row.gates.excited && chance(0.9);
    for (FigureChange& c : axis.facts.changes)
      if (chance(0.05)) c.changed = !c.changed;
    axis.facts.row[Watched::phase_margin].value = test::uniform(random, 48.0, 53.0);
    const auto kind = static_cast<ActionKind>(random() % 10);
    axis.act(kind, AlarmId::of(random() % kAlarms), random() % 3000);
    axis.rows(1);
    if (through_bytes) {
      std::array<std::byte, sizeof(AxisAlarms)> bytes{};
      std::memcpy(bytes.data(), &axis.alarms, bytes.size());
      axis.alarms = AxisAlarms{};
      std::memcpy(&axis.alarms, bytes.data(), bytes.size());
    }
    EXPECT_TRUE(axis.alarms.intact());
  }
  for (const AlarmEvent& e : axis.events) {
    const AlarmWords words{[](std::uint64_t sample) { return std::to_string(sample); }, seed % 2 == 0};
    const std::string text = alarm_text(e, words);
    EXPECT_FALSE(text.empty());
    EXPECT_EQ(text.find(" nan"), std::string::npos) << text;
    told.push_back(fmt::format("{} {} {} {}", e.sample, alarm_name(e.alarm), name_of(e.transition), text));
  }
  return told;
}

TEST(AxisAlarms, SayTheSameFromASnapshotOn) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const auto told = wild_run(seed, false);
    EXPECT_GT(told.size(), 200U);
    EXPECT_EQ(told, wild_run(seed, true));
    // One transition of an alarm at a sample, at most, but for what people do twice.
    std::vector<std::string> keys;
    for (const std::string& t : told)
      keys.push_back(t.substr(0, t.find(' ', t.find(' ', t.find(' ') + 1) + 1)));
    std::sort(keys.begin(), keys.end());
    EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end());
  }
}

TEST(AlarmText, SaysWhatACauseComesTo) {
  LikelyCause cause;
  EXPECT_EQ(cause_text(cause), "");
  cause.ranked[0] = {Cause::unknown, 1.0};
  EXPECT_EQ(cause_text(cause), "cause unknown");
  cause.ranked[0] = {Cause::load_torque, 0.96};
  EXPECT_EQ(cause_text(cause),
            "likely cause: another load torque: weight, brake or process force (all else unchanged)");
  cause.ranked[0] = {Cause::coupling_looser, 0.7};
  cause.ranked[1] = {Cause::load_heavier, 0.25};
  EXPECT_EQ(cause_text(cause),
            "possible cause: belt or coupling looser (inertias unchanged) or heavier load (motor inertia "
            "unchanged)");
  cause.ranked[1] = {Cause::unknown, 0.25};
  EXPECT_EQ(cause_text(cause), "possible cause: belt or coupling looser (inertias unchanged)");
}

TEST(AlarmText, TellsTheEndOfAShelvingByTheClock) {
  AlarmEvent e;
  e.alarm = {AlarmKind::stale, {}};
  e.transition = Transition::shelved;
  e.state.shelving = Shelving::timed;
  e.state.shelved_until = 600;
  AlarmWords words{[](std::uint64_t sample) { return fmt::format("sample {}", sample); }};
  words.clock = [](std::int64_t ns) { return fmt::format("{} s", ns / 1'000'000'000); };
  EXPECT_EQ(alarm_text(e, words), "No samples: shelved until sample 600");
  e.state.shelved_until_ns = 1'700'000'600'000'000'000;
  EXPECT_EQ(alarm_text(e, words), "No samples: shelved until 1700000600 s");
  e.state.shelving = Shelving::one_shot;
  EXPECT_EQ(alarm_text(e, words), "No samples: shelved until it clears, at the latest 1700000600 s");
}

TEST(AlarmText, TellsSamplesThatAreRefusedFromNone) {
  AlarmEvent e;
  e.alarm = {AlarmKind::stale, {}};
  e.transition = Transition::raised;
  AlarmWords words{[](std::uint64_t) { return std::string("noon"); }};
  EXPECT_EQ(alarm_text(e, words), "No samples since noon");
  words.refused = true;
  EXPECT_EQ(alarm_text(e, words), "No usable samples since noon: what comes is refused, its page says why");
  e.transition = Transition::acknowledged;
  EXPECT_EQ(alarm_text(e, words), "No usable samples: acknowledged");
}

TEST(AlarmText, SpeaksOfLinearAxes) {
  AlarmEvent e;
  e.alarm = {AlarmKind::change, Watched::driven_inertia};
  e.transition = Transition::raised;
  e.change = {true, {0.0, 0.0, 0.52, 0.031}, 12.0, 0.01};
  e.state.chattering = true;
  const AlarmWords words{[](std::uint64_t) { return std::string("noon"); }, true};
  EXPECT_EQ(
      alarm_text(e, words),
      "Motor mass rose by 4.33 +- 0.26 % (12.000 -> 12.520 kg) since noon; chattering, three times within "
      "a minute: a longer off_delay_s or a deadband helps");
}

TEST(AlarmText, TellsUnitsOfAnInputThatIsNoTorque) {
  AlarmEvent e;
  e.transition = Transition::raised;
  e.change = {true, {0.0, 0.0, 0.52, 0.031}, 12.0, 0.01};
  const auto told = [&](Watched figure, data::Motion motion, const std::string& input) {
    AxisSpec spec;
    spec.motion = motion;
    spec.input_unit = input;
    e.alarm = {AlarmKind::change, figure};
    const AlarmWords words{[](std::uint64_t) { return std::string("noon"); }, motion == data::Motion::linear,
                           figure_units(spec)};
    const std::string text = alarm_text(e, words);
    const auto from = text.rfind("12.520");
    return from == std::string::npos ? text : text.substr(from + 6, text.find(')', from) - from - 6);
  };
  constexpr auto kTurns = data::Motion::rotary;
  constexpr auto kSlides = data::Motion::linear;
  EXPECT_EQ(told(Watched::stiffness, kTurns, "A"), " A/rad");
  EXPECT_EQ(told(Watched::driven_inertia, kTurns, "A"), " A s2/rad");
  EXPECT_EQ(told(Watched::damping, kTurns, "A"), " A s/rad");
  EXPECT_EQ(told(Watched::coulomb_friction, kTurns, "A"), " A");
  EXPECT_EQ(told(Watched::stiffness, kTurns, "%"), " %/rad");
  EXPECT_EQ(told(Watched::load_inertia, kSlides, "A"), " A s2/m");
  EXPECT_EQ(told(Watched::resonance, kTurns, "A"), " Hz");
  EXPECT_EQ(told(Watched::gap, kTurns, "A"), "");
  EXPECT_EQ(told(Watched::stiffness, kTurns, ""), " Nm/rad");
  EXPECT_EQ(told(Watched::stiffness, kSlides, ""), " N/m");
}

}  // namespace
}  // namespace resonid::monitoring
