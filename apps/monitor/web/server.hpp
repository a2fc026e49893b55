// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "monitor/web/backend.hpp"
#include "monitor/web/sockets.hpp"

namespace resonid::monitor::web {

/// How the web server is set up.
struct WebOptions {
  Listening listening;
  std::vector<std::string> host_names;  ///< That clients may call it by, besides localhost and addresses.
  std::string write_token;  ///< At least 16 characters. Empty: writes need none on loopback, else are off.
  std::string read_token;   ///< Likewise. Empty: reads need none.
  double frames_per_second = 20.0;  ///< 0.1 ... 50
  WebLimits limits;
};

/// Whether a server can start with this: tokens, limits, certificate and key. The address is not tried.
[[nodiscard]] expected<void, Error> check(const WebOptions& options);

/// HTTP, event streams and metrics over a Backend, which must outlive it.
class WebServer {
 public:
  /// Listens and answers from here on, in threads of its own.
  [[nodiscard]] static expected<std::unique_ptr<WebServer>, Error> start(Backend&, const WebOptions&);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// Sends a transition of an alarm to every stream; from any thread, without waiting.
  void alarm(const Alarm&);
  [[nodiscard]] std::uint16_t port() const noexcept;
  [[nodiscard]] std::string url() const;  ///< http://127.0.0.1:8080/
  void stop();

 private:
  struct Parts;
  explicit WebServer(std::unique_ptr<Parts>);
  std::unique_ptr<Parts> parts_;
};

}  // namespace resonid::monitor::web
