// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill

#include <random>

#include "brokers.hpp"

namespace resonid::monitor::test {
namespace {

constexpr int kKills = 60, kWithin = kKills / 10;
constexpr std::uint64_t kFrames = 20'000;

/// Frames that are sent while processes are killed, and as many as that takes.
class Publication {
 public:
  /// @param send is called on a thread of its own until it is to end, at least `kFrames` times
  template <class Send>
  explicit Publication(Send send)
      : thread_([this, send = std::move(send)](const std::stop_token& stop) mutable {
          for (std::uint64_t k = 0; k < kFrames || !stop.stop_requested(); ++k) {
            send(frame_of("", k * kFrame));
            frames_ = k + 1;
            if (k % 20 == 19 || k >= kFrames)
              std::this_thread::sleep_for(std::chrono::milliseconds(k < kFrames ? 5 : 10));
          }
        }) {}
  /// How many there were.
  std::uint64_t end() {
    thread_.request_stop();
    thread_.join();
    return frames_;
  }

 private:
  std::atomic<std::uint64_t> frames_{0};
  std::jthread thread_;
};

/// Kills a process with a source and its ring again and again; counts how often there was something new. They
/// live the longer the longer all takes, for on a busy machine they would be killed before they have begun.
int kill_often(const std::string& kind, const std::string& where, const TemporaryFolder& folder,
               unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> instant_ms(15, 150);
  std::uint64_t reached = 0;
  int within = 0;
  const auto begin = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return static_cast<int>((std::chrono::steady_clock::now() - begin) / std::chrono::seconds(1));
  };
  for (int k = 0; k < kKills || (within < kWithin && seconds() < 120); ++k) {
    {
      Program child({"/proc/self/exe", "--feed", kind, where, folder.path().string()});
      std::this_thread::sleep_for(std::chrono::milliseconds(instant_ms(random) * (1 + seconds() / 5)));
      child.end(SIGKILL);
    }
    Rings rings(folder.path(), {"x"});
    const std::uint64_t end = rings.ring("x").end();
    EXPECT_GE(end, reached) << "after " << k << " kills";
    within += end > reached;
    reached = end;
  }
  return within;
}

/// The source, once more, until nothing comes any more.
void expect_all(const std::string& kind, const std::string& where, const TemporaryFolder& folder,
                std::uint64_t frames) {
  Rings rings(folder.path(), {"x"});
  const auto source = kind == "mqtt" ? mqtt_source(static_cast<std::uint16_t>(std::stoi(where)), rings)
                                     : jetstream_source(where, rings);
  source->start();
  EXPECT_TRUE(until([&] { return rings.ring("x").end() >= frames * kFrame; }, 60.0))
      << rings.ring("x").end() << " " << source->status().text;
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // for what comes twice
  source->stop();
  expect_stored(rings.ring("x"), frames * kFrame);
  EXPECT_EQ(rings.intake("x").counters().missing, 0U);
  EXPECT_EQ(rings.intake("x").faults().total(), 0U);
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
  MqttSender sender(broker.port());
  Publication publication([&](const std::string& frame) { sender.send("machines/x/samples", frame); });
  EXPECT_GE(kill_often("mqtt", where, folder, 1), kWithin);
  const std::uint64_t frames = publication.end();
  sender.finish();
  expect_all("mqtt", where, folder, frames);
}

TEST(Kill, JetStreamLosesAndDoublesNothing) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  const NatsServer server;
  const TemporaryFolder folder;
  NatsSender sender(server.url());
  sender.make_stream("SAMPLES", "machines.>");
  Publication publication([&](const std::string& frame) { sender.store("machines.x.samples", frame); });
  EXPECT_GE(kill_often("jetstream", server.url(), folder, 2), kWithin);
  expect_all("jetstream", server.url(), folder, publication.end());
}

}  // namespace
}  // namespace resonid::monitor::test
