// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/sources/descriptor.hpp"

namespace resonid::monitor {

/// Where to listen.
struct Address {
  std::string host;        ///< Name, IPv4 or IPv6 without brackets; empty: every interface.
  std::uint16_t port = 0;  ///< 0: any that is free.
  std::string path;        ///< Of a Unix socket, instead of both.

  [[nodiscard]] std::string text() const;
};

/// `HOST:PORT`, `[IPV6]:PORT`, `:PORT`, and `unix:/PATH`. Errors (field "address"): none of these.
[[nodiscard]] expected<Address, Error> parse_address(std::string_view text);

/// Sockets that are bound to all addresses of a host, for all of IPv4 and IPv6 where it is empty; of TCP and
/// of a Unix socket they listen.
struct BoundSockets {
  std::vector<Descriptor> sockets;
  std::uint16_t port = 0;
};
/// @param type SOCK_STREAM or SOCK_DGRAM
/// The error's requirement tells what failed.
[[nodiscard]] expected<BoundSockets, Error> bind_sockets(const Address& address, int type);

}  // namespace resonid::monitor
