// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <future>
#include <random>

#include "brokers.hpp"
#include "monitor/brokers/nats_source.hpp"

namespace resonid::monitor::test {
namespace {

constexpr const char* kSubject = "machines.x.samples";

/// Another program that pulls from a consumer.
class PullSubscription {
 public:
  PullSubscription(natsConnection* connection, const char* stream, const char* filter, const char* consumer) {
    jsSubOptions options;
    jsSubOptions_Init(&options);
    options.Stream = stream;
    EXPECT_EQ(natsConnection_JetStream(&js_, connection, nullptr), NATS_OK);
    EXPECT_EQ(js_PullSubscribe(&subscription_, js_, filter, consumer, nullptr, &options, nullptr), NATS_OK);
  }
  PullSubscription(const PullSubscription&) = delete;
  PullSubscription& operator=(const PullSubscription&) = delete;
  ~PullSubscription() {
    natsSubscription_Destroy(subscription_);
    jsCtx_Destroy(js_);
  }
  /// Messages that came in time, and are not acknowledged.
  [[nodiscard]] int fetch(int most, std::int64_t time_ms) const {
    natsMsgList list{};
    EXPECT_EQ(natsSubscription_Fetch(&list, subscription_, most, time_ms, nullptr), NATS_OK);
    const int count = list.Count;
    natsMsgList_Destroy(&list);
    return count;
  }

 private:
  jsCtx* js_ = nullptr;
  natsSubscription* subscription_ = nullptr;
};

class JetStream : public ::testing::Test {
 protected:
  void SetUp() override {
    RESONID_REQUIRE_PROGRAM("nats-server");
    server_ = std::make_unique<NatsServer>();
    sender_ = std::make_unique<NatsSender>(server_->url());
    rings_ = std::make_unique<Rings>(folder_.path(), std::vector<std::string>{"x", "y"});
  }
  void start() {
    source_ = jetstream_source(server_->url(), *rings_);
    source_->start();
  }
  void send(std::uint64_t from, std::uint64_t to, const std::string& subject = kSubject) {
    for (std::uint64_t k = from; k < to; ++k) sender_->store(subject, frame_of("", k * kFrame));
  }
  [[nodiscard]] bool reaches(std::uint64_t frames, const char* axis = "x") {
    return until([&] { return rings_->ring(axis).end() == frames * kFrame; });
  }

  /// None that were thought to be lost are made again and again.
  void expect_one_request() const {
    jsCtx* js = nullptr;
    ASSERT_EQ(natsConnection_JetStream(&js, sender_->connection(), nullptr), NATS_OK);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    std::int64_t most = 0;
    for (int k = 0; k < 20 || (most == 0 && k < 1000); ++k) {
      jsConsumerInfo* info = nullptr;
      EXPECT_EQ(js_GetConsumerInfo(&info, js, "SAMPLES", "resonid", nullptr, nullptr), NATS_OK);
      if (info != nullptr) most = std::max(most, info->NumWaiting);
      jsConsumerInfo_Destroy(info);
      std::this_thread::sleep_for(std::chrono::milliseconds(7));
    }
    jsCtx_Destroy(js);
    EXPECT_EQ(most, 1);
  }

