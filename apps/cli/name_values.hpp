// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace resonid::cli {

struct NameValue {
  std::string name, value;
};

/// `name=value,name=value`; anything else ends as a UsageError that begins with the option.
[[nodiscard]] std::vector<NameValue> name_values(const std::string& option, const std::string& text);

/// The number of one of the `known` names; another name, or what is no number, ends as a UsageError.
[[nodiscard]] double number_of(const std::string& option, const NameValue& item,
                               const std::vector<std::string>& known);

}  // namespace resonid::cli
