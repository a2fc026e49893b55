// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <resonid/base/expected.hpp>
#include <string>

#include "monitor/sources/decoder.hpp"
#include "monitor/sources/network_source.hpp"

namespace resonid::monitor {

struct UdpSettings {
  std::string address;  ///< HOST:PORT; port 0: any that is free.
  Format format = {SampleFormat::frame};
  int receive_buffer_bytes = 4'194'304;  ///< Asked of the kernel, which has a limit (net.core.rmem_max).
};

/// Takes datagrams of whole frames or lines. What overflows the kernel's buffer is counted as lost, and so is
/// what comes while an intake is full. CSV lines need `columns`, or their names in every datagram that may be
/// the first.
///
/// Errors: an address that is none, or a path; a buffer of less than 4096 bytes.
[[nodiscard]] expected<std::unique_ptr<NetworkSource>, Error> make_udp_source(UdpSettings settings,
                                                                              Axes& axes);

}  // namespace resonid::monitor
