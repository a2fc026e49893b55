// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <monitoring/alarm_state.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "alarm_model.hpp"

namespace resonid::monitoring {
namespace {

using test::AlarmModel;
constexpr double kUnknownOver = std::numeric_limits<double>::quiet_NaN();

static_assert(std::is_trivially_copyable_v<Alarm>);

/// What can happen to an alarm.
enum class Happening {
  above,
  below,
  within_deadband,
  not_known,
  long_above,
  long_below,
  acknowledge,
  shelve,
  shelve_too_long,
  shelve_once,
  unshelve,
  reset,
  data_bad,
  data_good,
  suppress,
  unsuppress,
  remind,
  count
};
constexpr auto kHappenings = static_cast<int>(Happening::count);

std::vector<AlarmModel::Told> list_of(const Transitions& transitions) {
  std::vector<AlarmModel::Told> list;
  for (const auto& t : transitions) list.push_back({t.transition, t.state});
  return list;
}

bool same(const std::vector<AlarmModel::Told>& a, const std::vector<AlarmModel::Told>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.transition == y.transition && x.state == y.state;
  });
}

struct Pair {
  AlarmRules rules;
  Alarm alarm;
  AlarmModel model;
  explicit Pair(const AlarmRules& r) : rules(r), model(r) {}

  bool row(std::uint64_t later, double over) {
    const std::uint64_t sample = model.now() + later;
    return same(list_of(alarm.step(rules, sample, {over})), model.step(sample, over));
  }
  bool act(ActionKind kind, std::uint64_t later = 0) {
    const std::uint64_t now = model.now();
    const auto by_alarm = alarm.act(rules, {now, kind, {}, now + later});
    const auto by_model = model.act(kind, now + later);
    if (by_alarm.has_value() != by_model.has_value()) return false;
    return !by_alarm || same(list_of(*by_alarm), *by_model);
  }
  bool data(bool bad) {
    return same(list_of(alarm.suppress(model.now(), Suppression::data, bad)),
                model.suppress(Suppression::data, bad));
  }
  /// Whether both said the same and stand the same, and what holds always holds.
  bool happens(Happening what) {
    const bool agreed = [&] {
      switch (what) {
        case Happening::above:
          return row(1, 2.0);
        case Happening::below:
          return row(1, -2.0);
        case Happening::within_deadband:
          return row(1, -0.5);
        case Happening::not_known:
          return row(1, kUnknownOver);
        case Happening::long_above:
          return row(5, 0.1);
        case Happening::long_below:
          return row(5, -1.0);
        case Happening::acknowledge:
          return act(ActionKind::acknowledge);
        case Happening::shelve:
          return act(ActionKind::shelve, 3);
        case Happening::shelve_too_long:
          return act(ActionKind::shelve, 1000);
        case Happening::shelve_once:
          return act(ActionKind::shelve_once);
        case Happening::unshelve:
          return act(ActionKind::unshelve);
        case Happening::reset:
          return act(ActionKind::reset);
        case Happening::data_bad:
          return data(true);
        case Happening::data_good:
          return data(false);
        case Happening::suppress:
          return act(ActionKind::suppress);
        case Happening::unsuppress:
          return act(ActionKind::unsuppress);
        case Happening::remind:
          return act(ActionKind::remind);
        case Happening::count:
          break;
      }
      return false;
    }();
    const AlarmState& s = alarm.state();
    return agreed && s == model.state() && alarm.intact() && !(s.active && s.latched) &&
           (s.shelving == Shelving::none) == (s.shelved_until == 0) && (rules.latch || !s.latched);
  }
};

AlarmRules rules_with(std::uint64_t on, std::uint64_t off, double deadband, std::uint64_t realarm,
                      bool latch) {
  AlarmRules r;
  r.on_delay = on;
  r.off_delay = off;
  r.deadband = deadband;
  r.realarm = realarm;
  r.latch = latch;
  r.longest_shelving = 6;
  r.chattering = 12;
  r.fleeting = 3;
  return r;
}

std::string words_of(const std::vector<Happening>& path) {
  std::string text;
  for (const auto h : path) text += std::to_string(static_cast<int>(h)) + " ";
  return text;
}

