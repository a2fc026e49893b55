// SPDX-License-Identifier: MIT
#include "monitor/brokers/discover.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "brokers.hpp"

namespace resonid::monitor::test {
namespace {

using Columns = std::vector<std::string>;

const Discovered& named(const std::vector<Discovered>& all, const std::string& name,
                        const std::string& stream = {}) {
  static const Discovered kNone;
  const auto found = std::find_if(all.begin(), all.end(), [&](const Discovered& one) {
    return one.name == name && one.stream == stream;
  });
  EXPECT_NE(found, all.end()) << name;
  return found == all.end() ? kNone : *found;
}

TEST(Scout, GuessesFormatColumnsAndRate) {
  Scout scout;
  for (int k = 0; k < 5; ++k) {
    const double t = 1000.0 + 0.25 * k;
    const std::string n = std::to_string(k);
    scout.add("frame", "", frame_of("x", 500 * static_cast<std::uint64_t>(k), 500), t);
    scout.add("json", "", "{\"axis\":\"y\",\"ru\":[1,2],\"y\":[3,4],\"rate\":8,\"sample\":" + n + "}", t);
    scout.add("lines", "", "drive,axis=z ru=1.5,u=2 179000000000000000" + n, t);
    scout.add("names", "", "time;ru;y\n" + n + ";1;2\n", t);
    scout.add("numbers", "", "1.0,2.0,3.0\n4,5,6\n", t);
    scout.add("words", "", "the door is open", t);
    scout.add("empty", "", "", t);
  }
  const auto all = scout.found();
  ASSERT_EQ(all.size(), 7U);
  const Discovered& frame = named(all, "frame");
  EXPECT_EQ(frame.format, SampleFormat::frame);
  EXPECT_EQ(frame.axis, "x");
  EXPECT_EQ(frame.columns, (Columns{"ru", "u", "y"}));
  EXPECT_EQ(frame.messages, 5U);
  EXPECT_EQ(frame.sample_count, 2500U);
  ASSERT_EQ(frame.samples.size(), 3U);
  EXPECT_EQ(frame.samples[0].size(), 2500U);
  EXPECT_EQ(frame.rate_hz(), kRate_hz);
  EXPECT_NEAR(frame.measured_rate_hz, 2000.0, 1e-6);
  EXPECT_EQ(frame.told_rate_hz, kRate_hz);
  EXPECT_TRUE(frame.numbered && frame.timed);
  const Discovered& json = named(all, "json");
  EXPECT_EQ(json.format, SampleFormat::json);
  EXPECT_EQ(json.axis, "y");
  EXPECT_EQ(json.columns, (Columns{"ru", "y"}));
  EXPECT_NEAR(json.measured_rate_hz, 8.0, 1e-9);
  EXPECT_TRUE(json.numbered && !json.timed);
  const Discovered& lines = named(all, "lines");
  EXPECT_EQ(lines.format, SampleFormat::line_protocol);
  EXPECT_EQ(lines.axis, "z");
  EXPECT_EQ(lines.columns, (Columns{"ru", "u"}));
  EXPECT_EQ(named(all, "names").format, SampleFormat::csv);
  EXPECT_EQ(named(all, "names").columns, (Columns{"ru", "y"}));
  EXPECT_EQ(named(all, "numbers").format, SampleFormat::csv);
  EXPECT_EQ(named(all, "numbers").columns, (Columns{"column 1", "column 2", "column 3"}));
  EXPECT_NEAR(named(all, "numbers").measured_rate_hz, 8.0, 1e-9);
  EXPECT_EQ(named(all, "numbers").samples[1][1], 5.0);
  EXPECT_TRUE(named(all, "names").named && !named(all, "numbers").named);
  EXPECT_EQ(named(all, "words").format, std::nullopt);
  EXPECT_EQ(named(all, "words").messages, 5U);
  EXPECT_EQ(named(all, "empty").format, std::nullopt);
}

/// The sender's times tell the rate where it tells none, however fast the messages come.
TEST(Scout, MeasuresTheRateByTheTimesOfTheSender) {
  Scout scout;
  for (int k = 0; k < 11; ++k)
    scout.add("json", "", "{\"y\":[1,2],\"time\":" + std::to_string(1.79e9 + 0.25 * k) + "}", 1e-3 * k);
  EXPECT_NEAR(scout.found().front().rate_hz(), 8.0, 1e-3);
}

/// What comes without either has a rate of arrival, which counts for less than a column of times.
TEST(Scout, KeepsTheRateOfArrivalApart) {
  Scout scout;
  for (int k = 0; k < 5; ++k) scout.add("numbers", "", "1.0,2.0,3.0\n4,5,6\n", 0.25 * k);
  EXPECT_EQ(scout.found().front().rate_hz(), 0.0);
  EXPECT_NEAR(scout.found().front().measured_rate_hz, 8.0, 1e-9);
}

/// A client whose frames are not acknowledged sends them again and again.
TEST(Scout, TakesNumberedSamplesOnce) {
  Scout scout;
  for (int k = 0; k < 5; ++k) scout.add("x", "", frame_of("x", 0, 100), k);
  scout.add("x", "", frame_of("x", 100, 100), 5.0);
  EXPECT_EQ(scout.found().front().sample_count, 200U);
  EXPECT_EQ(scout.found().front().samples[0].size(), 200U);
}

TEST(ByteScout, GuessesTheFormatOfAStream) {
  std::string rows;
  for (int k = 0; k < 600; ++k) rows += std::to_string(k) + ";1.5;2.5\n";
  const auto found = [](const std::string& text, std::size_t part) {
    Scout scout;
    ByteScout bytes(scout);
    for (std::size_t at = 0; at < text.size(); at += part) bytes.add(text.substr(at, part), 0.0);
    bytes.finish(0.0);
    return scout.found();
  };
  for (const std::size_t part : {std::size_t{7}, std::size_t{100'000}}) {
    const auto csv = found("# a comment\nsample;ru;y\n" + rows, part);
    ASSERT_EQ(csv.size(), 1U);
    EXPECT_EQ(csv[0].format, SampleFormat::csv);
    EXPECT_EQ(csv[0].columns, (Columns{"ru", "y"}));
    EXPECT_TRUE(csv[0].named && csv[0].numbered);
    EXPECT_EQ(csv[0].sample_count, 600U);
    const auto numbers = found(rows, part);
    EXPECT_EQ(numbers.at(0).columns, (Columns{"column 1", "column 2", "column 3"}));
    EXPECT_EQ(numbers.at(0).samples.at(1).size(), 600U);
    EXPECT_EQ(found("{\"axis\":\"x\",\"y\":1}\n{\"axis\":\"z\",\"y\":1}\n", part).size(), 2U);
    const auto frames = found(encoded(Question{"x"}) + frame_of("x", 0, 100) + frame_of("x", 100, 50), part);
    EXPECT_EQ(frames.at(0).format, SampleFormat::frame);
    EXPECT_EQ(frames.at(0).sample_count, 150U);
    EXPECT_TRUE(found("the door is open\n", part).empty());
  }
}

TEST(Scout, StopsGrowing) {
  Scout scout;
  for (int k = 0; k < 12'000; ++k) {
    scout.add(std::to_string(k), "", "nothing", k);
    scout.add("f" + std::to_string(k), "", frame_of("x", 0, 1), k);
  }
  EXPECT_EQ(scout.found().size(), 10'000U);
}

TEST(Discover, ListsWhatAnMqttBrokerCarries) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  const Mosquitto broker;
  MqttSettings settings;
  settings.host = "127.0.0.1";
  settings.port = broker.port();
  std::atomic<bool> done{false};
  std::thread publisher([&] {
    MqttSender sender(broker.port());
    for (std::uint64_t k = 0; !done; ++k) {
      sender.send("machines/x/samples", frame_of("", k * kFrame));
      sender.send("lamp", "on");
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  const auto found = discover_mqtt(settings, "#", 1.0, [] { return true; });
  done = true;
  publisher.join();
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->size(), 2U);
  const Discovered& samples = named(*found, "machines/x/samples");
  EXPECT_GT(samples.messages, 10U);
  EXPECT_GT(samples.measured_rate_hz, 200.0);
  EXPECT_LT(samples.measured_rate_hz, 2100.0);
  EXPECT_EQ(named(*found, "lamp").format, std::nullopt);
}

TEST(Discover, ListsWhatNatsAndItsStreamsCarry) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  const NatsServer server;
  NatsSender sender(server.url());
  sender.make_stream("SAMPLES", "machines.>");
  for (std::uint64_t k = 0; k < 150; ++k) sender.store("machines.x.samples", frame_of("", k * kFrame));
  int calls = 0;
  const auto found = discover_nats({{server.url()}, {}, {}}, ">", 10.0, [&] {
    sender.send("live", frame_of("y", 0));
    sender.flush();
    return ++calls < 20;
  });
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->size(), 2U);
  EXPECT_EQ(named(*found, "machines.x.samples", "SAMPLES").messages, 100U);
  EXPECT_GT(named(*found, "machines.x.samples", "SAMPLES").measured_rate_hz, 1000.0);
  EXPECT_EQ(named(*found, "live").axis, "y");
}

TEST(Discover, LooksByTlsAtWhomItKnows) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  RESONID_REQUIRE_PROGRAM("openssl");
  const TemporaryFolder folder;
  const NatsServer server(with_tls(folder));
  const std::string url = nats_url(server.url().substr(server.url().find("://") + 3), true);
  NatsSender sender(url, folder / "right.pem");
  const auto look = [&](const std::string& name) {
    NatsSettings settings{{url}, {}, {}};
    settings.access.tls = Tls{folder / (name + ".pem"), {}, {}};
    int calls = 0;
    return discover_nats(settings, ">", 10.0, [&] {
      sender.send("live", frame_of("y", 0));
      sender.flush();
      return ++calls < 20;
    });
  };
  const auto found = look("right");
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(named(*found, "live").axis, "y");
  RESONID_EXPECT_MESSAGE(look("wrong"), "tls://");
}

TEST(Discover, SaysWhyThereIsNothing) {
  MqttSettings settings;
  settings.host = "127.0.0.1";
  settings.port = free_port();
  const auto keep = [] { return true; };
  RESONID_EXPECT_MESSAGE(discover_mqtt(settings, "#", 0.5, keep), "refused");
  RESONID_EXPECT_MESSAGE(discover_mqtt(settings, "#/a", 0.5, keep), "is no filter");
  RESONID_EXPECT_MESSAGE(
      discover_nats({{"nats://127.0.0.1:" + std::to_string(settings.port)}, {}, {}}, ">", 0.5, keep), "nats");
  RESONID_EXPECT_MESSAGE(discover_nats({}, "a b", 0.5, keep), "is no filter");
}

}  // namespace
}  // namespace resonid::monitor::test
