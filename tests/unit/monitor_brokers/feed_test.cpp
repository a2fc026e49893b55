// SPDX-License-Identifier: MIT
#include "monitor/brokers/feed.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <limits>
#include <thread>
#include <vector>

#include "brokers.hpp"
#include "monitor/brokers/nats_subject.hpp"
#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor::test {
namespace {

TEST(Feed, FindsTheAxisInATopic) {
  EXPECT_EQ(axis_in("machines/+/samples", "machines/x/samples", kMqttTopics), "x");
  EXPECT_EQ(axis_in("+", "x", kMqttTopics), "x");
  EXPECT_EQ(axis_in("+/+", "a/b", kMqttTopics), "a");
  EXPECT_EQ(axis_in("a/+/#", "a/b/c/d", kMqttTopics), "b");
  EXPECT_EQ(axis_in("a/+", "a/", kMqttTopics), "");
  EXPECT_EQ(axis_in("a/b", "a/b", kMqttTopics), std::nullopt);
  EXPECT_EQ(axis_in("#", "a/b", kMqttTopics), std::nullopt);
  EXPECT_EQ(axis_in("a/#/+", "a/b", kMqttTopics), std::nullopt);
  EXPECT_EQ(axis_in("machines.*.samples", "machines.x.samples", kNatsSubjects), "x");
  EXPECT_EQ(axis_in("machines.>", "machines.x.samples", kNatsSubjects), std::nullopt);
}

TEST(Feed, KnowsTheSubjectsOfAFilter) {
  EXPECT_TRUE(subject_matches("", "a.b"));
  EXPECT_TRUE(subject_matches("a.*.c", "a.b.c"));
  EXPECT_TRUE(subject_matches("a.>", "a.b.c"));
  EXPECT_TRUE(subject_matches("a", "a"));
  EXPECT_FALSE(subject_matches("a.>", "a"));
  EXPECT_FALSE(subject_matches("a.*", "a"));
  EXPECT_FALSE(subject_matches("a.*", "a.b.c"));
  EXPECT_FALSE(subject_matches("a.b", "a.c"));
  EXPECT_FALSE(subject_matches("a.b.c", "a.b"));
}

/// The axis is "m1/x" where that one is configured, else what the topic tells.
TEST(Feed, JoinsTheNamesOfTopicAndMessage) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"m1/x", "m1/y", "m2"});
  Delivery delivery(rings);
  Feed feed(delivery, {{"machines/+", {SampleFormat::frame}}, {"all", {SampleFormat::frame}}}, kMqttTopics);
  EXPECT_TRUE(feed.take(0, "machines/m1", frame_of("x", 0) + frame_of("y", 0) + frame_of("y", kFrame)));
  EXPECT_TRUE(feed.take(0, "machines/m2", frame_of("x", 0)));
  EXPECT_TRUE(feed.take(1, "all", frame_of("m2", kFrame)));
  EXPECT_TRUE(feed.take(1, "all", frame_of("", 0)));  // whose?
  EXPECT_TRUE(feed.take(0, "machines/m3", frame_of("x", 0)));
  expect_stored(rings.ring("m1/x"), kFrame);
  expect_stored(rings.ring("m1/y"), 2 * kFrame);
  expect_stored(rings.ring("m2"), 2 * kFrame);
  EXPECT_EQ(delivery.status().unknown, 2U);
  EXPECT_EQ(delivery.status().messages, 5U);
}

/// The whole topic is an axis' name, too.
TEST(Feed, KnowsAxesByTheirTopics) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"drives/x", "y"});
  Delivery delivery(rings);
  Feed feed(delivery, {{"drives/#", {SampleFormat::frame}}}, kMqttTopics);
  EXPECT_TRUE(feed.take(0, "drives/x", frame_of("", 0)));
  EXPECT_TRUE(feed.take(0, "drives/x", frame_of("y", 0)));  // what the message tells counts for more
  EXPECT_TRUE(feed.take(0, "drives/z", frame_of("", 0)));
  expect_stored(rings.ring("drives/x"), kFrame);
  expect_stored(rings.ring("y"), kFrame);
  EXPECT_EQ(delivery.status().unknown, 1U);
}

