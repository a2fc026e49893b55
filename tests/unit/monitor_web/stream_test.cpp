// SPDX-License-Identifier: MIT
// Server-Sent Events over real sockets.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "fake_backend.hpp"
#include "monitor/web/server.hpp"
#include "web_client.hpp"

namespace resonid::monitor::web {
namespace {

using nlohmann::json;
using test::an_alarm;
using test::an_axis;
using test::ask;
using test::open_stream;
using test::WebClient;

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

class WebStream : public testing::Test {
 protected:
  WebStream() {
    options_.limits.requests_per_second = 1e6;
    options_.limits.burst = 1e6;
  }
  std::uint16_t start() {
    auto started = WebServer::start(backend_, options_);
    EXPECT_TRUE(started) << started.error().requirement;
    server_ = std::move(*started);
    return server_->port();
  }

  test::FakeBackend backend_;
  WebOptions options_;
  std::unique_ptr<WebServer> server_;
};

TEST_F(WebStream, BeginsWithHelloAndBringsWhatChanges) {
  auto stream = open_stream(start());
  const auto hello = stream.event();
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->name, "hello");
  EXPECT_EQ(json::parse(hello->data).at("resumed"), false);
  ASSERT_TRUE(stream.event_named("frame"));
  backend_.set({an_axis("x", 7.0)});
  for (;;) {
    const auto frame = stream.event_named("frame");
    ASSERT_TRUE(frame);
    EXPECT_FALSE(frame->id.empty());
    const auto axes = json::parse(frame->data).at("axes");
    if (axes.contains("x") && axes["x"]["figures"]["resonance_hz"]["value"] == 7.0) break;
  }
  server_->alarm(an_alarm(17));
  const auto alarm = stream.event_named("alarm");
  ASSERT_TRUE(alarm);
  EXPECT_EQ(json::parse(alarm->data).at("id"), 17);
}

TEST_F(WebStream, OneAxisIsForThoseWhoAskForIt) {
  const auto port = start();
  EXPECT_EQ(ask(port, "GET", "/api/v1/stream?axis=a/b").status, 400);
  EXPECT_EQ(ask(port, "GET", "/api/v1/stream?axis=z").status, 404);
  auto all = open_stream(port), x = open_stream(port, "?axis=x");
  std::atomic<bool> end{false};
  std::thread changes([&] {
    for (int i = 0; !end; ++i) {
      backend_.set({an_axis("x", i), an_axis("y", i)});
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  const auto axis = x.event_named("axis"), response = x.event_named("response");
  ASSERT_TRUE(axis && response);
  EXPECT_EQ(json::parse(axis->data).at("name"), "x");
  EXPECT_EQ(json::parse(response->data).at("axis"), "x");
  for (int i = 0; i < 20; ++i) {
    const auto event = all.event();
    ASSERT_TRUE(event);
    EXPECT_TRUE(event->name == "frame" || event->name == "hello") << event->name;
  }
  end = true;
  changes.join();
}

TEST_F(WebStream, ResumesWithTheAlarmsThatWereMissed) {
  const auto port = start();
  auto first = open_stream(port);
  server_->alarm(an_alarm(1));
  const auto seen = first.event_named("alarm");
  ASSERT_TRUE(seen);
  first.close();
  server_->alarm(an_alarm(2));
  server_->alarm(an_alarm(3));
  auto again = open_stream(port, "", {{"Last-Event-ID", seen->id}});
  server_->alarm(an_alarm(4));
  for (const int id : {2, 3, 4}) {
    const auto alarm = again.event_named("alarm");
    ASSERT_TRUE(alarm);
    EXPECT_EQ(json::parse(alarm->data).at("id"), id);
  }
}

TEST_F(WebStream, SilenceIsFilledWithComments) {
  options_.limits.keep_alive_s = 0.2;
  options_.frames_per_second = 0.1;
  auto stream = open_stream(start());
  int comments = 0;
  for (int i = 0; i < 4; ++i) {
    const auto event = stream.event(2.0);
    ASSERT_TRUE(event);
    comments += event->name.empty();
  }
  EXPECT_GE(comments, 2);
}

TEST_F(WebStream, ASlowReaderSkipsFramesButNoAlarm) {
  std::vector<AxisStatus> axes;
  for (int i = 0; i < 200; ++i) axes.push_back(an_axis(fmt::format("axis-{}", i), 1.0 / 3.0));
  options_.frames_per_second = 50.0;
  options_.limits.stalled_s = 120.0;
  const auto port = start();
  auto slow = open_stream(port);
  auto quick = open_stream(port);
  std::atomic<bool> end{false};
  std::atomic<int> received{0};
  std::thread reader([&] {
    while (!end)
      if (const auto event = quick.event(1.0); event && event->name == "frame") ++received;
  });
  // 3 s or more during which the slow one reads nothing
  const double begin = now_s();
  for (int i = 0; i < 150 || (received <= 100 && now_s() < begin + 30.0); ++i) {
    backend_.set(axes);
    if (i < 150 && i % 10 == 0) server_->alarm(an_alarm(100 + static_cast<std::uint64_t>(i)));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  end = true;
  reader.join();
  const double stopped = now_s();
  int frames = 0;
  std::vector<std::uint64_t> alarms;
  double newest = 0.0;
  while (const auto event = slow.event(1.0)) {
    if (event->name == "alarm") alarms.push_back(json::parse(event->data).at("id"));
    if (event->name != "frame") continue;
    newest = json::parse(event->data).at("time_s");
    ++frames;
    if (now_s() > stopped + 3.0) break;
  }
  ASSERT_EQ(alarms.size(), 15U);
  for (std::size_t i = 0; i < alarms.size(); ++i) EXPECT_EQ(alarms[i], 100U + 10U * i);
  EXPECT_GT(received, 100);
  EXPECT_LT(frames, received / 2);
  EXPECT_GT(newest, stopped - 0.5);  // and is soon where the others are
}

TEST_F(WebStream, AReaderWhoStallsForGoodIsGivenUp) {
  options_.limits.stalled_s = 0.5;
  options_.frames_per_second = 50.0;
  std::vector<AxisStatus> axes;
  for (int i = 0; i < 200; ++i) axes.push_back(an_axis(fmt::format("axis-{}", i)));
  const auto port = start();
  auto stalled = open_stream(port);
  const auto streams = [&] {
    return ask(port, "GET", "/metrics").body.find("\nresonid_http_streams 1\n") != std::string::npos;
  };
  EXPECT_TRUE(streams());
  const double until = now_s() + 20.0;
  while (streams() && now_s() < until) {
    backend_.set(axes);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_FALSE(streams());
}

TEST_F(WebStream, ThirtyPagesGetFramesAtOnce) {
  constexpr int kPages = 30, kAxes = 100;
  std::vector<AxisStatus> axes;
  for (int i = 0; i < kAxes; ++i) axes.push_back(an_axis(fmt::format("axis-{}", i), 1.0 / 3.0));
  backend_.set(axes);
  const auto port = start();
  std::vector<WebClient> pages;
  for (int i = 0; i < kPages; ++i) pages.push_back(open_stream(port, i % 3 == 0 ? "?axis=axis-1" : ""));
  std::atomic<bool> end{false};
  std::thread changes([&] {
    while (!end) {
      backend_.set(axes);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  std::vector<double> latency_s;
  std::size_t bytes = 0;
  std::vector<::pollfd> waits;
  for (const auto& page : pages) waits.push_back({page.fd(), POLLIN, 0});
  const double until = now_s() + 5.0;
  while (now_s() < until) {
    ::poll(waits.data(), waits.size(), 100);
    for (std::size_t i = 0; i < pages.size(); ++i) {
      if (!(waits[i].revents & POLLIN)) continue;
      pages[i].receive(0.0);
      while (const auto event = pages[i].event(0.0)) {
        bytes += event->data.size();
        if (event->name != "frame") continue;
        latency_s.push_back(now_s() - std::stod(event->data.substr(event->data.find(':') + 1)));
      }
    }
  }
  end = true;
  changes.join();
  ASSERT_GT(latency_s.size(), 1000U);
  std::sort(latency_s.begin(), latency_s.end());
  const double p99 = latency_s[latency_s.size() * 99 / 100];
  fmt::print(
      "{} pages, {} axes: {:.1f} frames/s each, {:.1f} MB/s in all, publish to receipt median {:.1f} ms, p99 "
      "{:.1f} ms\n",
      kPages, kAxes, static_cast<double>(latency_s.size()) / kPages / 5.0, static_cast<double>(bytes) / 5e6,
      1e3 * latency_s[latency_s.size() / 2], 1e3 * p99);
  EXPECT_LT(p99, 0.25);
}

}  // namespace
}  // namespace resonid::monitor::web