/// Everything that can happen in so many steps from here.
void explore(const Pair& from, int depth, std::vector<Happening>& path, std::size_t& visited) {
  for (int h = 0; h < kHappenings; ++h) {
    Pair next = from;
    path.push_back(static_cast<Happening>(h));
    ++visited;
    ASSERT_TRUE(next.happens(static_cast<Happening>(h))) << words_of(path);
    if (depth > 1) explore(next, depth - 1, path, visited);
    if (testing::Test::HasFatalFailure()) return;
    path.pop_back();
  }
}

TEST(AlarmState, DoesWhatItsDefinitionSaysInEverySequence) {
  for (const auto& rules : {rules_with(0, 0, 0.0, 0, false), rules_with(1, 2, 1.0, 2, true)}) {
    std::size_t visited = 0;
    std::vector<Happening> path;
    explore(Pair(rules), 5, path, visited);
    EXPECT_EQ(visited, 17U + 289U + 4913U + 83521U + 1419857U);
    // From a raised alarm, and from one that is latched.
    Pair raised(rules);
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(raised.happens(Happening::above));
    ASSERT_TRUE(raised.alarm.state().active);
    explore(raised, 4, path, visited);
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(raised.happens(Happening::below));
    ASSERT_FALSE(raised.alarm.state().active);
    explore(raised, 4, path, visited);
  }
}

RC_GTEST_PROP(AlarmState, DoesWhatItsDefinitionSaysOnLongWalks, ()) {
  const auto small = [] { return *rc::gen::inRange<std::uint64_t>(0, 8); };
  AlarmRules rules = rules_with(small(), small(), static_cast<double>(*rc::gen::inRange(0, 3)) * 0.5, small(),
                                *rc::gen::arbitrary<bool>());
  rules.longest_shelving = 1 + small();
  const auto walk = *rc::gen::container<std::vector<int>>(200, rc::gen::inRange(0, kHappenings));
  Pair pair(rules);
  for (const int h : walk) RC_ASSERT(pair.happens(static_cast<Happening>(h)));
}

TEST(AlarmState, GoesOnFromItsBytes) {
  const AlarmRules rules = rules_with(2, 1, 0.5, 3, true);
  Pair pair(rules);
  for (int i = 0; i < 200; ++i) {
    std::array<std::byte, sizeof(Alarm)> bytes{};
    std::memcpy(bytes.data(), &pair.alarm, sizeof(Alarm));
    pair.alarm = Alarm{};
    std::memcpy(&pair.alarm, bytes.data(), sizeof(Alarm));
    ASSERT_TRUE(pair.happens(static_cast<Happening>(i * 7 % kHappenings))) << i;
  }
}

TEST(AlarmState, TellsChatteringAndFleeting) {
  AlarmSettings settings;
  settings.off_delay_s = 0.0;
  const AlarmRules rules = rules_of(settings, 0.0, 10.0);  // 10 rows a second
  Alarm alarm;
  std::uint64_t sample = 0;
  const auto pulse_of = [&](std::uint64_t length, std::uint64_t rest) {
    (void)alarm.step(rules, sample, Condition::of(true));
    sample += length;
    (void)alarm.step(rules, sample, Condition::of(false));
    sample += rest;
  };
  pulse_of(99, 201);
  EXPECT_TRUE(alarm.state().fleeting);  // 9.9 s
  EXPECT_FALSE(alarm.state().chattering);
  pulse_of(100, 150);
  EXPECT_FALSE(alarm.state().fleeting);
  EXPECT_FALSE(alarm.state().chattering);
  pulse_of(50, 50);  // the third within 60 s
  EXPECT_TRUE(alarm.state().chattering);
  (void)alarm.step(rules, 601, Condition::of(false));
  EXPECT_FALSE(alarm.state().chattering);
  // What a person acknowledged did not pass by.
  (void)alarm.step(rules, 5000, Condition::of(true));
  ASSERT_TRUE(alarm.act(rules, {5001, ActionKind::acknowledge}));
  (void)alarm.step(rules, 5010, Condition::of(false));
  EXPECT_FALSE(alarm.state().fleeting);
}

