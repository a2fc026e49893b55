// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <map>
#include <monitor/engine/engine.hpp>
#include <monitor/samples/ring.hpp>
#include <monitor/service/alarm_record.hpp>
#include <optional>
#include <string>
#include <thread>

#include "drive.hpp"
#include "folder.hpp"

namespace resonid::monitor {
namespace {

using namespace std::chrono_literals;
using monitoring::ActionKind;
using monitoring::AlarmKind;
constexpr monitoring::AlarmId kStaleAlarm{AlarmKind::stale, {}};

template <class Condition>
bool comes(const Condition& condition) {
  for (int i = 0; i < 10'000 && !condition(); ++i)
    std::this_thread::sleep_for(10ms);  // a busy machine learns slowly
  return condition();
}

/// One axis, its ring and an engine, without a store.
class Watched {
 public:
  explicit Watched(EngineOptions options = {}, monitoring::AlarmSettings stale = {})
      : options_(std::move(options)) {
    options_.stale_s = 0.05;
    spec_.name = "axis";
    spec_.sample_rate_hz = kRate;
    spec_.track.method = identification::TrackMethod::physical;
    spec_.alarms.stale = stale;
    ring_ = Ring::open(folder_.path() / "axis.ring", {"axis", {"ru", "u", "y"}, kRate, 40'000}).value();
    ring_->put_anchor(0, std::nullopt);
    start(monitoring::AxisMonitor::create(spec_).value(), {});
  }
  /// The next samples of the drive.
  void put(double seconds) {
    const auto count = static_cast<std::size_t>(seconds * kRate);
    ring_->put(std::span(values_).subspan(3 * put_, 3 * count));
    ring_->commit({});
    put_ += count;
  }
  /// The process ends, and another one goes on from the newest snapshot with the actions after it.
  void restart() {
    engine_->stop();
    look();
    auto monitor = monitoring::AxisMonitor::restore(spec_, snapshot_.bytes).value();
    std::vector<Told> later;
    for (const auto& told : actions_)
      if (told.action.sample >= monitor.next_sample()) later.push_back(told);
    start(std::move(monitor), std::move(later));
  }
  /// Likewise from the first sample on, as if there had been no snapshot.
  void restart_from_the_beginning() {
    engine_->stop();
    look();
    told_.clear();
    start(monitoring::AxisMonitor::create(spec_).value(), actions_);
  }
  void leave_out_up_to(std::uint64_t sample) { ring_->put_anchor(sample, std::nullopt); }
  /// Transitions of an alarm so far, in words.
  std::string told(monitoring::AlarmId id) {
    look();
    return told_[alarm_name(id)];
  }
  bool tells(monitoring::AlarmId id, const std::string& words) {
    return comes([&] { return told(id) == words; });
  }
  Engine& engine() { return *engine_; }
  std::int64_t since_ns() const { return since_ns_; }
  /// With what the engine has given out in the end.
  const std::vector<Told>& actions() {
    look();
    return actions_;
  }
  /// The newest event of any alarm.
  const Results::TimedEvent& newest() const { return newest_; }
  std::uint64_t sample_of(monitoring::AlarmId id) { return samples_[alarm_name(id)]; }

 private:
  void start(monitoring::AxisMonitor monitor, std::vector<Told> actions) {
    std::vector<Engine::Axis> axes;
    axes.push_back({std::move(monitor), ring_.get(), std::move(actions)});
    engine_ = std::make_unique<Engine>(std::move(axes), options_);
    engine_->start();
  }
  void look() {
    for (auto& results : engine_->take()) {
      for (const auto& e : results.events) {
        told_[alarm_name(e.event.alarm)] += std::string(name_of(e.event.transition)) + " ";
        since_ns_ = e.since_ns;
        newest_ = e;
        samples_[alarm_name(e.event.alarm)] = e.event.sample;
      }
      actions_.insert(actions_.end(), results.actions.begin(), results.actions.end());
      if (results.snapshot) snapshot_ = *results.snapshot;
    }
  }

  const Folder folder_;
  const std::vector<double> values_ = drive_samples(60.0, 1000.0, 1);
  std::size_t put_ = 0;
  EngineOptions options_;
  monitoring::AxisSpec spec_;
  std::unique_ptr<Ring> ring_;
  std::unique_ptr<Engine> engine_;
  std::map<std::string, std::string> told_;
  std::map<std::string, std::uint64_t> samples_;  // of the newest event
  std::vector<Told> actions_;
  Results::Snapshot snapshot_;
  std::int64_t since_ns_ = 0;
  Results::TimedEvent newest_;
};

monitoring::AlarmSettings with_delays(double on_s, double off_s, double realarm_s) {
  monitoring::AlarmSettings s;
  s.on_delay_s = on_s;
  s.off_delay_s = off_s;
  s.realarm_s = realarm_s;
  return s;
}

TEST(Engine, TellsWhenItHangs) {
  std::atomic<int> rows = 0;
  std::atomic<bool> goes_on = false;
  EngineOptions options;
  options.on_row = [&](std::size_t, const monitoring::AxisMonitor&) {
    if (++rows == 1) goes_on.wait(false);
  };
  Watched axis(options);
  axis.put(30.0);
  EXPECT_TRUE(comes([&] { return rows > 0; }));
  EXPECT_TRUE(comes([&] { return axis.engine().turn_s() > 0.5; }));
  goes_on = true;
  goes_on.notify_all();
  EXPECT_TRUE(comes([&] { return axis.engine().turn_s() < 0.5; }));
  EXPECT_TRUE(comes([&] { return rows > 1; }));
}

TEST(Engine, AlarmOfSilenceHasDelaysByTheClock) {
  Watched axis({}, with_delays(0.3, 0.0, 0.3));
  axis.put(1.0);
  EXPECT_EQ(axis.told(kStaleAlarm), "");
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised "));
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised realarmed realarmed "));
  ASSERT_TRUE(axis.engine().act(0, ActionKind::acknowledge, kStaleAlarm, {}, "tester", ""));
  EXPECT_TRUE(comes([&] { return axis.told(kStaleAlarm).ends_with("acknowledged "); }));
  const auto before = axis.told(kStaleAlarm);
  axis.put(0.1);
  EXPECT_TRUE(axis.tells(kStaleAlarm, before + "cleared "));
}

TEST(Engine, AlarmOfSilenceEndsWhereSamplesComeForItsDelay) {
  Watched axis({}, with_delays(0.0, 0.3, 0.0));
  axis.put(0.1);
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised "));
  axis.put(0.1);  // a single message is no end of it
  std::this_thread::sleep_for(400ms);
  EXPECT_EQ(axis.told(kStaleAlarm), "raised ");
  for (int i = 0; i < 500 && axis.told(kStaleAlarm) == "raised "; ++i) {
    axis.put(0.004);
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(axis.told(kStaleAlarm), "raised cleared ");
}

TEST(Engine, WaitsLongerForTheVeryFirstSample) {
  EngineOptions options;
  options.first_sample_s = 0.5;
  const std::int64_t begin = now_ns();
  Watched axis(options, with_delays(0.0, 0.0, 0.0));
  std::this_thread::sleep_for(250ms);
  EXPECT_EQ(axis.told(kStaleAlarm), "");
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised "));
  EXPECT_GE(axis.since_ns(), begin - 10'000'000);
  EXPECT_LE(axis.since_ns(), now_ns());
}

TEST(Engine, ASlowAxisIsStaleAfterThreeSamples) {
  EXPECT_EQ(stale_after_s(EngineOptions{}, 1000.0), 3.0);
  EXPECT_DOUBLE_EQ(stale_after_s(EngineOptions{}, 0.1), 30.0);
}

TEST(Engine, ActionsAfterARestartCount) {
  Watched axis({}, with_delays(0.0, 0.0, 0.0));
  for (int i = 0; i < 5; ++i)
    ASSERT_TRUE(axis.engine().act(0, ActionKind::maintenance, {}, 0.0, "tester", ""));
  axis.put(1.0);
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised "));
  axis.put(0.1);
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised cleared "));
  axis.restart();
  EXPECT_TRUE(comes([&] { return axis.told(kStaleAlarm).ends_with("cleared superseded raised "); }))
      << axis.told(kStaleAlarm);
}

TEST(Engine, ActionsAfterAGapAreReplayedAtTheirSample) {
  Watched axis({}, with_delays(0.0, 1e6, 0.0));
  axis.put(1.0);
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised "));
  axis.leave_out_up_to(5000);
  axis.put(0.4);
  EXPECT_TRUE(comes([&] { return axis.engine().live(0)->next_sample == 5100; }));
  ASSERT_TRUE(axis.engine().act(0, ActionKind::acknowledge, kStaleAlarm, {}, "tester", ""));
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised acknowledged "));
  EXPECT_EQ(axis.sample_of(kStaleAlarm), 5100U);
  axis.put(0.4);
  axis.restart_from_the_beginning();
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised acknowledged "));
  EXPECT_EQ(axis.sample_of(kStaleAlarm), 5100U);
}

/// Axes, twenty unless told otherwise, with their rings.
class Many {
 public:
  explicit Many(std::uint64_t capacity, std::size_t count = 20) {
    for (std::size_t i = 0; i < count; ++i) {
      monitoring::AxisSpec spec;
      spec.name = std::to_string(i);
      spec.sample_rate_hz = kRate;
      spec.track.method = identification::TrackMethod::physical;
      rings.push_back(
          Ring::open(folder_.path() / spec.name, {spec.name, {"ru", "u", "y"}, kRate, capacity}).value());
      rings.back()->put_anchor(0, std::nullopt);
      axes.push_back({monitoring::AxisMonitor::create(spec).value(), rings.back().get(), {}});
    }
  }
  /// So many samples for each, in commits of a second.
  void put(double seconds) {
    constexpr auto kCommit = static_cast<std::size_t>(kRate);
    const auto values = drive_samples(seconds, 1000.0, 1);
    for (auto& ring : rings)
      for (std::size_t at = 0; at + kCommit <= values.size() / 3; at += kCommit) {
        ring->put(std::span(values).subspan(3 * at, 3 * kCommit));
        ring->commit({});
      }
  }
  std::vector<std::unique_ptr<Ring>> rings;
  std::vector<Engine::Axis> axes;

 private:
  const Folder folder_;
};

using Bits = std::vector<std::uint64_t>;

/// All that a row says, bit for bit.
Bits bits_of(const monitoring::Row& row) {
  const auto& g = row.gates;
  Bits bits = {row.sample, static_cast<std::uint64_t>(row.verdict)};
  for (const bool is :
       {row.trusted, g.ready, g.excited, g.converged, g.physical, g.residual, g.complete, g.covered})
    bits.push_back(is ? 1U : 0U);
  for (const double value : {row.lag_samples, row.coherence, row.residual_rms})
    bits.push_back(std::bit_cast<std::uint64_t>(value));
  for (const auto& figure : row.figures)
    for (const double value : {figure.value, figure.std}) bits.push_back(std::bit_cast<std::uint64_t>(value));
  return bits;
}

/// [axis][row] What so many threads come to of samples that come while they work.
std::vector<std::vector<Bits>> rows_of(const std::vector<std::vector<double>>& samples, std::size_t workers,
                                       std::size_t learners) {
  constexpr std::size_t kCommit = 3 * 250;
  Many many(40'000, samples.size());
  std::vector<std::vector<Bits>> rows(samples.size());
  EngineOptions options;
  options.workers = workers;
  options.learners = learners;
  options.stale_s = options.learning_patience_s = 1e6;  // a busy machine is no reason for other rows
  options.on_row = [&rows](std::size_t axis, const monitoring::AxisMonitor& monitor) {
    rows[axis].push_back(bits_of(monitor.row()));  // each axis has one worker
  };
  Engine engine(std::move(many.axes), options);
  engine.start();
  for (std::size_t at = 0; at < samples.front().size(); at += kCommit)
    for (std::size_t axis = 0; axis < samples.size(); ++axis) {
      const std::span<const double> rest = std::span(samples[axis]).subspan(at);
      many.rings[axis]->put(rest.first(std::min(rest.size(), kCommit)));
      many.rings[axis]->commit({});
    }
  EXPECT_TRUE(comes([&] {
    for (std::size_t axis = 0; axis < samples.size(); ++axis)
      if (engine.live(axis)->next_sample < many.rings[axis]->next_sample()) return false;
    return true;
  }));
  engine.stop();
  return rows;
}

TEST(Engine, GivesTheSameRowsWithWhateverThreads) {
  std::vector<std::vector<double>> samples;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) samples.push_back(drive_samples(40.0, 30.0, seed));
  const auto one = rows_of(samples, 1, 1), four = rows_of(samples, 4, 2);
  for (std::size_t axis = 0; axis < samples.size(); ++axis) {
    ASSERT_GT(one[axis].size(), 100U) << axis;
    ASSERT_EQ(one[axis].size(), four[axis].size()) << axis;
    for (std::size_t row = 0; row < one[axis].size(); ++row)
      ASSERT_EQ(one[axis][row], four[axis][row]) << "axis " << axis << ", row " << row;
  }
}

/// What was done to an axis, in words.
std::string actions_of(Engine& engine, std::size_t axis) {
  std::string words;
  for (const auto& results : engine.take())
    if (results.axis == axis)
      for (const auto& told : results.actions) words += std::string(name_of(told.action.kind)) + " ";
  return words;
}

TEST(Engine, WhatAPersonDoesDoesNotWaitForTheTurnToLearn) {
  Many many(40'000);
  many.put(30.0);
  EngineOptions options;
  options.workers = options.learners = 1;
  options.learning_patience_s = 0.0;
  options.stale_s = 1e6;
  Engine engine(std::move(many.axes), options);
  engine.start();
  const std::size_t last = engine.axes() - 1;
  ASSERT_TRUE(comes([&] { return engine.live(last)->waits_to_learn; }));
  ASSERT_TRUE(engine.act(last, ActionKind::maintenance, {}, 3600.0, "tester", ""));
  EXPECT_TRUE(comes([&] { return engine.live(last)->maintenance_until_ns != 0; }));
  engine.stop();
  EXPECT_EQ(actions_of(engine, last), "gather maintenance ");
}

TEST(Engine, WhatAPersonDidCountsThoughTheEngineEndsBeforeTheTurnToLearn) {
  Many many(40'000);
  many.put(30.0);
  EngineOptions options;
  options.workers = options.learners = 1;
  options.learning_patience_s = options.stale_s = 1e6;
  Engine engine(std::move(many.axes), options);
  engine.start();
  const std::size_t last = engine.axes() - 1;
  ASSERT_TRUE(comes([&] { return engine.live(last)->waits_to_learn; }));
  ASSERT_TRUE(engine.act(last, ActionKind::maintenance, {}, 3600.0, "tester", ""));
  engine.stop();
  EXPECT_EQ(actions_of(engine, last), "gather maintenance ");
  EXPECT_FALSE(engine.act(last, ActionKind::maintenance, {}, 0.0, "tester", ""));
}

TEST(Engine, ActionsOfAFormerProcessCountThoughTheRingFillsBeforeTheTurnToLearn) {
  Many many(16'000);
  many.put(48.0);  // which is all that a ring takes
  Told told;
  told.action = {11'900, ActionKind::maintenance, {}, 1'000'000'000, 1, now_ns() + 3600 * 1'000'000'000LL};
  many.axes.back().actions = {told};
  EngineOptions options;
  options.workers = options.learners = 1;
  options.learning_patience_s = 0.0;
  options.stale_s = 1e6;
  Engine engine(std::move(many.axes), options);
  engine.keep_going(true);
  engine.start();
  const std::size_t last = engine.axes() - 1;
  EXPECT_TRUE(comes([&] { return engine.live(last)->maintenance_until_ns != 0; }));
  engine.stop();
  EXPECT_EQ(actions_of(engine, last), "");
}

TEST(Engine, AnAxisThatWaitsToLearnDoesNotFillItsRing) {
  const auto values = drive_samples(120.0, 1000.0, 1);
  Many many(16'000);
  auto& rings = many.rings;
  EngineOptions options;
  options.workers = options.learners = 1;
  options.learning_patience_s = 0.0;
  Engine engine(std::move(many.axes), options);
  engine.keep_going(true);  // there is no store
  engine.start();
  std::map<std::size_t, int> gathered;
  const auto look = [&] {
    for (const auto& results : engine.take())
      for (const auto& told : results.actions)
        gathered[results.axis] += told.action.kind == ActionKind::gather;
  };
  for (std::size_t at = 0; at + 3000 <= values.size() / 3; at += 3000)
    for (auto& ring : rings) {
      look();
      EXPECT_TRUE(comes([&] { return ring->room(3000); }));
      ring->put(std::span(values).subspan(3 * at, 3 * 3000));
      ring->commit({});
    }
  EXPECT_TRUE(comes([&] {
    for (std::size_t i = 0; i < rings.size(); ++i)
      if (engine.live(i)->next_sample < rings[i]->next_sample()) return false;
    return true;
  }));
  engine.stop();
  look();
  EXPECT_GT(std::count_if(gathered.begin(), gathered.end(), [](const auto& axis) { return axis.second > 0; }),
            1);
}

TEST(Engine, WhatAPersonDoesWhileAnAxisLearnsIsTakenInBeforeItEnds) {
  Watched axis;
  axis.put(60.0);
  const auto learns = [&] {
    const auto live = axis.engine().live(0);
    return live->phase == monitoring::Phase::learning && !live->waits_to_learn;
  };
  for (int i = 0; i < 20'000 && !learns(); ++i) std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(learns());
  ASSERT_TRUE(axis.engine().act(0, ActionKind::maintenance, {}, 1e6, "tester", ""));
  axis.engine().stop();
  const auto& actions = axis.actions();
  EXPECT_TRUE(
      std::any_of(actions.begin(), actions.end(), [](const Told& told) { return told.who == "tester"; }));
}

TEST(Engine, AnAxisThatBeginsAnewGivesASnapshotBeforeAllElse) {
  Many many(16'000);
  for (auto& axis : many.axes) axis.begins_anew = true;
  Engine engine(std::move(many.axes), {});
  engine.start();
  std::vector<Results> first;
  EXPECT_TRUE(comes([&] {
    if (first.empty()) first = engine.take();
    return !first.empty();
  }));
  for (const auto& results : first) EXPECT_TRUE(results.snapshot);
}

TEST(Engine, ShelvingAndMaintenanceEndByTheClockToo) {
  Watched axis({}, with_delays(0.0, 0.0, 0.0));
  axis.put(0.1);
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised "));
  ASSERT_TRUE(axis.engine().act(0, ActionKind::shelve, kStaleAlarm, 0.2, "tester", ""));
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised shelved unshelved "));
  ASSERT_TRUE(axis.engine().act(0, ActionKind::maintenance, {}, 0.2, "tester", ""));
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised shelved unshelved suppressed unsuppressed "));
}

TEST(Engine, TellsTheEndOfAShelvingFromNowOnWhereSamplesStoppedLongAgo) {
  EngineOptions options;
  options.time_text = [](std::int64_t ns) { return std::to_string(ns); };
  Watched axis(options, with_delays(0.0, 0.0, 0.0));
  axis.put(0.1);
  EXPECT_TRUE(axis.tells(kStaleAlarm, "raised "));
  std::this_thread::sleep_for(300ms);
  for (const auto kind : {ActionKind::shelve, ActionKind::shelve_once}) {
    const bool timed = kind == ActionKind::shelve;
    const auto before = axis.told(kStaleAlarm);
    const std::int64_t asked_ns = now_ns();
    ASSERT_TRUE(axis.engine().act(0, kind, kStaleAlarm, timed ? std::optional(600.0) : std::nullopt, "", ""));
    ASSERT_TRUE(axis.tells(kStaleAlarm, before + "shelved "));
    const std::int64_t end_ns = axis.newest().event.state.shelved_until_ns;
    EXPECT_GE(end_ns, asked_ns + 600'000'000'000);
    EXPECT_TRUE(axis.newest().text.ends_with(" " + std::to_string(end_ns))) << axis.newest().text;
    Batch batch;
    EXPECT_TRUE(AlarmRecords().add("axis", kRate, axis.newest(), batch));
    EXPECT_EQ(batch.alarms.at(0).shelved_until_ns, end_ns);
    EXPECT_EQ(batch.events.at(0).text, axis.newest().text);
  }
}

}  // namespace
}  // namespace resonid::monitor
