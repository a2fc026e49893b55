// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <signal.h>

#include "brokers.hpp"
#include "monitor/brokers/mqtt_source.hpp"

namespace resonid::monitor::test {
namespace {

bool runs(const Source& source) {
  return until([&] { return source.status().state == SourceState::running; });
}

MqttSourceSettings settings_of(const Mosquitto& broker) {
  MqttSourceSettings settings;
  settings.broker.host = "127.0.0.1";
  settings.broker.port = broker.port();
  settings.broker.client_id = "resonid-test";
  settings.topics = {{"machines/+/samples", {SampleFormat::frame}}};
  return settings;
}

class MqttVersions : public ::testing::TestWithParam<int> {};

TEST_P(MqttVersions, BringsEverySampleOnceThoughAwayMeanwhile) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  Mosquitto broker;
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x", "y"});
  auto source = mqtt_source(broker.port(), rings, GetParam());
  source->start();
  ASSERT_TRUE(runs(*source));
  MqttSender sender(broker.port());
  const auto send = [&](std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t k = from; k < to; ++k) {
      sender.send("machines/x/samples", frame_of("", k * kFrame));
      sender.send("machines/y/samples", frame_of("y", k * kFrame));
    }
    sender.finish();
  };
  send(0, 500);
  ASSERT_TRUE(until([&] { return rings.ring("y").end() == 500 * kFrame; }));
  source->stop();
  send(500, 2000);  // the broker queues
  source = mqtt_source(broker.port(), rings, GetParam());
  source->start();
  ASSERT_TRUE(until([&] { return rings.ring("y").end() == 2000 * kFrame; })) << source->status().text;
  // The broker is stopped and started; what it has not yet delivered it keeps.
  broker.stop();
  ASSERT_TRUE(until([&] { return source->status().state == SourceState::waiting; }));
  EXPECT_NE(source->status().text.find(std::to_string(broker.port())), std::string::npos)
      << source->status().text;
  broker.start();
  ASSERT_TRUE(runs(*source));
  MqttSender again(broker.port());
  for (std::uint64_t k = 2000; k < 2500; ++k) again.send("machines/x/samples", frame_of("", k * kFrame));
  ASSERT_TRUE(until([&] { return rings.ring("x").end() == 2500 * kFrame; })) << rings.ring("x").end();
  source->stop();
  expect_stored(rings.ring("x"), 2500 * kFrame);
  expect_stored(rings.ring("y"), 2000 * kFrame);
  EXPECT_EQ(rings.intake("y").faults().total(), 0U);
  EXPECT_EQ(source->status().unknown, 0U);
}

INSTANTIATE_TEST_SUITE_P(Mqtt, MqttVersions, ::testing::Values(4, 5));

TEST(Mqtt, WaitsForABrokerThatIsAbsentAtTheStart) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  Mosquitto broker;
  broker.stop();
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  const auto source = mqtt_source(broker.port(), rings);
  source->start();
  ASSERT_TRUE(until([&] { return source->status().state == SourceState::waiting; }));
  EXPECT_NE(source->status().text.find("refused"), std::string::npos) << source->status().text;
  broker.start();
  EXPECT_TRUE(runs(*source));
}

TEST(Mqtt, EndsWhileNoBrokerAnswers) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  const auto source = mqtt_source(free_port(), rings);
  source->start();
  ASSERT_TRUE(until([&] { return source->status().state == SourceState::waiting; }));
  const auto begin = std::chrono::steady_clock::now();
  source->stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
}