TEST(Feed, NumbersTheFramesOfAMessage) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  Delivery delivery(rings);
  Feed feed(delivery, {{"s", {SampleFormat::frame}}}, kNatsSubjects);
  const std::string message = frame_of("", 0) + frame_of("", kFrame);
  EXPECT_TRUE(feed.take(0, "s", message, {{7, 0, 5, 0}}));
  EXPECT_EQ(rings.ring("x").source(), (SourcePosition{{7, 0, 5, 2}}));
  EXPECT_TRUE(feed.take(0, "s", message, {{7, 0, 5, 0}}));
  expect_stored(rings.ring("x"), 2 * kFrame);
  EXPECT_EQ(rings.intake("x").counters().duplicate, 2 * kFrame);
}

/// What MQTT, NATS and JetStream bring takes this way.
TEST(Feed, BadMessagesOfOneAxisAreNamedAndLeaveTheOthersAlone) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"bad", "good"});
  Delivery delivery(rings);
  Feed feed(delivery, {{"machines/+", {SampleFormat::frame}}}, kMqttTopics);
  std::uint64_t good = 0;
  const auto bad = [&](const std::string& message) {
    EXPECT_TRUE(feed.take(0, "machines/bad", message));
    EXPECT_TRUE(feed.take(0, "machines/good", frame_of("", kFrame * good++)));
  };
  const auto with = [](std::uint64_t first, std::int64_t time_ns, double value) {
    static constexpr std::string_view kNames[] = {"ru", "u", "y"};
    const std::vector<double> values(3 * kFrame, value);
    return encoded(Arrival{"", first, time_ns, kRate_hz, kNames, values, {}}, ValueType::float64).value();
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr std::int64_t kFrame_ns = 10'000'000, kHour_ns = 3'600'000'000'000;
  const std::string first = frame_of("", 0);
  bad(first);
  bad("no frame " + std::string(3000, '\xff'));
  std::string damaged = frame_of("", kFrame);
  damaged.back() ^= 1;
  bad(damaged);
  bad(first.substr(0, first.size() / 2));
  bad(frame_of("", kFrame, kFrame, 2.0 * kRate_hz));
  bad(frame_of("", 2 * kFrame));
  bad(frame_of("", kFrame));  // reversed
  bad(frame_of("", 2 * kFrame));
  bad(with(3 * kFrame, kStart_ns + 3 * kFrame_ns, kNaN));
  bad(with(4 * kFrame, kStart_ns + 4 * kFrame_ns + kHour_ns, 1.0));
  bad(with(5 * kFrame, kStart_ns - kHour_ns, 1.0));
  expect_stored(rings.ring("good"), good * kFrame);
  EXPECT_EQ(rings.intake("good").faults().total(), 0U);
  const Intake& intake = rings.intake("bad");
  for (const Fault kind : {Fault::format, Fault::rate, Fault::order, Fault::value, Fault::clock})
    EXPECT_GT(intake.faults().count(kind), 0U) << name_of(kind);
  EXPECT_EQ(intake.counters().duplicate, kFrame);
  EXPECT_EQ(intake.counters().late, kFrame);
  EXPECT_EQ(rings.ring("bad").end(), 6 * kFrame);
}

/// A broker is told that it came, and does not send it again.
TEST(Feed, AMessageThatWaitsForAnotherOutlivesAKill) {
  const TemporaryFolder folder;
  const auto frame = [](std::uint64_t first) {
    static constexpr std::string_view kNames[] = {"ru", "u", "y"};
    const std::vector<double> values(3 * kFrame, 1.0);
    return encoded(Arrival{"", first, {}, kRate_hz, kNames, values, {}}, ValueType::float64).value();
  };
  constexpr std::uint64_t kFar = 1'000'000;
  const std::vector<std::vector<std::uint64_t>> processes{{0, kFar}, {kFar + kFrame}};
  for (const auto& messages : processes) {
    Rings rings(folder.path(), {"x"});
    Delivery delivery(rings);
    Feed feed(delivery, {{"s", {SampleFormat::frame}}}, kMqttTopics);
    for (const std::uint64_t first : messages) EXPECT_TRUE(feed.take(0, "s", frame(first)));
  }
  Rings rings(folder.path(), {"x"});
  EXPECT_EQ(rings.ring("x").end(), 3 * kFrame);
}

