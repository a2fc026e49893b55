// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "monitor/brokers/discover.hpp"

// What files and ports seem to carry, in whatever format; discover_mqtt() and discover_nats() of the rest.
namespace resonid::monitor {

/// What a file holds now, as far as it is read within so many seconds. Errors: no regular file, not readable,
/// no samples.
[[nodiscard]] expected<std::vector<Discovered>, Error> discover_file(const std::filesystem::path& path,
                                                                     double seconds, const KeepLooking& keep);
/// What comes by a pipe until it is closed, or for so many seconds. Errors: it cannot be read.
[[nodiscard]] expected<std::vector<Discovered>, Error> discover_pipe(int descriptor, double seconds,
                                                                     const KeepLooking& keep);
/// What clients send to this port within so many seconds. Frames are answered but never acknowledged: a
/// client keeps what it has. Errors: no address, a port that is not free.
[[nodiscard]] expected<std::vector<Discovered>, Error> discover_tcp(const std::string& address,
                                                                    double seconds, const KeepLooking& keep);
/// The same of datagrams.
[[nodiscard]] expected<std::vector<Discovered>, Error> discover_udp(const std::string& address,
                                                                    double seconds, const KeepLooking& keep);

}  // namespace resonid::monitor
