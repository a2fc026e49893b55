// SPDX-License-Identifier: MIT
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "monitor/samples/frame.hpp"
#include "monitor/sources/descriptor.hpp"

namespace resonid::monitor {

/// A socket that sends to a source, with 10 s to wait at most.
class Client {
 public:
  Client() = default;
  /// To this machine.
  explicit Client(std::uint16_t port, int type = SOCK_STREAM, int family = AF_INET) {
    ::sockaddr_in v4{};
    v4.sin_family = AF_INET;
    v4.sin_port = htons(port);
    v4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::sockaddr_in6 v6{};
    v6.sin6_family = AF_INET6;
    v6.sin6_port = htons(port);
    v6.sin6_addr = in6addr_loopback;
    if (family == AF_INET)
      connect(family, type, &v4, sizeof(v4));
    else
      connect(family, type, &v6, sizeof(v6));
  }
  /// To a Unix socket.
  explicit Client(const std::string& path) {
    ::sockaddr_un name{};
    name.sun_family = AF_UNIX;
    path.copy(static_cast<char*>(name.sun_path), sizeof(name.sun_path) - 1);
    connect(AF_UNIX, SOCK_STREAM, &name, sizeof(name));
  }

  [[nodiscard]] bool connected() const { return static_cast<bool>(socket_); }
  bool send(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ::ssize_t sent = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }
  /// What an answer says is due next; nothing where none comes.
  std::optional<std::uint64_t> next_sample(std::string_view axis) const {
    std::string answer(encoded(Acknowledgement{axis, 0}).size(), '\0');
    if (::recv(socket_.get(), answer.data(), answer.size(), MSG_WAITALL) !=
        static_cast<::ssize_t>(answer.size()))
      return std::nullopt;
    std::optional<std::uint64_t> next;
    FaultLog faults;
    FrameDecoder(faults).add(answer, [&](const Message& message) {
      if (const auto* a = std::get_if<Acknowledgement>(&message); a != nullptr && a->axis == axis)
        next = a->next_sample;
    });
    return next;
  }
  /// Whether the other side has closed it, or does within 10 s.
  [[nodiscard]] bool is_closed() const {
    char byte = 0;
    ::ssize_t bytes = 0;
    do bytes = ::recv(socket_.get(), &byte, 1, 0);
    while (bytes > 0);
    return bytes == 0 || (errno != EAGAIN && errno != EWOULDBLOCK);
  }
  void shut_down_sending() const { ::shutdown(socket_.get(), SHUT_WR); }
  /// Without saying good-bye.
  void break_off() {
    const ::linger at_once{1, 0};
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
    socket_.close();
  }
  void set_timeout_ms(int ms) const {
    const ::timeval limit{ms / 1000, (ms % 1000) * 1000};
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof(limit));
  }

 private:
  void connect(int family, int type, const void* name, std::size_t length) {
    socket_ = Descriptor(::socket(family, type | SOCK_CLOEXEC, 0));
    set_timeout_ms(10'000);
    if (::connect(socket_.get(), static_cast<const ::sockaddr*>(name), static_cast<::socklen_t>(length)) != 0)
      socket_.close();
  }

  Descriptor socket_;
};

}  // namespace resonid::monitor