/// Whoever may publish makes as many topics as he likes.
TEST(Feed, ForgetsTopicsRatherThanGrow) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  Delivery delivery(rings);
  Feed feed(delivery, {{"#", {SampleFormat::csv, {}, {}}}}, kMqttTopics);
  const std::string names = "ru,u,y\n";
  EXPECT_TRUE(feed.take(0, "first", names + "0,0,0\n"));
  for (int k = 0; k < 2000; ++k) EXPECT_TRUE(feed.take(0, std::to_string(k), "nothing"));
  EXPECT_EQ(rings.ring("x").end(), 1U);
  EXPECT_TRUE(feed.take(0, "first", "1,7,13\n"));  // its names of columns are gone
  EXPECT_EQ(rings.ring("x").end(), 1U);
  EXPECT_TRUE(feed.take(0, "first", names + "1,7,13\n"));
  expect_stored(rings.ring("x"), 2);
}

TEST(Feed, TopicsThatNoAxisHasTakeNobodysPlace) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  Delivery delivery(rings);
  Feed feed(delivery, {{"machines/+", {SampleFormat::csv, {}, {}}}}, kMqttTopics);
  EXPECT_TRUE(feed.take(0, "machines/x", "ru,u,y\n"));
  for (int k = 0; k < 3000; ++k) EXPECT_TRUE(feed.take(0, fmt::format("machines/{}", k), "ru,u,y\n0,0,0\n"));
  EXPECT_TRUE(feed.take(0, "machines/x", "0,0,0\n1,7,13\n"));  // its names of columns are known
  EXPECT_EQ(rings.ring("x").end(), 2U);
  const auto status = delivery.status();
  EXPECT_EQ(status.unknown, 3000U);
  ASSERT_EQ(status.first_unknown.size(), kMostFirstUnknown);
  EXPECT_EQ(status.first_unknown.front(), "'machines/0' tells of axis '0', which is not configured");
}

#ifdef __GLIBC__
TEST(Feed, KeepsNoLargeMessagesOfManyTopics) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  Delivery delivery(rings);
  Feed feed(delivery, {{"#", {SampleFormat::csv, {}, {}}}}, kMqttTopics);
  const std::string comment = "ru,u,y\n#" + std::string(900'000, '-');
  const std::size_t before = ::mallinfo2().uordblks + ::mallinfo2().hblkhd;
  for (int k = 0; k < 100; ++k) EXPECT_TRUE(feed.take(0, std::to_string(k), comment));
  EXPECT_LT(::mallinfo2().uordblks + ::mallinfo2().hblkhd, before + 5'000'000);
}
#endif

/// The state of a source, whatever it set itself.
TEST(Feed, TellsThatItWaitsForRoomInARing) {
  class Waiting final : public CountingSource {
   public:
    explicit Waiting(Axes& axes)
        : CountingSource(axes), feed(delivery_, {{"s", {SampleFormat::frame}}}, kNatsSubjects) {
      set_state(SourceState::running);
    }
    void start() override {}
    void stop() override { delivery_.stop(); }
    [[nodiscard]] std::string_view promise() const noexcept override { return ""; }
    Feed feed;
  };
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"}, 16'000);
  Waiting source(rings);
  std::uint64_t first = 0;
  for (; rings.ring("x").room(kFrame + static_cast<std::size_t>(kRate_hz), 1); first += kFrame)
    ASSERT_TRUE(source.feed.take(0, "s", frame_of("x", first)));
  EXPECT_EQ(source.status().state, SourceState::running);
  std::thread sender([&] { EXPECT_TRUE(source.feed.take(0, "s", frame_of("x", first))); });
  EXPECT_TRUE(until([&] { return source.status().state == SourceState::waiting; }));
  EXPECT_EQ(source.status().text, "for room in the ring of 's'");
  rings.ring("x").set_read(first);
  sender.join();
  EXPECT_EQ(source.status().state, SourceState::running);
  EXPECT_EQ(source.status().text, "");
}

}  // namespace
}  // namespace resonid::monitor::test
