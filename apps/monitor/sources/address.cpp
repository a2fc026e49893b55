// SPDX-License-Identifier: MIT
#include "monitor/sources/address.hpp"

#include <fmt/core.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <optional>

#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {
namespace {

constexpr std::string_view kUnixPrefix = "unix:";

std::optional<std::uint16_t> port_of(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (code != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return port;
}

unexpected<Error> cannot_listen(const Address& address, std::string_view why) {
  return unexpected<Error>(Error{"address", fmt::format("cannot listen on {}: {}", address.text(), why)});
}

expected<BoundSockets, Error> bind_path(const Address& address) {
  ::sockaddr_un name{};
  name.sun_family = AF_UNIX;
  address.path.copy(static_cast<char*>(name.sun_path), sizeof(name.sun_path) - 1);
  const auto* const generic = reinterpret_cast<const ::sockaddr*>(&name);
  struct ::stat status {};
  if (::lstat(address.path.c_str(), &status) == 0) {
    if (!S_ISSOCK(status.st_mode)) return cannot_listen(address, "there is a file that is no socket");
    const Descriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (::connect(probe.get(), generic, sizeof(name)) == 0 || errno != ECONNREFUSED)
      return cannot_listen(address, "another process listens there");
    ::unlink(address.path.c_str());  // left by a process that was killed
  }
  BoundSockets bound;
  bound.sockets.emplace_back(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int socket = bound.sockets.back().get();
  if (socket < 0 || ::bind(socket, generic, sizeof(name)) != 0 || ::listen(socket, SOMAXCONN) != 0)
    return cannot_listen(address, system_error_text(errno));
  return bound;
}

/// Port that a socket was given.
std::uint16_t port_of(int socket) {
  ::sockaddr_storage name{};
  ::socklen_t length = sizeof(name);
  if (::getsockname(socket, reinterpret_cast<::sockaddr*>(&name), &length) != 0) return 0;
  if (name.ss_family == AF_INET6) return ntohs(reinterpret_cast<const ::sockaddr_in6*>(&name)->sin6_port);
  return ntohs(reinterpret_cast<const ::sockaddr_in*>(&name)->sin_port);
}

/// The error's code; 0: bound.
int bind_one(const ::addrinfo& to, std::uint16_t port, Descriptor& socket) {
  socket = Descriptor(::socket(to.ai_family, to.ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, to.ai_protocol));
  if (!socket) return errno;
  const int on = 1;
  if (to.ai_socktype == SOCK_STREAM) ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  ::sockaddr_storage name{};
  std::memcpy(&name, to.ai_addr, to.ai_addrlen);
  if (to.ai_family == AF_INET6) {
    ::setsockopt(socket.get(), IPPROTO_IPV6, IPV6_V6ONLY, &on, sizeof(on));
    reinterpret_cast<::sockaddr_in6*>(&name)->sin6_port = htons(port);
  } else {
    reinterpret_cast<::sockaddr_in*>(&name)->sin_port = htons(port);
  }
  if (::bind(socket.get(), reinterpret_cast<const ::sockaddr*>(&name), to.ai_addrlen) != 0) return errno;
  return to.ai_socktype == SOCK_STREAM && ::listen(socket.get(), SOMAXCONN) != 0 ? errno : 0;
}

}  // namespace

std::string Address::text() const {
  if (!path.empty()) return fmt::format("{}{}", kUnixPrefix, path);
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port)
                                             : fmt::format("[{}]:{}", host, port);
}

expected<Address, Error> parse_address(std::string_view text) {
  const auto refused = [&](std::string_view why) {
    return unexpected<Error>(Error{"address", fmt::format("{}, not '{}'", why, printable(text))});
  };
  Address address;
  if (text.substr(0, kUnixPrefix.size()) == kUnixPrefix) {
    address.path = text.substr(kUnixPrefix.size());
    if (address.path.empty() || address.path.front() != '/' ||
        address.path.size() >= sizeof(sockaddr_un::sun_path) || address.path.find('\0') != std::string::npos)
      return refused("must be unix: and an absolute path of at most 107 bytes");
    return address;
  }
  const std::size_t colon = text.rfind(':');
  const auto port = colon == std::string_view::npos ? std::nullopt : port_of(text.substr(colon + 1));
  if (!port) return refused("must be HOST:PORT with a port of 0 ... 65535, or unix:/PATH");
  address.port = *port;
  std::string_view host = text.substr(0, colon);
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
    if (host.find(':') == std::string_view::npos) return refused("must have an IPv6 address in brackets");
  } else if (host.find_first_of(":[]") != std::string_view::npos) {
    return refused("must have an IPv6 address in brackets, [::1]:PORT");
  }
  if (host.find_first_of(std::string_view(" /\0", 3)) != std::string_view::npos)
    return refused("must have a host without blanks and slashes");
  address.host = host;
  return address;
}

expected<BoundSockets, Error> bind_sockets(const Address& address, int type) {
  if (!address.path.empty()) return bind_path(address);
  ::addrinfo hints{};
  hints.ai_socktype = type;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  ::addrinfo* list = nullptr;
  const int code = ::getaddrinfo(address.host.empty() ? nullptr : address.host.c_str(), "0", &hints, &list);
  if (code != 0) return cannot_listen(address, ::gai_strerror(code));
  const std::unique_ptr<::addrinfo, decltype(&::freeaddrinfo)> all(list, &::freeaddrinfo);
  BoundSockets bound;
  bound.port = address.port;
  int why = 0;
  for (const ::addrinfo* to = list; to != nullptr; to = to->ai_next) {
    if (to->ai_family != AF_INET && to->ai_family != AF_INET6) continue;
    Descriptor socket;
    const int error = bind_one(*to, bound.port, socket);
    if (error == EAFNOSUPPORT ||
        error == EADDRNOTAVAIL) {  // a kernel without IPv6, an interface that is down
      why = why == 0 ? error : why;
      continue;
    }
    if (error != 0) return cannot_listen(address, system_error_text(error));
    if (bound.port == 0) bound.port = port_of(socket.get());
    bound.sockets.push_back(std::move(socket));
  }
  if (bound.sockets.empty()) return cannot_listen(address, system_error_text(why));
  return bound;
}

}  // namespace resonid::monitor
