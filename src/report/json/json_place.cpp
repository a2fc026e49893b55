// SPDX-License-Identifier: MIT
#include "report/json/json_place.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <cstdint>

namespace resonid::report {
namespace {

using nlohmann::json;

/// As it stands in the file, cut to what fits a line.
std::string shown(const json& value) {
  constexpr std::size_t kLongest = 40;
  if (value.is_object()) return "an object";
  if (value.is_array()) return fmt::format("an array of {}", value.size());
  std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  return text;
}

}  // namespace

JsonPlace JsonPlace::part(const std::string& key, bool required) const {
  const JsonPlace absent(nullptr, path_ + "." + key, problems_);
  if (value_ == nullptr) return absent;
  if (!value_->is_object()) {
    refuse("an object");
    return absent;
  }
  const auto found = value_->find(key);
  if (found != value_->end()) return {&*found, absent.path_, problems_};
  if (required) problems_->push_back({absent.path_, "nothing", "this key"});
  return absent;
}

JsonPlace JsonPlace::at(const std::string& key) const { return part(key, true); }
JsonPlace JsonPlace::maybe(const std::string& key) const { return part(key, false); }

std::vector<JsonPlace> JsonPlace::elements() const {
  std::vector<JsonPlace> list;
  if (value_ == nullptr) return list;
  if (!value_->is_array()) {
    refuse("an array");
    return list;
  }
  for (std::size_t i = 0; i < value_->size(); ++i)
    list.push_back({&(*value_)[i], fmt::format("{}[{}]", path_, i), problems_});
  return list;
}

double JsonPlace::number() const {
  if (value_ == nullptr) return 1.0;
  if (value_->is_number() && std::isfinite(value_->get<double>())) return value_->get<double>();
  refuse("a number");
  return 1.0;
}

double JsonPlace::positive() const {
  const double x = number();
  if (x > 0.0) return x;
  refuse("a number > 0");
  return 1.0;
}

double JsonPlace::not_negative() const {
  const double x = number();
  if (x >= 0.0) return x;
  refuse("a number >= 0");
  return 0.0;
}

std::size_t JsonPlace::count() const {
  if (value_ == nullptr) return 0;
  if (value_->is_number_unsigned()) return value_->get<std::size_t>();
  refuse("a whole number >= 0");
  return 0;
}

int JsonPlace::whole() const {
  if (value_ == nullptr) return 0;
  if (value_->is_number_integer()) {
    const auto number = value_->get<std::int64_t>();
    if (number >= INT_MIN && number <= INT_MAX) return static_cast<int>(number);
  }
  refuse("a whole number");
  return 0;
}

std::vector<std::string> JsonPlace::keys() const {
  std::vector<std::string> names;
  if (value_ == nullptr || !value_->is_object()) return names;
  for (const auto& item : value_->items()) names.push_back(item.key());
  return names;
}

bool JsonPlace::flag() const {
  if (value_ == nullptr) return false;
  if (value_->is_boolean()) return value_->get<bool>();
  refuse("true or false");
  return false;
}

std::string JsonPlace::text() const {
  if (value_ == nullptr) return {};
  if (value_->is_string()) return value_->get<std::string>();
  refuse("a text");
  return {};
}

std::vector<double> JsonPlace::numbers() const {
  std::vector<double> list;
  for (const auto& element : elements()) list.push_back(element.number());
  return list;
}

bool JsonPlace::is(const std::string& text) const {
  return value_ != nullptr && value_->is_string() && value_->get<std::string>() == text;
}

std::size_t JsonPlace::choice(const std::vector<std::string>& names) const {
  if (value_ == nullptr) return 0;
  if (value_->is_string()) {
    const auto found = std::find(names.begin(), names.end(), value_->get<std::string>());
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  }
  refuse(fmt::format("{}\"{}\"", names.size() > 1 ? "one of " : "", fmt::join(names, "\", \"")));
  return 0;
}

void JsonPlace::refuse(const std::string& required) const {
  const auto noted = [&](const JsonProblem& p) { return p.path == path_; };
  if (value_ == nullptr || std::any_of(problems_->begin(), problems_->end(), noted)) return;
  problems_->push_back({path_, shown(*value_), required});
}

void JsonPlace::refuse(const std::string& key, const std::string& required) const {
  const auto place = maybe(key);
  if (place.present()) return place.refuse(required);
  const auto noted = [&](const JsonProblem& p) { return p.path == place.path_; };
  if (std::none_of(problems_->begin(), problems_->end(), noted))
    problems_->push_back({place.path_, "nothing", required});
}

Error error_of(const JsonProblems& problems) {
  constexpr std::size_t kShown = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(problems.size(), kShown); ++i)
    text += fmt::format("{}found {}, required {}", i == 0 ? "" : "\n" + problems[i].path + ": ",
                        problems[i].found, problems[i].required);
  if (problems.size() > kShown) text += fmt::format("\nand {} more", problems.size() - kShown);
  return {problems.front().path, std::move(text)};
}

}  // namespace resonid::report