TEST(AlarmState, RefusesWithWhatIsNeeded) {
  const AlarmRules rules = rules_with(0, 0, 0.0, 0, true);
  Alarm alarm;
  const auto needs = [&](ActionKind kind, std::uint64_t until = 0) {
    const auto done = alarm.act(rules, {0, kind, {}, until});
    return done ? std::string("nothing") : done.error().requirement.str();
  };
  EXPECT_EQ(needs(ActionKind::acknowledge), "needs an alarm that is not acknowledged");
  EXPECT_EQ(needs(ActionKind::reset), "needs a latched alarm that has cleared");
  EXPECT_EQ(needs(ActionKind::shelve, 0), "must lie ahead");
  EXPECT_EQ(needs(ActionKind::shelve, 7), "must not be later than the longest time for shelving allows");
  EXPECT_EQ(needs(ActionKind::maintenance, 7), "must be about an alarm");
  (void)alarm.step(rules, 0, Condition::of(true));
  (void)alarm.step(rules, 1, Condition::of(false));
  EXPECT_EQ(needs(ActionKind::reset), "needs an alarm that is acknowledged");
  EXPECT_EQ(needs(ActionKind::acknowledge), "nothing");
  EXPECT_EQ(needs(ActionKind::reset), "nothing");
  EXPECT_FALSE(alarm.state().of_interest());
}

TEST(AlarmState, EndsWhenItIsDisabled) {
  AlarmRules rules = rules_with(0, 0, 0.0, 0, true);
  Alarm alarm;
  (void)alarm.step(rules, 5, Condition::of(true));
  rules.enabled = false;
  const auto told = list_of(alarm.step(rules, 6, Condition::of(true)));
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].transition, Transition::reset);
  EXPECT_EQ(told[0].state.raised_sample, 5U);
  EXPECT_EQ(told[0].state.cleared_sample, 6U);
  EXPECT_FALSE(alarm.state().of_interest());
  EXPECT_TRUE(list_of(alarm.step(rules, 7, Condition::of(true))).empty());
  EXPECT_FALSE(alarm.act(rules, {7, ActionKind::shelve_once}));
}

TEST(AlarmState, KeepsItsTimeWhereSamplesComeLate) {
  const AlarmRules rules = rules_with(3, 3, 0.0, 0, false);
  Alarm alarm;
  (void)alarm.step(rules, 100, Condition::of(true));
  (void)alarm.step(rules, 50, Condition::of(true));
  EXPECT_FALSE(alarm.state().active);
  (void)alarm.step(rules, 103, Condition::of(true));
  EXPECT_TRUE(alarm.state().active);
  EXPECT_EQ(alarm.state().raised_sample, 103U);
}

TEST(AlarmState, TellsBytesThatAreNoState) {
  Alarm alarm;
  ASSERT_TRUE(alarm.intact());
  std::array<unsigned char, sizeof(Alarm)> bytes{};
  bytes.fill(0xAB);
  std::memcpy(&alarm, bytes.data(), bytes.size());
  EXPECT_FALSE(alarm.intact());
}

TEST(AlarmRulesTest, CountSamplesAtAnyRate) {
  AlarmSettings settings;
  settings.on_delay_s = 0.5;
  settings.realarm_s = 1e-6;
  settings.longest_shelving_s = 1e300;
  const AlarmRules rules = rules_of(settings, 0.25, 250.0);
  EXPECT_EQ(rules.on_delay, 125U);
  EXPECT_EQ(rules.off_delay, 2500U);
  EXPECT_EQ(rules.realarm, 1U);  // not never
  EXPECT_EQ(rules.deadband, 0.25);
  Alarm alarm;
  const std::uint64_t late = std::numeric_limits<std::uint64_t>::max() - 5;
  EXPECT_TRUE(alarm.act(rules, {late, ActionKind::shelve_once}));
  EXPECT_EQ(alarm.state().shelved_until, std::numeric_limits<std::uint64_t>::max());
}

}  // namespace
}  // namespace resonid::monitoring
