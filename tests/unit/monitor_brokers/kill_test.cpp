// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <signal.h>

#include <random>

#include "brokers.hpp"

namespace resonid::monitor::test {
namespace {

constexpr int kKills = 60;
constexpr std::uint64_t kFrames = 20'000;

/// Kills a process with a source and its ring again and again while `publish` goes on; counts how often there
/// was something new and more to come.
int kill_often(const std::string& kind, const std::string& where, const TemporaryFolder& folder,
               unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> instant_ms(15, 150);
  std::uint64_t reached = 0;
  int within = 0;
  for (int k = 0; k < kKills; ++k) {
    {
      Program child({"/proc/self/exe", "--feed", kind, where, folder.path().string()});
      std::this_thread::sleep_for(std::chrono::milliseconds(instant_ms(random)));
      child.end(SIGKILL);
    }
    Rings rings(folder.path(), {"x"});
    const std::uint64_t end = rings.ring("x").end();
    EXPECT_GE(end, reached) << "after " << k << " kills";
    within += end > reached && end < kFrames * kFrame;
    reached = end;
  }
  return within;
}

/// The source, once more, until nothing comes any more.
void expect_all(const std::string& kind, const std::string& where, const TemporaryFolder& folder) {
  Rings rings(folder.path(), {"x"});
  const auto source = kind == "mqtt" ? mqtt_source(static_cast<std::uint16_t>(std::stoi(where)), rings)
                                     : jetstream_source(where, rings);
  source->start();
  EXPECT_TRUE(until([&] { return rings.ring("x").end() >= kFrames * kFrame; }, 60.0))
      << rings.ring("x").end() << " " << source->status().text;
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // for what comes twice
  source->stop();
  expect_stored(rings.ring("x"), kFrames * kFrame);
  EXPECT_EQ(rings.intake("x").counters().missing, 0U);
  EXPECT_EQ(rings.intake("x").faults().total(), 0U);
}

/// Spreads the frames over the time of the kills.
template <class Send>
void publish_slowly(const Send& send) {
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    send(frame_of("", k * kFrame));
    if (k % 20 == 19) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

TEST(Kill, MqttLosesAndDoublesNothing) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  const Mosquitto broker;
  const TemporaryFolder folder;
  const std::string where = std::to_string(broker.port());
  {
    Rings rings(folder.path(), {"x"});  // the session begins before anything is sent
    const auto source = mqtt_source(broker.port(), rings);
    source->start();
    ASSERT_TRUE(until([&] { return source->status().state == SourceState::running; }));
  }
  std::thread publisher([&] {
    MqttSender sender(broker.port());
    publish_slowly([&](const std::string& frame) { sender.send("machines/x/samples", frame); });
    sender.finish();
  });
  const int within = kill_often("mqtt", where, folder, 1);
  publisher.join();
  EXPECT_GE(within, kKills / 10);
  expect_all("mqtt", where, folder);
}

TEST(Kill, JetStreamLosesAndDoublesNothing) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  const NatsServer server;
  const TemporaryFolder folder;
  NatsSender sender(server.url());
  sender.make_stream("SAMPLES", "machines.>");
  std::thread publisher(
      [&] { publish_slowly([&](const std::string& frame) { sender.store("machines.x.samples", frame); }); });
  const int within = kill_often("jetstream", server.url(), folder, 2);
  publisher.join();
  EXPECT_GE(within, kKills / 10);
  expect_all("jetstream", server.url(), folder);
}

}  // namespace
}  // namespace resonid::monitor::test