  TemporaryFolder folder_;
  std::unique_ptr<NatsServer> server_;
  std::unique_ptr<NatsSender> sender_;
  std::unique_ptr<Rings> rings_;
  std::unique_ptr<Source> source_;
};

TEST_F(JetStream, BringsEverySampleOnceThroughRestartsOfBothSides) {
  start();
  ASSERT_TRUE(until([&] { return source_->status().text.find("no stream 'SAMPLES'") != std::string::npos; }))
      << source_->status().text;
  sender_->make_stream("SAMPLES", "machines.>");
  send(0, 300);
  send(0, 100, "machines.y.samples");
  send(0, 1, "machines.z.samples");
  send(0, 1, "machines.x.torque");
  ASSERT_TRUE(reaches(300)) << source_->status().text;
  ASSERT_TRUE(reaches(100, "y"));
  ASSERT_TRUE(until([&] { return source_->status().unknown == 1; }));
  source_->stop();
  send(300, 600);
  start();
  ASSERT_TRUE(reaches(600)) << source_->status().text;
  server_->stop();
  ASSERT_TRUE(until([&] { return source_->status().state == SourceState::waiting; }));
  server_->start();
  send(600, 900);
  ASSERT_TRUE(reaches(900)) << source_->status().text;
  source_->stop();
  expect_stored(rings_->ring("x"), 900 * kFrame);
  expect_stored(rings_->ring("y"), 100 * kFrame);
  EXPECT_EQ(source_->status().lost, 0U);
}

/// The same for samples without index: the position alone tells what is there.
TEST_F(JetStream, LeavesOutByPositionWhatComesAgain) {
  sender_->make_stream("SAMPLES", "machines.>");
  JetStreamSourceSettings settings;
  settings.servers.servers = {server_->url()};
  settings.stream = "SAMPLES";
  settings.subjects = {"machines.*.samples", {SampleFormat::csv, {"ru", "u", "y"}, {}}};
  for (std::uint64_t k = 0; k < 200; k += 2) {
    std::string lines;
    for (std::uint64_t n = k; n < k + 2; ++n)
      lines += std::to_string(value_of(n, 0)) + " " + std::to_string(value_of(n, 1)) + " " +
               std::to_string(value_of(n, 2)) + "\n";
    sender_->store(kSubject, lines);
  }
  for (const char* consumer :
       {"first", "second"}) {  // the second one is given everything that is not in the ring
    settings.consumer = consumer;
    const auto source = std::move(make_jetstream_source(settings, *rings_).value());
    source->start();
    ASSERT_TRUE(until([&] { return rings_->ring("x").end() == 200; })) << source->status().text;
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    source->stop();
  }
  expect_stored(rings_->ring("x"), 200);
}

/// A process that was delivered messages and did not acknowledge them: newer ones may come first.
TEST_F(JetStream, ReadsFirstWhatAnotherProcessHasNotAcknowledged) {
  sender_->make_stream("SAMPLES", "machines.>");
  start();
  send(0, 50);
  ASSERT_TRUE(reaches(50));
  source_->stop();
  send(50, 150);
  {
    const PullSubscription other(sender_->connection(), "SAMPLES", "machines.*.samples", "resonid");
    ASSERT_EQ(other.fetch(40, 1000), 40);
  }
  start();
  ASSERT_TRUE(reaches(150)) << rings_->ring("x").end();
  std::this_thread::sleep_for(std::chrono::seconds(3));  // they are delivered again
  source_->stop();
  expect_stored(rings_->ring("x"), 150 * kFrame);
}

/// Answers come late and at once, also those of a request that was given up as lost.
TEST_F(JetStream, BringsEverySampleOnceFromAServerThatHalts) {
  constexpr std::uint64_t kFrames = 20'000;
  sender_->make_stream("SAMPLES", "machines.>");
  send(0, kFrames);
  start();
  std::mt19937 random(3);
  std::uniform_int_distribution<int> halt_ms(50, 250), work_ms(1, 30);
  int halts = 0;
  for (; halts < 200 && rings_->ring("x").end() < kFrames * kFrame; ++halts) {
    server_->pause();
    std::this_thread::sleep_for(std::chrono::milliseconds(halts == 3 ? 1500 : halt_ms(random)));
    server_->go_on();
    std::this_thread::sleep_for(std::chrono::milliseconds(work_ms(random)));
  }
  EXPECT_GT(halts, 4);
  ASSERT_TRUE(reaches(kFrames)) << source_->status().text;
  expect_one_request();
  source_->stop();
  expect_stored(rings_->ring("x"), kFrames * kFrame);
  EXPECT_EQ(rings_->intake("x").counters().missing, 0U);
}

TEST_F(JetStream, TellsAStreamThatWasMadeAnewFromTheOldOne) {
  sender_->make_stream("SAMPLES", "machines.>");
  start();
  send(0, 100);
  ASSERT_TRUE(reaches(100));
  // While it runs, and while it does not: sequences begin at 1 again.
  sender_->delete_stream("SAMPLES");
  sender_->make_stream("SAMPLES", "machines.>");
  send(100, 150);
  ASSERT_TRUE(reaches(150)) << source_->status().text;
  source_->stop();
  sender_->delete_stream("SAMPLES");
  sender_->make_stream("SAMPLES", "machines.>");
  send(150, 180);
  start();
  ASSERT_TRUE(reaches(180)) << source_->status().text;
  source_->stop();
  expect_stored(rings_->ring("x"), 180 * kFrame);
}

TEST_F(JetStream, DoesNotAcknowledgeWhatAFullRingDidNotTake) {
  sender_->make_stream("SAMPLES", "machines.>");
  rings_ = std::make_unique<Rings>(folder_ / "", std::vector<std::string>{"small"}, 16'000);
  start();
  constexpr std::uint64_t kFrames = 1000;
  send(0, kFrames, "machines.small.samples");
  Ring& ring = rings_->ring("small");
  ASSERT_TRUE(until([&] { return ring.end() > 9000; }));
  EXPECT_TRUE(until([&] { return source_->status().state == SourceState::waiting; }));
  EXPECT_NE(source_->status().text.find("for room in the ring of 'machines.small.samples'"),
            std::string::npos)
      << source_->status().text;
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_LT(ring.end(), kFrames * kFrame);
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));  // longer than it waits for an answer
  source_->stop();
  start();
  std::uint64_t wrong = 0, read = 0;
  EXPECT_TRUE(until([&] {
    const Piece piece = ring.piece(read);
    for (std::size_t k = 0; k < piece.samples; ++k) wrong += piece.values[3 * k] != value_of(read + k, 0);
    read += piece.samples;
    ring.set_read(read);
    return read >= kFrames * kFrame;
  })) << read;
  expect_one_request();
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(rings_->intake("small").counters().missing, 0U);
}

/// Another program took one delivery, so that it is read from the stream, for which there is no room: the one
/// that came after it must wait for the next start.
TEST_F(JetStream, StoppedBeforeAMissedMessageIsTakenItTakesNoNewerOne) {
  sender_->make_stream("SAMPLES", "machines.>");
  rings_ = std::make_unique<Rings>(folder_ / "", std::vector<std::string>{"small", "other"}, 16'000);
  Ring& ring = rings_->ring("small");
  constexpr std::uint64_t kTaken = 500;  // no other frame has room
  start();
  send(0, kTaken, "machines.small.samples");
  ASSERT_TRUE(reaches(kTaken, "small"));
  {
    const PullSubscription thief(sender_->connection(), "SAMPLES", "machines.*.samples", "resonid");
    auto stolen = std::async(std::launch::async, [&] { return thief.fetch(1, 5000); });
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // it waits longest
    send(kTaken, kTaken + 1, "machines.small.samples");
    ASSERT_EQ(stolen.get(), 1);
  }
  send(0, 1, "machines.other.samples");
  ASSERT_TRUE(until([&] { return source_->status().state == SourceState::waiting; }));
  source_->stop();
  EXPECT_EQ(rings_->ring("other").end(), 0U);
  ring.set_read(ring.end());
  start();
  EXPECT_TRUE(reaches(kTaken + 1, "small")) << ring.end();
  EXPECT_TRUE(reaches(1, "other"));
  source_->stop();
}

TEST_F(JetStream, WhatWasDroppedBeforeTheFirstStartIsNotLost) {
  sender_->make_stream("SAMPLES", "machines.>");
  send(0, 50);
  jsCtx* js = nullptr;
  ASSERT_EQ(natsConnection_JetStream(&js, sender_->connection(), nullptr), NATS_OK);
  EXPECT_EQ(js_PurgeStream(js, "SAMPLES", nullptr, nullptr), NATS_OK);
  JetStreamSourceSettings settings;
  settings.servers.servers = {server_->url()};
  settings.stream = "SAMPLES";
  settings.consumer = "all";  // without filter lost messages are counted
  settings.subjects = {"", {SampleFormat::frame, {}, "x"}};
  const auto begin = [&] {
    source_ = std::move(make_jetstream_source(settings, *rings_).value());
    source_->start();
  };
  send(0, 10);
  begin();
  ASSERT_TRUE(reaches(10)) << source_->status().text;
  EXPECT_EQ(source_->status().lost, 0U);
  source_->stop();
  jsStreamConfig config;
  jsStreamConfig_Init(&config);
  const char* subjects[] = {"machines.>"};
  config.Name = "SAMPLES";
  config.Subjects = subjects;
  config.SubjectsLen = 1;
  config.MaxMsgs = 2;
  ASSERT_EQ(js_UpdateStream(nullptr, js, &config, nullptr, nullptr), NATS_OK);
  jsCtx_Destroy(js);
  send(10, 19);  // of which it keeps two
  begin();
  ASSERT_TRUE(reaches(19)) << source_->status().text;
  EXPECT_EQ(source_->status().lost, 7U);
}

TEST_F(JetStream, NamesWhatIsWrongAndGoesOn) {
  sender_->make_stream("SAMPLES", "machines.>");
  start();
  sender_->store(kSubject, "garbage");
  sender_->store(kSubject, std::string_view(frame_of("", 0)).substr(0, 99));
  sender_->store(kSubject, frame_of("", 0, kFrame, 500.0));
  send(0, 2);
  ASSERT_TRUE(reaches(2));
  source_->stop();
  EXPECT_EQ(rings_->intake("x").faults().count(Fault::format), 2U);
  EXPECT_EQ(rings_->intake("x").faults().count(Fault::rate), 1U);
}

TEST_F(JetStream, DoesNotTakeAnotherConsumer) {
  sender_->make_stream("SAMPLES", "machines.>");
  start();
  ASSERT_TRUE(until([&] { return source_->status().state == SourceState::running; }));
  source_->stop();
  source_ = jetstream_source(server_->url(), *rings_, "machines.y.samples");
  source_->start();
  EXPECT_TRUE(until([&] {
    return source_->status().text.find("consumer 'resonid' has filter 'machines.*.samples'") !=
           std::string::npos;
  })) << source_->status().text;
}

TEST(JetStreamSettings, RefusesNamesThatAreNone) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  JetStreamSourceSettings settings;
  settings.stream = "S";
  RESONID_EXPECT_MESSAGE(make_jetstream_source(settings, rings), "'' is no name");
  settings.consumer = "a.b";
  RESONID_EXPECT_MESSAGE(make_jetstream_source(settings, rings), "'a.b' is no name");
  settings.consumer = "c";
  settings.batch = 0;
  RESONID_EXPECT_MESSAGE(make_jetstream_source(settings, rings), "1 ... 10000 messages");
  settings.batch = 1;
  settings.subjects.filter = "a b";
  RESONID_EXPECT_MESSAGE(make_jetstream_source(settings, rings), "'a b' is no filter");
}

}  // namespace
}  // namespace resonid::monitor::test
