// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <resonid/base/expected.hpp>
#include <string>

#include "monitor/sources/decoder.hpp"
#include "monitor/sources/network_source.hpp"

namespace resonid::monitor {

struct TcpSettings {
  std::string address;  ///< HOST:PORT, port 0: any that is free; unix:/PATH
  Format format = {SampleFormat::frame};
  std::size_t most_connections = 64;
  double idle_s = 60.0;  ///< After which a client that sends nothing is closed; 0: never.
  std::size_t most_without_message = 2'000'000;  ///< Bytes that a client may send so until it is closed.
  std::size_t most_unfinished = 134'217'728;     ///< Bytes of messages that are not whole, of all clients.
};

/// Takes the connections of any number of clients, which send frames (each frame and question is
/// answered, docs/monitor_frame.md) or lines. An answer tells only what is in the ring. While an intake is
/// full, the clients that send for it are not read from; the others are. A client that does not read its
/// answers is not read from either. Where there are as many clients as may be, a new one takes the place of
/// the one that has been silent longest, for a second at least, without ever having sent anything usable, or
/// is turned away.
///
/// Errors: an address that is none; no connections; limits of bytes below those of two frames; idle_s < 0.
[[nodiscard]] expected<std::unique_ptr<NetworkSource>, Error> make_tcp_source(TcpSettings settings,
                                                                              Axes& axes);

}  // namespace resonid::monitor
