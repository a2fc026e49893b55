// SPDX-License-Identifier: MIT
#include "monitor/sources/udp_source.hpp"

#include "client.hpp"
#include "installation.hpp"

namespace resonid::monitor {
namespace {

using test::TemporaryFolder;

std::unique_ptr<NetworkSource> started(UdpSettings settings, Axes& axes) {
  auto source = required(make_udp_source(std::move(settings), axes));
  source->start();
  EXPECT_TRUE(eventually([&] { return source->bound_port() != 0; }));
  return source;
}

TEST(UdpSource, TakesFramesOfBothFamilies) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x", "y"});
  const auto source = started({":0"}, axes);
  const Client v4(source->bound_port(), SOCK_DGRAM), v6(source->bound_port(), SOCK_DGRAM, AF_INET6);
  ASSERT_TRUE(v4.send(frame_of("x", 0, 50)));
  ASSERT_TRUE(v6.send(frame_of("y", 0, 20) + frame_of("y", 20, 5)));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 50 && axes.end("y") == 25; }));
  axes.expect_exactly("x", 50);
  axes.expect_exactly("y", 25);
}

TEST(UdpSource, TakesLinesAndForgetsHalfOnes) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const auto source = started({"127.0.0.1:0", Format{SampleFormat::csv, {"sample", "u", "y"}}}, axes);
  const Client client(source->bound_port(), SOCK_DGRAM);
  ASSERT_TRUE(client.send("0,0,0\n1,0.5,-1\n2,"));
  ASSERT_TRUE(client.send("2,1,-2\n3,1.5,-3"));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 4; }));
  axes.expect_exactly("x", 4);
  EXPECT_EQ(axes.intake("x").faults().count(Fault::format), 1U);
}

TEST(UdpSource, CountsGarbageAndDuplicatesAndReversedAndHalfFrames) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  const auto source = started({"localhost:0"}, axes);
  const Client client(source->bound_port(), SOCK_DGRAM);
  const auto send = [&](std::string_view bytes) { ASSERT_TRUE(client.send(bytes)); };
  send(frame_of("x", 0, 10));
  send(frame_of("x", 20, 10));
  send(frame_of("x", 10, 10));  // late: the gap was filled
  send(frame_of("x", 20, 10));  // again
  send("garbage");
  send(frame_of("x", 30, 10).substr(0, 100));
  send(frame_of("x", 30, 10, 2000.0));
  send(encoded(Question{"x"}));
  send(frame_of("nobody", 0, 1));
  send(frame_of("x", 30, 10));
  ASSERT_TRUE(eventually([&] { return axes.end("x") == 40; }));
  const SampleCounters& counters = axes.intake("x").counters();
  EXPECT_EQ(counters.missing, 10U);
  EXPECT_EQ(counters.late, 10U);
  EXPECT_EQ(counters.duplicate, 10U);
  EXPECT_EQ(counters.lost, 10U);
  EXPECT_EQ(axes.intake("x").faults().count(Fault::rate), 1U);
  EXPECT_EQ(axes.intake("x").faults().count(Fault::format), 3U);
  EXPECT_EQ(source->status().unknown, 1U);
}

TEST(UdpSource, CountsEveryDatagramThatOverflows) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"}, 1U << 20U);
  const auto source = started({"127.0.0.1:0", Format{SampleFormat::frame}, 4096}, axes);
  const Client client(source->bound_port(), SOCK_DGRAM);
  std::uint64_t sent = 0;
  for (; sent < 20'000; ++sent) ASSERT_TRUE(client.send(frame_of("x", 10 * sent, 10)));
  const auto seen = [&] {
    const SourceStatus status = source->status();
    return status.messages + status.lost;
  };
  // What was lost last is told with the next datagram.
  ASSERT_TRUE(eventually([&] {
    pause_ms(1);
    EXPECT_TRUE(client.send(frame_of("x", 10 * sent++, 10)));
    return eventually([&] { return seen() == sent; }, 0.5);
  }));
  const std::uint64_t lost = source->status().lost;
  EXPECT_GT(lost, 0U);
  const auto& counters = axes.intake("x").counters();
  // A message after a gap of more than 10 s of samples, which took no time here, is refused.
  EXPECT_EQ(counters.samples + counters.lost, 10 * (sent - lost));
  EXPECT_EQ(counters.missing, axes.ring("x").next_sample() - counters.samples);
}

TEST(UdpSource, DropsAndCountsWhatComesWhileARingIsFull) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x", "y"}, 8192);
  const auto source = started({"127.0.0.1:0"}, axes);
  const Client client(source->bound_port(), SOCK_DGRAM);
  for (std::uint64_t k = 0; k < 8000; k += 100) {
    ASSERT_TRUE(client.send(frame_of("x", k, 100)));
    ASSERT_TRUE(eventually([&] { return source->status().messages == k / 100 + 1; }));
  }
  ASSERT_TRUE(client.send(frame_of("y", 0, 10)));
  ASSERT_TRUE(eventually([&] { return axes.end("y") == 10; }));
  const std::uint64_t lost = source->status().lost;
  EXPECT_GT(lost, 0U);
  EXPECT_EQ(axes.end("x") + 100 * lost, 8000U);
  EXPECT_EQ(axes.intake("x").counters().lost, 100 * lost);
}

TEST(UdpSource, WaitsForAPortThatIsInUse) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {"x"});
  auto first = started({"127.0.0.1:0"}, axes);
  const std::string address = "127.0.0.1:" + std::to_string(first->bound_port());
  const auto second = required(make_udp_source({address}, axes));
  second->start();
  ASSERT_TRUE(eventually([&] { return second->status().state == SourceState::waiting; }));
  EXPECT_NE(second->status().text.find("cannot listen on " + address + ": Address already in use"),
            std::string::npos)
      << second->status().text;
  first.reset();
  EXPECT_TRUE(eventually([&] { return second->status().state == SourceState::running; }));
}

TEST(UdpSource, RefusesWhatIsNoAddress) {
  const TemporaryFolder folder;
  Installation axes(folder.path(), {});
  for (const char* text : {"", "localhost", "localhost:", "localhost:65536", "localhost:-1", "::1:80",
                           "[::1]", "[localhost]:1", "a b:1", "unix:/tmp/x", "host:1x"})
    RESONID_EXPECT_MESSAGE(make_udp_source({text}, axes), "address");
  RESONID_EXPECT_MESSAGE(make_udp_source({":0", Format{SampleFormat::frame}, 0}, axes),
                         "receive_buffer_bytes");
}

}  // namespace
}  // namespace resonid::monitor
