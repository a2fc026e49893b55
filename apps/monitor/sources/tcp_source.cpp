// SPDX-License-Identifier: MIT
#include "monitor/sources/tcp_source.hpp"

#include <fmt/core.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <set>
#include <vector>

#include "monitor/sources/address.hpp"
#include "monitor/sources/tcp_connection.hpp"

namespace resonid::monitor {
namespace {

using Clock = TcpConnection::Clock;

constexpr double kListenAgain_s = 0.2;
constexpr int kRoomAgain_ms = 2;  // after which a full intake is tried again
constexpr int kLook_ms = 500;     // after which idle clients are looked for
constexpr int kNoDescriptor_ms = 100;
constexpr std::size_t kMostAccepted = 64;  // at once, before those that are there have their turn
constexpr double kNewcomer_s = 1.0;        // in which a client need not have sent anything

class TcpSource final : public NetworkSource {
 public:
  TcpSource(TcpSettings settings, Address address, Axes& axes)
      : NetworkSource(axes), settings_(std::move(settings)), address_(std::move(address)) {}
  ~TcpSource() override { stop(); }
  [[nodiscard]] std::string_view promise() const noexcept override {
    return settings_.format.kind == SampleFormat::frame
               ? "Nothing is lost when the process is killed, if the client keeps samples until they are "
                 "acknowledged."
               : "What is on its way is lost when the process is killed.";
  }

 private:
  void run() override {
    Backoff backoff(kListenAgain_s);
    while (!stopping()) {
      auto bound = bind_sockets(address_, SOCK_STREAM);
      poll_ = Descriptor(::epoll_create1(EPOLL_CLOEXEC));
      if (bound && poll_) {
        serve(*bound);
        if (!address_.path.empty()) ::unlink(address_.path.c_str());
        return;
      }
      set_state(SourceState::waiting, bound ? system_error_text(errno) : bound.error().requirement.str());
      static_cast<void>(wait(backoff.next_s()));
    }
  }

  void serve(const BoundSockets& bound) {
    watch(stop_descriptor(), EPOLLIN);
    for (const Descriptor& socket : bound.sockets) watch(socket.get(), EPOLLIN);
    address_.port = bound.port;
    port_.store(bound.port, std::memory_order_release);  // first: who sees it run may ask for it
    tell();
    std::array<::epoll_event, 128> events;
    auto look = Clock::now();
    bool listening = true;
    while (!stopping()) {
      const int timeout = waiting_.empty() ? (listening ? kLook_ms : kNoDescriptor_ms) : kRoomAgain_ms;
      const int count = ::epoll_wait(poll_.get(), events.data(), static_cast<int>(events.size()), timeout);
      for (int k = 0; k < count; ++k) {
        const int socket = events[static_cast<std::size_t>(k)].data.fd;
        const auto at = connections_.find(socket);
        if (at != connections_.end())
          attend(*at->second.connection, events[static_cast<std::size_t>(k)].events);
        else if (is_listening(bound, socket) && !accept_some(socket))
          listening = false;
      }
      retry();
      if (Clock::now() - look < std::chrono::milliseconds(listening ? kLook_ms : kNoDescriptor_ms)) continue;
      look = Clock::now();
      close_idle();
      if (!std::exchange(listening, true))
        for (const Descriptor& socket : bound.sockets) watch(socket.get(), EPOLLIN);
      tell();
    }
    connections_.clear();
  }

  static bool is_listening(const BoundSockets& bound, int socket) {
    return std::any_of(bound.sockets.begin(), bound.sockets.end(),
                       [&](const Descriptor& one) { return one.get() == socket; });
  }

  void watch(int socket, std::uint32_t events) const {
    ::epoll_event event{};
    event.events = events;
    event.data.fd = socket;
    if (::epoll_ctl(poll_.get(), EPOLL_CTL_MOD, socket, &event) != 0)
      ::epoll_ctl(poll_.get(), EPOLL_CTL_ADD, socket, &event);
  }
  void ignore(int socket) const { ::epoll_ctl(poll_.get(), EPOLL_CTL_DEL, socket, nullptr); }

