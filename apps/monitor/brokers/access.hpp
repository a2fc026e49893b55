// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace resonid::monitor {

struct Credentials {
  std::string user, password;
};

/// Files in PEM; empty: those of the system, or none.
struct Tls {
  std::filesystem::path authorities;       ///< Who is trusted.
  std::filesystem::path certificate, key;  ///< Our own, where the broker wants one.
};

/// How a broker lets one in.
struct Access {
  std::optional<Credentials> credentials = {};
  std::optional<Tls> tls = {};
};

}  // namespace resonid::monitor
