// SPDX-License-Identifier: MIT
#include "monitor/brokers/publisher.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "monitor/samples/faults.hpp"

namespace resonid::monitor {
namespace {

constexpr std::size_t kLongestKey = 200;

bool is_key_character(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         std::string_view("-_.:/").find(c) != std::string_view::npos;
}

}  // namespace

expected<std::string, Error> with_key(std::string_view body, std::string_view key) {
  if (key.empty() || key.size() > kLongestKey || !std::all_of(key.begin(), key.end(), is_key_character))
    return refuse(
        "key", fmt::format("'{}' is none; 1 ... 200 letters, digits and -_.:/ are required", printable(key)));
  nlohmann::ordered_json object = nlohmann::ordered_json::parse(body, nullptr, false);
  if (!object.is_object())
    return refuse("body", fmt::format("'{}': a JSON object is required", printable(body)));
  object["idempotency_key"] = key;
  return object.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace resonid::monitor
