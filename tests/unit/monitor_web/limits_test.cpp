// SPDX-License-Identifier: MIT
// What clients may take of the server, over real sockets.
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <sys/resource.h>

#include <atomic>
#include <filesystem>
#include <thread>
#include <vector>

#include "fake_backend.hpp"
#include "monitor/web/channel.hpp"
#include "monitor/web/server.hpp"
#include "web_client.hpp"

namespace resonid::monitor::web {
namespace {

using test::ask;
using test::open_stream;
using test::request_text;
using test::WebClient;
using Clock = std::chrono::steady_clock;

class WebLimitsTest : public testing::Test {
 protected:
  WebLimitsTest() {
    options.limits.requests_per_second = 1e6;
    options.limits.burst = 1e6;
  }
  std::uint16_t start() {
    auto started = WebServer::start(backend, options);
    EXPECT_TRUE(started) << started.error().requirement;
    server = std::move(*started);
    return server->port();
  }
  /// A figure of /metrics.
  double metric(const std::string& name) {
    const auto text = ask(server->port(), "GET", "/metrics").body;
    const auto at = text.find("\n" + name + " ");
    return at == std::string::npos ? -1.0 : std::stod(text.substr(at + name.size() + 2));
  }

  test::FakeBackend backend;
  WebOptions options;
  std::unique_ptr<WebServer> server;
};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

TEST_F(WebLimitsTest, SeveralRequestsOnOneConnectionEvenAtOnce) {
  WebClient client(start());
  const auto axis = request_text("GET", "/api/v1/axes/x");
  const auto done = request_text("POST", "/api/v1/alarms/1/acknowledge", R"({"who":"Ann"})");
  client.send(axis + done + axis);
  EXPECT_EQ(client.reply().status, 200);
  EXPECT_EQ(client.reply().status, 202);
  EXPECT_EQ(client.reply().status, 200);
  client.send(axis);
  EXPECT_EQ(client.reply().status, 200);
  client.send(request_text("GET", "/healthz", {}, {{"Connection", "close"}}));
  EXPECT_EQ(client.reply().status, 200);
  EXPECT_TRUE(client.closes(2.0));
}

TEST_F(WebLimitsTest, RequestsInPieces) {
  WebClient client(start());
  for (const char c : request_text("POST", "/api/v1/alarms/1/acknowledge", R"({"who":"Ann"})")) {
    client.send({&c, 1});
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  EXPECT_EQ(client.reply().status, 202);
}

TEST_F(WebLimitsTest, TooMuchIsRefusedAndTold) {
  const auto port = start();
  const auto head = [](std::size_t length) {
    return fmt::format(
        "POST /api/v1/alarms/1/acknowledge HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        "Content-Length: {}\r\n\r\n",
        length);
  };
  const auto status = [&](const std::string& request) {
    WebClient client(port);
    client.send(request);
    const auto reply = client.reply();
    EXPECT_TRUE(client.closes(3.0));
    return reply.status;
  };
  EXPECT_EQ(status(head(65'537)), 413);
  EXPECT_EQ(status(head(200'000) + std::string(200'000, ' ')), 413);  // the answer outlives what is under way
  EXPECT_EQ(status("GET / HTTP/1.1\r\nHost: localhost\r\nA: " + std::string(20'000, 'a') + "\r\n\r\n"), 431);
  EXPECT_EQ(status("GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"), 411);
  EXPECT_EQ(status("GET /" + std::string(9'000, 'a') + " HTTP/1.1\r\nHost: localhost\r\n\r\n") / 100, 4);
  EXPECT_EQ(status("\x16\x03\x01 what TLS begins with\r\n\r\n"), 400);
  EXPECT_EQ(status("GET\r\n\r\n"), 400);
  WebClient whole(port);
  const std::string body = R"({"who":"Ann"})";
  whole.send(head(65'536) + body + std::string(65'536 - body.size(), ' '));
  EXPECT_EQ(whole.reply().status, 202);
}

TEST_F(WebLimitsTest, HalfRequestsEnd) {
  options.limits.request_s = 0.5;
  options.limits.idle_s = 1.0;
  const auto port = start();
  WebClient half(port), trickle(port), silent(port), gone(port);
  half.send("GET /api/v1/axes HTTP/1.1\r\nHost: local");
  gone.send("GET /api/v1/axes HTT");
  gone.close();
  std::atomic<bool> end{false};
  std::thread slow([&] {  // one byte after the other: never silent, never done
    while (!end && trickle.send("a")) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  });
  const auto began = Clock::now();
  EXPECT_EQ(half.reply(3.0).status, 408);
  EXPECT_EQ(trickle.reply(3.0).status, 408);
  EXPECT_LT(seconds_since(began), 2.0);
  EXPECT_TRUE(silent.closes(3.0));
  end = true;
  slow.join();
  EXPECT_EQ(ask(port, "GET", "/healthz").status, 200);
}

TEST_F(WebLimitsTest, TooManyConnectionsAreTold) {
  options.limits.connections = 8;
  options.limits.streams = 8;
  const auto port = start();
  std::vector<WebClient> clients;
  for (int i = 0; i < 8; ++i) clients.push_back(open_stream(port));
  WebClient refused(port);
  const auto reply = refused.reply();
  EXPECT_EQ(reply.status, 503);
  EXPECT_EQ(reply.headers.at("retry-after"), "2");
  EXPECT_TRUE(refused.closes(3.0));
  clients.pop_back();
  const auto began = Clock::now();
  int status = 503;
  while (status == 503 && seconds_since(began) < 3.0) status = ask(port, "GET", "/healthz").status;
  EXPECT_EQ(status, 200);
}

TEST_F(WebLimitsTest, TooManyStreamsAreTold) {
  options.limits.streams = 3;
  const auto port = start();
  std::vector<WebClient> clients;
  for (int i = 0; i < 3; ++i) clients.push_back(open_stream(port));
  const auto reply = ask(port, "GET", "/api/v1/stream");
  EXPECT_EQ(reply.status, 503);
  EXPECT_TRUE(reply.headers.contains("retry-after"));
  EXPECT_EQ(ask(port, "GET", "/api/v1/axes").status, 200);
  EXPECT_EQ(metric("resonid_http_streams"), 3.0);
  clients.pop_back();
  const auto began = Clock::now();
  while (metric("resonid_http_streams") > 2.0 && seconds_since(began) < 3.0) {
  }
  const auto again = open_stream(port);
}

/// One of this machine's addresses that other machines have, too; 0: it has none.
::in_addr_t outer_address() {
  ::ifaddrs* all = nullptr;
  ::in_addr_t found = 0;
  if (::getifaddrs(&all) != 0) return 0;
  for (const auto* i = all; i != nullptr && found == 0; i = i->ifa_next)
    if (i->ifa_addr != nullptr && i->ifa_addr->sa_family == AF_INET && !(i->ifa_flags & IFF_LOOPBACK))
      found = reinterpret_cast<const ::sockaddr_in*>(i->ifa_addr)->sin_addr.s_addr;
  ::freeifaddrs(all);
  return found;
}

TEST_F(WebLimitsTest, OneClientLeavesStreamsToTheOthers) {
  const auto outer = outer_address();
  if (outer == 0) GTEST_SKIP() << "this machine has no address besides loopback";
  options.listening.address = "0.0.0.0";
  options.limits.streams = 4;
  options.limits.client_streams = 2;
  const auto port = start();
  const auto opened = [&] {
    WebClient client(port, outer);
    client.send(request_text("GET", "/api/v1/stream"));
    auto reply = client.reply();
    return std::pair(std::move(client), std::move(reply));
  };
  auto first = opened();
  const auto second = opened(), refused = opened();
  EXPECT_EQ(first.second.status, 200);
  EXPECT_EQ(second.second.status, 200);
  EXPECT_EQ(refused.second.status, 429);
  EXPECT_TRUE(refused.second.headers.contains("retry-after"));
  EXPECT_NE(refused.second.body.find(R"("field":"streams")"), std::string::npos);
  const auto other = open_stream(port), another = open_stream(port);  // of this machine
  first.first.close();
  const auto began = Clock::now();
  int status = 429;
  while (status != 200 && seconds_since(began) < 3.0) status = opened().second.status;
  EXPECT_EQ(status, 200);  // one that ends makes room for the next
}

TEST_F(WebLimitsTest, OneClientLeavesConnectionsToTheOthers) {
  const auto outer = outer_address();
  if (outer == 0) GTEST_SKIP() << "this machine has no address besides loopback";
  options.listening.address = "0.0.0.0";
  options.limits.client_connections = 3;
  const auto port = start();
  std::vector<WebClient> clients;
  for (int i = 0; i < 3; ++i) {
    clients.emplace_back(port, outer);
    clients.back().send(request_text("GET", "/healthz"));
    EXPECT_EQ(clients.back().reply().status, 200);
  }
  WebClient refused(port, outer);
  const auto reply = refused.reply();
  EXPECT_EQ(reply.status, 429);
  EXPECT_NE(reply.body.find(R"("field":"connections")"), std::string::npos);
  std::vector<WebClient> own;  // of this machine
  for (int i = 0; i < 5; ++i) {
    own.emplace_back(port);
    own.back().send(request_text("GET", "/healthz"));
    EXPECT_EQ(own.back().reply().status, 200);
  }
  clients.pop_back();
  const auto began = Clock::now();
  int status = 429;
  while (status != 200 && seconds_since(began) < 3.0) {
    WebClient next(port, outer);
    next.send(request_text("GET", "/healthz"));
    status = next.reply().status;
  }
  EXPECT_EQ(status, 200);
}

TEST(WebClients, KnowsThisMachineByItsAddress) {
  for (const auto* own : {"127.0.0.1", "127.8.0.1", "::", "::ffff:127.0.0.1"})
    EXPECT_TRUE(is_this_machine(own)) << own;
  for (const auto* other : {"192.0.2.7", "12.127.0.0", "2001:db8::", "fe80::", "::ffff:192.0.2.7"})
    EXPECT_FALSE(is_this_machine(other)) << other;
}

TEST_F(WebLimitsTest, OneClientsRequestsAreLimited) {
  options.limits.requests_per_second = 5.0;
  options.limits.burst = 10.0;
  const auto port = start();
  int answered = 0;
  test::HttpReply refused;
  for (int i = 0; i < 30 && refused.status != 429; ++i) {
    refused = ask(port, "GET", "/healthz");
    answered += refused.status == 200;
  }
  EXPECT_EQ(refused.status, 429);
  EXPECT_TRUE(refused.headers.contains("retry-after"));
  EXPECT_GE(answered, 10);
  EXPECT_LE(answered, 20);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_EQ(ask(port, "GET", "/healthz").status, 200);
}

TEST_F(WebLimitsTest, ManyConnectionsThatAreOpenedAndLeft) {
  ::rlimit files{};
  ::getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = std::min<::rlim_t>(files.rlim_max, 8192);
  ::setrlimit(RLIMIT_NOFILE, &files);
  const int count = files.rlim_cur >= 4096 ? 2000 : 300;
  const auto port = start();
  const auto stream_began = Clock::now();
  auto stream = open_stream(port);
  std::vector<WebClient> left;
  for (int i = 0; i < count; ++i) {
    left.emplace_back(port);
    if (i % 3 == 0) left.back().send("GET /api/v1/axes HTTP/1.1\r\nHo");
    if (i % 7 == 0) left.back().close();
  }
  // Neither those that wait nor those that were refused keep others out for longer than a second.
  const auto began = Clock::now();
  int status = 0;
  while (status != 200 && seconds_since(began) < 10.0) status = ask(port, "GET", "/api/v1/axes").status;
  EXPECT_EQ(status, 200);
  EXPECT_LT(seconds_since(began), 3.0);
  backend.set({test::an_axis("x", 3.0)});
  EXPECT_TRUE(stream.event_named("frame"));
  fmt::print("{} connections left: answered after {:.2f} s, stream open for {:.1f} s\n", count,
             seconds_since(began), seconds_since(stream_began));
  left.clear();
  while (metric("resonid_http_connections") > 2.0 && seconds_since(began) < 10.0) {
  }
  EXPECT_EQ(metric("resonid_http_connections"), 2.0);
}

TEST_F(WebLimitsTest, OpenStreamsLeaveTheApiFree) {
  const auto port = start();
  std::vector<WebClient> streams;
  for (int i = 0; i < 64; ++i) streams.push_back(open_stream(port));
  const auto began = Clock::now();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(ask(port, "GET", "/api/v1/axes").status, 200);
  EXPECT_LT(seconds_since(began), 2.0);
}

TEST_F(WebLimitsTest, SlowReadersOfLongAnswersDisturbNobodyAndEnd) {
  options.limits.stalled_s = 1.0;
  options.limits.downloads = 20;
  options.limits.unsent_bytes = 1 << 30;
  const auto port = start();
  std::vector<WebClient> slow;
  for (int i = 0; i < 20; ++i) {  // more than there are workers
    slow.emplace_back(port);
    slow.back().send(request_text("GET", "/api/v1/axes/long/raw?from=1&to=2"));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_EQ(ask(port, "GET", "/api/v1/axes").status, 200);
  const auto began = Clock::now();
  while (metric("resonid_http_connections") > 1.0 && seconds_since(began) < 10.0)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(metric("resonid_http_connections"), 1.0);
}

const auto kDownload = request_text("GET", "/api/v1/axes/long/raw?from=1&to=2");

TEST_F(WebLimitsTest, DownloadsThatNobodyTakesKeepOutOnlyDownloads) {
  options.limits.downloads = 2;
  const auto port = start();
  std::vector<WebClient> slow;
  for (int i = 0; i < 2; ++i) {
    slow.emplace_back(port);
    slow.back().send(kDownload);
    ASSERT_TRUE(slow.back().receive(5.0));  // the answer has begun
  }
  const auto download = [&] { return ask(port, "GET", "/api/v1/axes/long/raw?from=1&to=2"); };
  const auto refused = download();
  EXPECT_EQ(refused.status, 503);
  EXPECT_TRUE(refused.headers.contains("retry-after"));
  EXPECT_NE(refused.body.find(R"("field":"downloads")"), std::string::npos);
  EXPECT_EQ(ask(port, "GET", "/api/v1/alarms/1/evidence.csv").status, 503);
  EXPECT_EQ(ask(port, "GET", "/api/v1/axes").status, 200);
  EXPECT_EQ(slow.front().reply().body.size(), 8'000'000U);
  EXPECT_EQ(download().status, 200);  // one that ends makes room, its connection open or not
  slow.back().close();
  const auto began = Clock::now();
  while (metric("resonid_http_connections") > 2.0 && seconds_since(began) < 3.0) {
  }
  WebClient again(port), another(port);
  for (auto* client : {&again, &another}) {
    client->send(kDownload);
    EXPECT_TRUE(client->receive(5.0));
  }
  EXPECT_EQ(again.reply().status, 200);
  EXPECT_EQ(another.reply().status, 200);
}

TEST_F(WebLimitsTest, AnswersThatNobodyTakesAreBounded) {
  options.limits.downloads = 8;
  options.limits.unsent_bytes = 12'000'000;
  const auto port = start();
  WebClient slow(port);
  slow.send(kDownload);
  ASSERT_TRUE(slow.receive(5.0));
  const auto refused = ask(port, "GET", "/api/v1/axes/long/raw?from=1&to=2");
  EXPECT_EQ(refused.status, 503);
  EXPECT_NE(refused.body.find(R"("field":"answers")"), std::string::npos);
  EXPECT_EQ(ask(port, "GET", "/uplot.js").status, 200);
  EXPECT_EQ(slow.reply().body.size(), 8'000'000U);
  EXPECT_EQ(ask(port, "GET", "/api/v1/axes/long/raw?from=1&to=2").status, 200);
}

TEST_F(WebLimitsTest, ADownloadThatIsAloneMayBeLonger) {
  options.limits.unsent_bytes = 20'000;
  const auto port = start();
  EXPECT_EQ(ask(port, "GET", "/api/v1/axes/long/raw?from=1&to=2").body.size(), 8'000'000U);
  EXPECT_EQ(ask(port, "GET", "/uplot.js").status, 503);
  EXPECT_EQ(ask(port, "GET", "/api/v1/axes").status, 200);
}

TEST_F(WebLimitsTest, AnAnswerThatIsTakenTooSlowlyEnds) {
  options.limits.answer_s = 0.5;
  options.limits.answer_bytes_per_second = 1e9;
  const auto port = start();
  WebClient trickle(port);
  trickle.send(kDownload);
  ASSERT_TRUE(trickle.receive(5.0));
  const auto began = Clock::now();
  while (metric("resonid_http_connections") > 1.0 && seconds_since(began) < 5.0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    trickle.receive(0.01);  // never stalls
  }
  EXPECT_LT(seconds_since(began), 2.5);
}

std::size_t open_files() {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) ++count;
  return count;
}

TEST_F(WebLimitsTest, StartsAndStopsWithoutATrace) {
  start();
  server = nullptr;
  const auto files = open_files();
  for (int i = 0; i < 10; ++i) {
    const auto port = start();
    auto stream = open_stream(port);
    WebClient half(port);
    half.send("GET / HT");
    const auto began = Clock::now();
    server->stop();
    EXPECT_LT(seconds_since(began), 1.0);
    EXPECT_TRUE(stream.closes(1.0));
    EXPECT_LT(WebClient(port).fd(), 0);
    server = nullptr;
  }
  EXPECT_EQ(open_files(), files);
}

TEST_F(WebLimitsTest, WhatIsBeingAnsweredIsSentBeforeTheEnd) {
  const auto port = start();
  WebClient client(port);
  client.send(request_text("GET", "/api/v1/axes/long/raw?from=1&to=2"));
  ASSERT_TRUE(client.receive(5.0));  // the answer has begun
  std::thread stop([&] { server->stop(); });
  EXPECT_EQ(client.reply().body.size(), 8'000'000U);
  stop.join();
}

}  // namespace
}  // namespace resonid::monitor::web
