// SPDX-License-Identifier: MIT
#pragma once

#include <arpa/inet.h>
#include <fmt/core.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace resonid::monitor::web::test {

struct HttpReply {
  int status = 0;                              ///< 0: none came.
  std::map<std::string, std::string> headers;  ///< Names in lower case.
  std::string body;
};

/// A client that knows nothing of HTTP but how an answer is delimited: what it sends is up to the test.
class WebClient {
 public:
  /// `address` in the byte order of the network; 0: loopback.
  explicit WebClient(std::uint16_t port, ::in_addr_t address = 0)
      : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    ::sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = address != 0 ? address : htonl(INADDR_LOOPBACK);
    if (::connect(fd_, reinterpret_cast<::sockaddr*>(&to), sizeof to) != 0) close();
  }
  WebClient(WebClient&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)), received_(std::move(other.received_)) {}
  WebClient& operator=(WebClient&&) = delete;
  ~WebClient() { close(); }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  [[nodiscard]] int fd() const { return fd_; }

  bool send(std::string_view text) const {
    while (!text.empty()) {
      const auto count = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
      if (count <= 0) return false;
      text.remove_prefix(static_cast<std::size_t>(count));
    }
    return true;
  }

  /// More bytes; false: none within that time, or the connection is closed.
  bool receive(double seconds) {
    ::pollfd waits{fd_, POLLIN, 0};
    if (::poll(&waits, 1, static_cast<int>(seconds * 1e3)) <= 0) return false;
    char bytes[65536];
    const auto count = ::recv(fd_, bytes, sizeof bytes, 0);
    if (count <= 0) {
      closed_ = true;
      return false;
    }
    received_.append(bytes, static_cast<std::size_t>(count));
    return true;
  }

  /// One answer; `has_body` is false after HEAD.
  HttpReply reply(double seconds = 10.0, bool has_body = true) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    const auto more = [&] {
      const double left = std::chrono::duration<double>(until - std::chrono::steady_clock::now()).count();
      return left > 0.0 && receive(left);
    };
    std::size_t end = 0;
    while ((end = received_.find("\r\n\r\n")) == std::string::npos)
      if (!more()) return {};
    HttpReply reply;
    reply.status = std::stoi(received_.substr(9, 3));
    std::size_t at = received_.find("\r\n") + 2;
    while (at < end + 2) {
      const auto stop = received_.find("\r\n", at), colon = received_.find(": ", at);
      auto name = received_.substr(at, colon - at);
      for (auto& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      reply.headers[name] = received_.substr(colon + 2, stop - colon - 2);
      at = stop + 2;
    }
    received_.erase(0, end + 4);
    if (!has_body || !reply.headers.contains("content-length")) return reply;
    const auto length = std::stoul(reply.headers["content-length"]);
    while (received_.size() < length)
      if (!more()) return {};
    reply.body = received_.substr(0, length);
    received_.erase(0, length);
    return reply;
  }

  /// The next event of a stream as (name, data, id); comments are events without a name.
  struct Event {
    std::string name, data, id;
  };
  std::optional<Event> event(double seconds = 5.0) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    std::size_t end = 0;
    while ((end = received_.find("\n\n")) == std::string::npos) {
      const double left = std::chrono::duration<double>(until - std::chrono::steady_clock::now()).count();
      if (left <= 0.0 || !receive(left)) return std::nullopt;
    }
    Event found;
    std::string_view text(received_.data(), end + 1);
    while (!text.empty()) {
      const auto line = text.substr(0, text.find('\n'));
      text.remove_prefix(line.size() + 1);
      if (line.starts_with("event: ")) found.name = line.substr(7);
      if (line.starts_with("data: ")) found.data = line.substr(6);
      if (line.starts_with("id: ")) found.id = line.substr(4);
    }
    received_.erase(0, end + 2);
    return found;
  }
  /// The next one of that name.
  std::optional<Event> event_named(std::string_view name, double seconds = 5.0) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    for (;;) {
      const double left = std::chrono::duration<double>(until - std::chrono::steady_clock::now()).count();
      auto next = event(left);
      if (!next || next->name == name) return next;
    }
  }

  /// Whether the other side closes within that time.
  bool closes(double seconds) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (!closed_ && std::chrono::steady_clock::now() < until) receive(0.05);
    return closed_;
  }

 private:
  int fd_;
  bool closed_ = false;
  std::string received_;
};

using RequestHeaders = std::map<std::string, std::string>;

inline std::string request_text(std::string_view method, std::string_view target, std::string_view body = {},
                                RequestHeaders headers = {}) {
  headers.emplace("Host", "localhost");
  if (method == "POST") {
    headers.emplace("Content-Type", "application/json");
    headers.emplace("Content-Length", std::to_string(body.size()));
  }
  std::string text = fmt::format("{} {} HTTP/1.1\r\n", method, target);
  for (const auto& [name, value] : headers)
    if (!value.empty()) text += fmt::format("{}: {}\r\n", name, value);
  return fmt::format("{}\r\n{}", text, body);
}

inline HttpReply ask(std::uint16_t port, std::string_view method, std::string_view target,
                     std::string_view body = {}, RequestHeaders headers = {}) {
  WebClient client(port);
  headers.emplace("Connection", "close");
  client.send(request_text(method, target, body, std::move(headers)));
  return client.reply(10.0, method != "HEAD");
}

/// A stream that is open.
inline WebClient open_stream(std::uint16_t port, std::string_view query = {}, RequestHeaders headers = {}) {
  WebClient client(port);
  client.send(request_text("GET", fmt::format("/api/v1/stream{}", query), {}, std::move(headers)));
  const auto reply = client.reply();
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.headers.at("content-type"), "text/event-stream");
  return client;
}

}  // namespace resonid::monitor::web::test
