// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "monitor/brokers/access.hpp"

namespace resonid::monitor {

struct NatsSettings {
  std::vector<std::string> servers = {"nats://localhost:4222"};  ///< Of one cluster.
  Access access = {};
  std::filesystem::path token_file = {};  ///< Of NATS (`.creds`), instead of user and password.
};

}  // namespace resonid::monitor
