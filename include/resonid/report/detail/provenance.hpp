// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace resonid::report {

/// A file that a result was made from.
struct InputFile {
  std::string name;    ///< As it was named.
  std::string sha256;  ///< 64 hexadecimal digits; empty: not a file that can be read twice.
};

/// What a result was made by, and from what. Whoever runs the library fills it in: the library knows neither
/// clock nor command line.
struct Provenance {
  std::string version;  ///< "0.1.0"
  std::string command;  ///< The whole command line.
  std::string date;     ///< UTC, ISO 8601: "2026-03-01T12:00:00Z".
  std::vector<InputFile> files;
};

/// Adds it to a result's JSON, or to the data of its page, as the key `provenance`.
void put_provenance(nlohmann::json& result, const Provenance& provenance);
/// That of a result's JSON; nothing where there is none, or none that can be read.
[[nodiscard]] std::optional<Provenance> provenance_of(const nlohmann::json& result);

}  // namespace resonid::report
