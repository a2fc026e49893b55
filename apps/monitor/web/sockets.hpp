// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <resonid/base/expected.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/web/feed.hpp"

namespace resonid::monitor::web {

/// What clients may take of the server.
struct WebLimits {
  std::uint32_t connections = 512;        ///< Open at once; beyond, 503.
  std::uint32_t streams = 64;             ///< Of these, event streams; beyond, 503.
  std::uint32_t client_streams = 16;      ///< Open for one other machine's address; beyond, 429.
  std::uint32_t client_connections = 64;  ///< The same of connections, streams included.
  double requests_per_second = 100.0;     ///< Of one client's address, in the long run; beyond, 429.
  double burst = 300.0;                   ///< Requests of one address at once.
  std::size_t head_bytes = 16'384;        ///< Request line and headers; beyond, 431.
  std::size_t body_bytes = 65'536;        ///< Beyond, 413.
  double request_s = 10.0;                ///< From a request's first byte to its last; beyond, 408.
  double idle_s = 30.0;                   ///< Without a request.
  double stalled_s = 30.0;                ///< Without a byte of the answer taken.
  double answer_s = 60.0;                 ///< A whole answer, and for its length besides:
  double answer_bytes_per_second = 1e5;
  std::uint32_t downloads = 2;         ///< Files of samples made and sent at once; beyond, 503.
  std::size_t unsent_bytes = 1 << 26;  ///< Of answers that wait to be taken, of downloads as many again;
                                       ///< beyond, 503, but for short ones and a download that is alone.
  double keep_alive_s = 10.0;          ///< A stream without events gets a comment.
  std::uint32_t workers = 8;           ///< Requests answered at once.
};

/// Where to listen, and how.
struct Listening {
  std::string address = "127.0.0.1";  ///< An address or a name that resolves to one.
  std::uint16_t port = 0;             ///< 0: any that is free.
  std::string certificate_file;       ///< PEM, with the chain. Both files: TLS 1.2 or newer; none: plain.
  std::string key_file;
};

/// An answer, as bytes to send.
struct Reply {
  std::string text;
  int status = 0;
  bool close = false;                    ///< The connection, afterwards.
  bool stream = false;                   ///< The connection goes on as an event stream.
  std::string axis, last_event_id;       ///< Of the stream.
  std::shared_ptr<const void> download;  ///< Goes when all is sent: room for the next. Empty: it is none.
};

/// Called by one worker at a time: each has its own.
using Answerer =
    std::function<Reply(const std::string& request, std::size_t head_bytes, const std::string& client)>;

/// Counts since the start, but connections and streams: now.
struct SocketCounts {
  std::uint64_t connections = 0, streams = 0, refused = 0, skipped_frames = 0;
  std::map<int, std::uint64_t> responses;
};

/// All connections of the server, in one thread that never waits for a client: it gathers whole requests, has
/// workers answer them, and sends answers and events as fast as each client takes them. So neither idle nor
/// slow clients, nor open streams, keep a worker.
class Sockets {
 public:
  /// Begins to listen, but answers nothing before start().
  [[nodiscard]] static expected<std::unique_ptr<Sockets>, Error> listen(const Listening&, const WebLimits&);
  virtual ~Sockets() = default;
  Sockets(const Sockets&) = delete;
  Sockets& operator=(const Sockets&) = delete;

  /// `begin` says what a stream of this Last-Event-ID begins with.
  virtual void start(const std::function<Answerer()>& answerer,
                     std::function<Feed::Beginning(const std::string&)> begin) = 0;
  /// From any thread.
  virtual void send(FeedEvent) = 0;
  [[nodiscard]] virtual std::set<std::string> watched() const = 0;  ///< Axes that streams ask for.
  [[nodiscard]] virtual SocketCounts counts() const = 0;
  [[nodiscard]] virtual std::uint16_t port() const noexcept = 0;
  /// Takes nothing new, sends what is being answered (2 s at most), and closes.
  virtual void stop() = 0;

 protected:
  Sockets() = default;
};

}  // namespace resonid::monitor::web
