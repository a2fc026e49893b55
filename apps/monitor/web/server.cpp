// SPDX-License-Identifier: MIT
#include "monitor/web/server.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "monitor/web/api.hpp"
#include "monitor/web/channel.hpp"
#include "monitor/web/feed.hpp"

namespace resonid::monitor::web {
namespace {

constexpr int kCaughtUp = 2;  // rounds, where one took longer than its time; no more after a halt

double unix_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

bool is_loopback(const std::string& address) {
  return address == "localhost" || address == "::1" || address.starts_with("127.");
}

}  // namespace

expected<void, Error> check(const WebOptions& options) {
  for (const auto& [field, token] :
       {std::pair("write_token", &options.write_token), std::pair("read_token", &options.read_token)}) {
    if (token->empty()) continue;
    if (token->size() < 16) return refuse(field, "must have at least 16 characters", double(token->size()));
    if (!std::all_of(token->begin(), token->end(), [](char c) { return c > ' ' && c <= '~'; }))
      return refuse(field, "must consist of printable ASCII characters without spaces");
  }
  if (!options.read_token.empty() && options.read_token == options.write_token)
    return refuse("read_token", "must differ from write_token, or whoever reads may write");
  if (!(options.frames_per_second >= 0.1 && options.frames_per_second <= 50.0))
    return refuse("frames_per_second", "must be 0.1 ... 50", options.frames_per_second);
  const auto& limits = options.limits;
  if (limits.workers < 1 || limits.workers > 64) return refuse("workers", "must be 1 ... 64", limits.workers);
  if (limits.connections < 1) return refuse("connections", "must be at least 1", limits.connections);
  if (limits.streams > limits.connections)
    return refuse("streams", "must not exceed connections", limits.streams);
  if (limits.downloads < 1) return refuse("downloads", "must be at least 1", limits.downloads);
  if (!(limits.answer_bytes_per_second > 0.0)) return refuse("answer_bytes_per_second", "must be > 0");
  if (!(limits.requests_per_second > 0.0)) return refuse("requests_per_second", "must be > 0");
  if (!(limits.burst >= 1.0)) return refuse("burst", "must be at least 1", limits.burst);
  if (const auto tls = tls_context(options.listening); !tls) return unexpected<Error>(tls.error());
  return {};
}

struct WebServer::Parts {
  Parts(Backend& backend, const WebOptions& given, std::unique_ptr<Sockets> open)
      : options(given),
        sockets(std::move(open)),
        feed(backend, static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()),
             [this](FeedEvent event) { sockets->send(std::move(event)); }) {
    const ApiParts parts{backend,
                         {is_loopback(options.listening.address), !options.listening.key_file.empty(),
                          options.host_names, options.write_token, options.read_token},
                         [this] {
                           const auto counts = sockets->counts();
                           return WebCounts{counts.connections, counts.streams, counts.refused,
                                            counts.responses,   feed.frames(),  counts.skipped_frames};
                         },
                         unix_time_s,
                         Downloads(options.limits.downloads)};
    sockets->start(
        [parts] { return make_answerer(parts); },
        [this](const std::string& last_event_id) { return feed.begin(last_event_id, unix_time_s()); });
    publisher = std::thread([this] { publish(); });
  }

  void publish() {
    using Clock = std::chrono::steady_clock;
    const auto interval = std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(1.0 / options.frames_per_second));
    auto next = Clock::now();
    std::unique_lock lock(mutex);
    while (!ends) {
      lock.unlock();
      try {
        if (sockets->counts().streams > 0) feed.round(unix_time_s(), sockets->watched());
      } catch (const std::exception&) {  // of memory, or of the rest of the service: the next round may do
      }
      lock.lock();
      next = std::max(next + interval, Clock::now() - kCaughtUp * interval);
      ended.wait_until(lock, next, [this] { return ends; });
    }
  }

  void stop() {
    {
      const std::lock_guard lock(mutex);
      ends = true;
    }
    ended.notify_all();
    if (publisher.joinable()) publisher.join();
    sockets->stop();
  }

  WebOptions options;
  std::unique_ptr<Sockets> sockets;
  Feed feed;
  std::mutex mutex;
  std::condition_variable ended;
  bool ends = false;
  std::thread publisher;
};

expected<std::unique_ptr<WebServer>, Error> WebServer::start(Backend& backend, const WebOptions& options) {
  if (const auto right = check(options); !right) return unexpected<Error>(right.error());
  auto sockets = Sockets::listen(options.listening, options.limits);
  if (!sockets) return unexpected<Error>(sockets.error());
  return std::unique_ptr<WebServer>(
      new WebServer(std::make_unique<Parts>(backend, options, std::move(*sockets))));
}

WebServer::WebServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
WebServer::~WebServer() { stop(); }

void WebServer::alarm(const Alarm& alarm) { parts_->feed.alarm(alarm); }
std::uint16_t WebServer::port() const noexcept { return parts_->sockets->port(); }

std::string WebServer::url() const {
  const auto& listening = parts_->options.listening;
  const bool v6 = listening.address.find(':') != std::string::npos;
  return fmt::format("{}://{}{}{}:{}/", listening.key_file.empty() ? "http" : "https", v6 ? "[" : "",
                     listening.address, v6 ? "]" : "", port());
}

void WebServer::stop() { parts_->stop(); }

}  // namespace resonid::monitor::web
