// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/error_text.hpp>
#include <string>
#include <string_view>
#include <temporary_folder.hpp>
#include <vector>

#include "monitor/service/configuration.hpp"

namespace resonid::monitor::test {

using resonid::test::contents_of;
using resonid::test::TemporaryFolder;

/// The least that a service runs with: two keys in the last table, which may be added to.
inline constexpr std::string_view kLeast = R"([monitor]
data = "data"
[source.in]
kind = "stdin"
[axis.x]
source = "in"
sample_rate_hz = 500
input = "u"
output = "y"
)";

inline std::vector<std::string> messages(const std::vector<Error>& findings) {
  std::vector<std::string> texts;
  for (const auto& finding : findings) texts.push_back(message_of(finding));
  return texts;
}

/// What is found in the least configuration and more, named m.toml.
inline Findings findings_of(const TemporaryFolder& folder, std::string_view more,
                            std::string_view least = kLeast) {
  return parse_configuration(std::string(least) + std::string(more), "m.toml", folder.path()).findings;
}
inline std::vector<std::string> errors_of(const TemporaryFolder& folder, std::string_view more,
                                          std::string_view least = kLeast) {
  return messages(findings_of(folder, more, least).errors);
}
inline std::vector<std::string> warnings_of(const TemporaryFolder& folder, std::string_view more) {
  return messages(findings_of(folder, more).warnings);
}

}  // namespace resonid::monitor::test
