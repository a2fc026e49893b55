// SPDX-License-Identifier: MIT
#include "name_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/detail/suggestion.hpp>

#include "errors.hpp"

namespace resonid::cli {

std::vector<NameValue> name_values(const std::string& option, const std::string& text) {
  std::vector<NameValue> items;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find(',', from), text.size());
    const std::string item = text.substr(from, to - from);
    const std::size_t sign = item.find('=');
    if (sign == std::string::npos || sign == 0 || sign + 1 == item.size())
      throw UsageError(fmt::format("{}: found '{}', required NAME=VALUE", option, item));
    items.push_back({item.substr(0, sign), item.substr(sign + 1)});
    from = to + 1;
  }
  return items;
}

double number_of(const std::string& option, const NameValue& item, const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), item.name) == known.end())
    throw UsageError(fmt::format("{}: found '{}', required one of {}{}", option, item.name,
                                 fmt::join(known, ", "), io::suggestion(item.name, known)));
  const auto number = io::parse_number(item.value);
  if (!number)
    throw UsageError(fmt::format("{}: {}: found '{}', required a number", option, item.name, item.value));
  return *number;
}

}  // namespace resonid::cli
