// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "monitor/brokers/access.hpp"

namespace resonid::monitor {

/// By the schemes that the clients of NATS know.
[[nodiscard]] inline std::string nats_url(const std::string& address, bool tls) {
  return (tls ? "tls://" : "nats://") + address;
}

struct NatsSettings {
  std::vector<std::string> servers = {"nats://localhost:4222"};  ///< Of one cluster.
  Access access = {};
  /// Instead of user and password: the token in the first line, or credentials of NATS (`.creds`, with
  /// `-----BEGIN`).
  std::filesystem::path token_file = {};
};

}  // namespace resonid::monitor
