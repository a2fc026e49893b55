// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <resonid/base/expected.hpp>
#include <string>

namespace resonid::monitor {

struct Credentials {
  std::string user, password;
};

/// User in the first line of a file and password in the second, so that neither stands in a configuration or
/// in the list of processes. Errors (field "credentials"): the file cannot be read, or has no user.
[[nodiscard]] expected<Credentials, Error> read_credentials(const std::filesystem::path& path);

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