TEST(Mqtt, GivesBackWhatAFullRingDidNotTake) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  const Mosquitto broker;
  const TemporaryFolder folder;
  constexpr std::uint64_t kFrames = 1000;
  Rings rings(folder.path(), {"x"}, 16'000);  // 12 000 can be unread, less a second
  auto source = mqtt_source(broker.port(), rings);
  source->start();
  ASSERT_TRUE(runs(*source));
  MqttSender sender(broker.port());
  for (std::uint64_t k = 0; k < kFrames; ++k) sender.send("machines/x/samples", frame_of("", k * kFrame));
  sender.finish();
  Ring& ring = rings.ring("x");
  ASSERT_TRUE(until([&] { return ring.end() > 9000; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  const std::uint64_t full = ring.end();
  EXPECT_LT(full, kFrames * kFrame);
  source->stop();  // while it waits
  EXPECT_EQ(ring.end(), full);
  source = mqtt_source(broker.port(), rings);
  source->start();
  std::uint64_t wrong = 0, read = 0;
  EXPECT_TRUE(until([&] {
    const Piece piece = ring.piece(read);
    for (std::size_t k = 0; k < piece.samples; ++k) wrong += piece.values[3 * k] != value_of(read + k, 0);
    read += piece.samples;
    ring.set_read(read);
    return read >= kFrames * kFrame;
  })) << read;
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(ring.next_sample(), kFrames * kFrame);
  EXPECT_EQ(rings.intake("x").counters().missing, 0U);
  EXPECT_EQ(rings.intake("x").counters().lost, 0U);
}

TEST(Mqtt, NamesWhatIsWrongAndGoesOn) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  const Mosquitto broker;
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x", "y"});
  const auto source = mqtt_source(broker.port(), rings);
  source->start();
  ASSERT_TRUE(runs(*source));
  MqttSender sender(broker.port());
  const std::string topic = "machines/x/samples";
  sender.send(topic, frame_of("", 0));
  sender.send(topic, "this is no frame");
  sender.send(topic, std::string_view(frame_of("", kFrame)).substr(0, 100));  // its end does not come
  sender.send(topic, "");
  sender.send(topic, frame_of("", kFrame, kFrame, 1000.0));
  sender.send("machines/z/samples", frame_of("", 0));
  sender.send("machines/y/samples", frame_of("", 0));
  sender.send(topic, frame_of("", kFrame) + frame_of("", 2 * kFrame));
  ASSERT_TRUE(until([&] { return rings.ring("x").end() == 3 * kFrame; })) << rings.ring("x").end();
  source->stop();
  expect_stored(rings.ring("x"), 3 * kFrame);
  expect_stored(rings.ring("y"), kFrame);
  const FaultLog& faults = rings.intake("x").faults();
  EXPECT_EQ(faults.count(Fault::format), 2U) << faults.example(Fault::format);
  EXPECT_EQ(faults.count(Fault::rate), 1U);
  EXPECT_EQ(rings.intake("y").faults().total(), 0U);
  const SourceStatus status = source->status();
  EXPECT_EQ(status.messages, 8U);
  EXPECT_EQ(status.unknown, 1U);
  EXPECT_NE(status.text.find("'machines/z/samples' tells of axis 'z'"), std::string::npos) << status.text;
}

TEST(Mqtt, LetsInWhoHasTheRightPassword) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  RESONID_REQUIRE_PROGRAM("mosquitto_passwd");
  const TemporaryFolder folder;
  const auto passwords = folder.file("passwords", "");
  Program({"mosquitto_passwd", "-b", passwords.string(), "drive", "a secret"}).end(0);
  ASSERT_GT(std::filesystem::file_size(passwords), 20U);
  const Mosquitto broker("allow_anonymous false\npassword_file " + passwords.string());
  Rings rings(folder.path(), {"x"});
  for (const bool right : {false, true}) {
    MqttSourceSettings settings = settings_of(broker);
    settings.broker.access.credentials = Credentials{"drive", right ? "a secret" : "another"};
    const auto source = make_mqtt_source(settings, rings).value().release();
    const std::unique_ptr<Source> owner(source);
    source->start();
    ASSERT_TRUE(until([&] { return source->status().state != SourceState::starting; }));
    EXPECT_EQ(source->status().state, right ? SourceState::running : SourceState::waiting)
        << source->status().text;
    if (!right) {
      EXPECT_NE(source->status().text.find("uthori"), std::string::npos) << source->status().text;
    }
  }
}

TEST(Mqtt, TrustsOnlyWhomItKnows) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  RESONID_REQUIRE_PROGRAM("openssl");
  const TemporaryFolder folder;
  for (const char* name : {"right", "wrong"}) make_certificate(folder, name);
  const Mosquitto broker("allow_anonymous true\ncertfile " + (folder / "right.pem").string() + "\nkeyfile " +
                         (folder / "right.key").string());
  for (const MqttVersion version : {MqttVersion::v3_1_1, MqttVersion::v5}) {
    for (const std::string name : {"right", "wrong"}) {
      Rings rings(folder.path(), {"x"});
      MqttSourceSettings settings = settings_of(broker);
      settings.broker.version = version;
      settings.broker.host = "localhost";
      settings.broker.access.tls = Tls{folder / (name + ".pem"), {}, {}};
      const auto source = std::move(make_mqtt_source(settings, rings).value());
      source->start();
      ASSERT_TRUE(until([&] { return source->status().state != SourceState::starting; }));
      EXPECT_EQ(source->status().state, name == "right" ? SourceState::running : SourceState::waiting)
          << name << " " << source->status().text;
      if (name == "wrong") continue;
      const std::uint64_t next = rings.ring("x").next_sample();
      MqttSender sender(broker.port(), (folder / "right.pem").string());
      sender.send("machines/x/samples", frame_of("", next));
      EXPECT_TRUE(until([&] { return rings.ring("x").end() == next + kFrame; }));
    }
  }
}