  /// False, and the socket is not watched for a while, where there are no descriptors left.
  bool accept_some(int listener) {
    for (std::size_t k = 0; k < kMostAccepted; ++k) {
      Descriptor socket(::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (!socket && (errno == EINTR || errno == ECONNABORTED)) continue;
      if (!socket && (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM)) {
        delivery_.faults().note(Fault::size, fmt::format("no client more: {}", system_error_text(errno)));
        ignore(listener);
        return false;
      }
      if (!socket) return true;
      if (connections_.size() >= settings_.most_connections && !make_room()) {
        turn_away("a client was turned away");
        continue;
      }
      const int on = 1;
      ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
      const int number = socket.get();
      auto connection = std::make_unique<TcpConnection>(std::move(socket), settings_.format, delivery_);
      watch(number, EPOLLIN);
      connections_[number] = {std::move(connection), POLLIN};
    }
    return true;
  }

  /// Closes the client that is silent longest and never was of use.
  bool make_room() {
    const TcpConnection* oldest = nullptr;
    for (const auto& [socket, client] : connections_)
      if (!client.connection->useful() && (oldest == nullptr || client.connection->last() < oldest->last()))
        oldest = client.connection.get();
    if (oldest == nullptr || Clock::now() - oldest->last() < std::chrono::duration<double>(kNewcomer_s))
      return false;
    turn_away("a client that had sent nothing of use had to make room for another");
    drop(oldest->socket());
    return true;
  }

  void turn_away(std::string_view what) {
    ++turned_away_;
    delivery_.faults_of_none().note(
        Fault::size, fmt::format("{}; at most {} at once are required", what, settings_.most_connections));
  }

  void attend(TcpConnection& connection, std::uint32_t events) {
    const std::size_t before = connection.unfinished();
    if ((connection.events() & POLLIN) != 0 && (events & ~std::uint32_t{EPOLLOUT}) != 0)
      connection.receive(buffer_);
    connection.send();
    unfinished_ += connection.unfinished();
    unfinished_ -= before;
    const TcpConnection* greedy = &connection;
    if (unfinished_ > settings_.most_unfinished)
      for (const auto& [socket, client] : connections_)
        if (client.connection->unfinished() > greedy->unfinished()) greedy = client.connection.get();
    if (greedy->unfinished() > settings_.most_without_message || unfinished_ > settings_.most_unfinished) {
      delivery_.faults().note(Fault::size,
                              fmt::format("a client was closed that sent {} bytes without a whole "
                                          "message; all clients have {} such bytes",
                                          greedy->unfinished(), unfinished_));
      const bool itself = greedy == &connection;
      drop(greedy->socket());
      if (itself) return;
    }
    settle(connection);
  }

  /// Watches for what the connection can do next, or drops it.
  void settle(const TcpConnection& connection) {
    if (connection.done()) return drop(connection.socket());
    if (connection.waits_for_room()) waiting_.insert(connection.socket());
    short& watched = connections_[connection.socket()].watched;
    if (watched == connection.events()) return;
    watched = connection.events();
    if (watched == 0)
      ignore(connection.socket());  // or a client that hung up would wake us again and again
    else
      watch(connection.socket(),
            ((watched & POLLIN) != 0 ? EPOLLIN : 0U) | ((watched & POLLOUT) != 0 ? EPOLLOUT : 0U));
  }

  void retry() {
    for (auto at = waiting_.begin(); at != waiting_.end();) {
      TcpConnection& connection = *connections_.at(*at).connection;
      connection.deliver_kept();
      connection.send();
      if (connection.waits_for_room()) {
        ++at;
        continue;
      }
      at = waiting_.erase(at);
      settle(connection);
    }
  }

  void close_idle() {
    if (settings_.idle_s == 0.0) return;
    const auto limit = Clock::now() - std::chrono::duration<double>(settings_.idle_s);
    std::vector<int> idle;
    for (const auto& [socket, client] : connections_)
      if (client.connection->last() < limit && !client.connection->waits_for_room()) idle.push_back(socket);
    for (const int socket : idle) drop(socket);
  }

  void drop(int socket) {
    waiting_.erase(socket);
    const auto at = connections_.find(socket);
    unfinished_ -= at->second.connection->unfinished();
    connections_.erase(at);
  }

  void tell() {
    std::string text = fmt::format("{} clients on {}", connections_.size(), address_.text());
    if (!waiting_.empty()) text += fmt::format(", {} wait for room in a ring", waiting_.size());
    if (turned_away_ > 0)
      text += fmt::format(", {} turned away (at most {})", turned_away_, settings_.most_connections);
    set_state(SourceState::running, std::move(text));
  }

  struct Client {
    std::unique_ptr<TcpConnection> connection;
    short watched = 0;
  };

  const TcpSettings settings_;
  Address address_;
  Descriptor poll_;
  std::map<int, Client> connections_;  ///< [socket]
  std::set<int> waiting_;              ///< Sockets of those that wait for room.
  std::size_t unfinished_ = 0;         ///< Bytes, of all.
  std::uint64_t turned_away_ = 0;
  std::array<char, 65'536> buffer_;
};

}  // namespace

expected<std::unique_ptr<NetworkSource>, Error> make_tcp_source(TcpSettings settings, Axes& axes) {
  auto address = parse_address(settings.address);
  if (!address) return unexpected(address.error());
  if (settings.most_connections == 0) return refuse("most_connections", "must be > 0", 0.0);
  if (!(settings.idle_s >= 0.0)) return refuse("idle_s", "must be >= 0", settings.idle_s);
  if (settings.most_without_message < 2 * kLongestFrame)
    return refuse("most_without_message", "must be >= 2 000 000",
                  static_cast<double>(settings.most_without_message));
  if (settings.most_unfinished < 2 * kLongestFrame)
    return refuse("most_unfinished", "must be >= 2 000 000", static_cast<double>(settings.most_unfinished));
  return std::make_unique<TcpSource>(std::move(settings), *std::move(address), axes);
}

}  // namespace resonid::monitor
