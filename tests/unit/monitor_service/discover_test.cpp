// SPDX-License-Identifier: MIT
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <monitor/service/discover_bytes.hpp>
#include <monitor/service/discover_sources.hpp>
#include <thread>

#include "folder.hpp"

namespace resonid::monitor {
namespace {

Discovered frames_of(const std::string& name, const std::string& axis = {}, const std::string& stream = {}) {
  Discovered d;
  d.name = name;
  d.axis = axis;
  d.stream = stream;
  d.format = SampleFormat::frame;
  d.columns = {"ru", "u", "y"};
  d.told_rate_hz = 500.0;
  return d;
}

SourceConfig at(SourceKind kind) {
  SourceConfig where;
  where.kind = kind;
  where.connection.address = "broker:1883";
  return where;
}

TEST(DiscoveredSources, JoinTopicsThatDifferInOneLevel) {
  auto words = frames_of("hall/lamp/samples");
  words.format.reset();
  const std::vector<Discovered> found = {frames_of("hall/m1/samples"), frames_of("hall/m2/samples", "x"),
                                         words, frames_of("press")};
  const auto all = sources_of(found, at(SourceKind::mqtt));
  ASSERT_EQ(all.sources.size(), 2U);
  EXPECT_EQ(all.sources.at("mqtt").topic, "hall/+/samples");
  EXPECT_EQ(all.sources.at("mqtt").format, SampleFormat::frame);
  EXPECT_EQ(all.sources.at("mqtt").connection.address, "broker:1883");
  EXPECT_EQ(all.sources.at("mqtt-2").topic, "press");
  ASSERT_EQ(all.streams.size(), 3U);
  EXPECT_EQ(all.streams[0].axis, "m1");
  EXPECT_EQ(all.streams[1].axis, "m2/x");
  EXPECT_EQ(all.streams[2].axis, "press");
  EXPECT_EQ(all.streams[2].source, "mqtt-2");
  EXPECT_EQ(all.streams[2].sample_rate_hz, 500.0);
}

TEST(DiscoveredSources, ReadAStreamOfJetStreamRatherThanItsSubject) {
  const std::vector<Discovered> found = {frames_of("machines.x"), frames_of("machines.x", "", "SAMPLES"),
                                         frames_of("other", "a"), frames_of("other", "b")};
  const auto all = sources_of(found, at(SourceKind::nats));
  ASSERT_EQ(all.sources.size(), 2U);
  EXPECT_EQ(all.sources.at("nats").stream, "SAMPLES");
  EXPECT_EQ(all.sources.at("nats").subject, "machines.x");
  EXPECT_EQ(all.sources.at("nats-2").stream, "");
  ASSERT_EQ(all.streams.size(), 3U);
  EXPECT_EQ(all.streams[1].axis, "a");
  EXPECT_EQ(all.streams[2].source, "nats-2");
}

TEST(DiscoveredSources, NameColumnsOfNumbers) {
  Discovered numbers = frames_of("");
  numbers.format = SampleFormat::csv;
  numbers.columns = {"column 1", "column 2"};
  numbers.named = false;
  const auto all = sources_of(std::vector{numbers}, at(SourceKind::tcp));
  EXPECT_EQ(all.sources.at("tcp").columns, numbers.columns);
  EXPECT_EQ(all.streams.at(0).axis, "");
}

TEST(DiscoverFile, TakesNoRateFromTheSpeedOfReading) {
  const Folder folder;
  const auto path = folder.path() / "x.csv";
  {
    std::ofstream file(path);
    file << "ru,u,y\n";
    for (int k = 0; k < 50'000; ++k) file << "1,2,3\n";
  }
  const auto found = discover_file(path, 10.0, [] { return true; });
  ASSERT_TRUE(found);
  ASSERT_EQ(found->size(), 1U);
  EXPECT_EQ(found->front().sample_count, 50'000U);
  EXPECT_EQ(found->front().rate_hz(), 0.0);
  EXPECT_FALSE(discover_file(folder.path(), 1.0, [] { return true; }));
}

TEST(DiscoverFile, SaysThatItHoldsNoSamples) {
  const Folder folder;
  const auto path = folder.path() / "x.bin";
  for (const std::string& bytes : {std::string(), std::string(1000, '\0')}) {
    std::ofstream(path, std::ios::binary) << bytes;
    const auto found = discover_file(path, 10.0, [] { return true; });
    ASSERT_FALSE(found);
    EXPECT_NE(found.error().requirement.view().find("holds no samples"), std::string_view::npos);
  }
}

/// A client of frames gets answers, but nothing is acknowledged.
TEST(DiscoverTcp, AnswersWithoutAcknowledging) {
  constexpr std::uint16_t kPort = 0;
  const int probe = ::socket(AF_INET, SOCK_STREAM, 0);
  ::sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  name.sin_port = kPort;
  ::socklen_t length = sizeof name;
  ASSERT_EQ(::bind(probe, reinterpret_cast<::sockaddr*>(&name), length), 0);
  ASSERT_EQ(::getsockname(probe, reinterpret_cast<::sockaddr*>(&name), &length), 0);
  ::close(probe);
  std::atomic<bool> done{false};
  std::uint64_t next = 1;
  std::thread client([&] {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    while (::connect(socket, reinterpret_cast<const ::sockaddr*>(&name), sizeof name) != 0 && !done)
      std::this_thread::yield();
    const std::string_view columns[] = {"u", "y"};
    const double values[] = {1.0, 2.0, 3.0, 4.0};
    Arrival arrival;
    arrival.axis = "x";
    arrival.first_sample = 0;
    arrival.columns = columns;
    arrival.values = values;
    const std::string sent = encoded(Question{"x"}) + *encoded(arrival, ValueType::float64);
    EXPECT_EQ(::send(socket, sent.data(), sent.size(), MSG_NOSIGNAL), static_cast<::ssize_t>(sent.size()));
    FaultLog faults;
    FrameDecoder decoder(faults);
    int answers = 0;
    char byte = 0;
    while (answers < 2 && ::recv(socket, &byte, 1, 0) == 1)
      decoder.add({&byte, 1}, [&](const Message& message) {
        ++answers;
        next = std::get<Acknowledgement>(message).next_sample;
      });
    ::close(socket);
    done = true;
  });
  const auto found =
      discover_tcp("127.0.0.1:" + std::to_string(ntohs(name.sin_port)), 10.0, [&] { return !done; });
  done = true;
  client.join();
  ASSERT_TRUE(found);
  EXPECT_EQ(next, 0U);
  ASSERT_EQ(found->size(), 1U);
  EXPECT_EQ(found->front().axis, "x");
  EXPECT_EQ(found->front().sample_count, 2U);
}

}  // namespace
}  // namespace resonid::monitor