TEST(Mqtt, RefusesWhatCannotWork) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  MqttSourceSettings settings;
  settings.topics = {{"a/+/b", {SampleFormat::frame}}};
  RESONID_EXPECT_MESSAGE(make_mqtt_source(settings, rings), "client id");
  settings.broker.client_id = "c";
  settings.topics = {{"a/#/b", {SampleFormat::frame}}};
  RESONID_EXPECT_MESSAGE(make_mqtt_source(settings, rings), "'a/#/b' is no filter");
  settings.topics = {};
  RESONID_EXPECT_MESSAGE(make_mqtt_source(settings, rings), "at least one filter");
  settings.topics = {{"a", {SampleFormat::frame}}};
  settings.broker.access.tls = Tls{folder / "absent.pem", {}, {}};
  const auto source = std::move(make_mqtt_source(settings, rings).value());
  source->start();
  EXPECT_EQ(source->status().state, SourceState::failed);
  EXPECT_NE(source->status().text.find("absent.pem"), std::string::npos);
}

TEST(Mqtt, ReadsTextOfEachTopicByItself) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  const Mosquitto broker;
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"c", "j", "m/l"});
  MqttSourceSettings settings = settings_of(broker);
  settings.topics = {{"csv/+", {SampleFormat::csv, {"ru", "u", "y"}, {}}},
                     {"json", {SampleFormat::json, {}, "j"}},
                     {"lines/+", {SampleFormat::line_protocol, {}, {}}}};
  const auto source = std::move(make_mqtt_source(settings, rings).value());
  source->start();
  ASSERT_TRUE(runs(*source));
  MqttSender sender(broker.port());
  for (std::uint64_t k = 0; k < 100; ++k) {
    const std::string ru = std::to_string(value_of(k, 0)), u = std::to_string(value_of(k, 1)),
                      y = std::to_string(value_of(k, 2)), sample = std::to_string(k);
    sender.send("csv/c", ru + "," + u + "," + y);
    sender.send("json", "{\"ru\":" + ru + ",\"u\":" + u + ",\"y\":" + y + ",\"sample\":" + sample + "}");
    sender.send("lines/m", "l ru=" + ru + ",u=" + u + ",y=" + y + ",sample=" + sample + "i");
  }
  EXPECT_TRUE(until([&] { return rings.ring("m/l").end() == 100 && rings.ring("c").end() == 100; }))
      << source->status().text;
  source->stop();
  for (const char* name : {"c", "j", "m/l"}) expect_stored(rings.ring(name), 100);
}

}  // namespace
}  // namespace resonid::monitor::test
