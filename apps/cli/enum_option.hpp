// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/enum_names.hpp>
#include <string>
#include <vector>

#include "options.hpp"

namespace resonid::cli {

/// An option that takes the names of an enum's first `count` enumerators, all of them by default.
template <NamedEnum Enum>
CLI::Option* add_enum(CLI::App& app, const std::string& name, Enum& target, const std::string& doc,
                      std::size_t count = enum_names(Enum{}).size()) {
  std::vector<std::string_view> names;
  for (const auto& known : enum_names(Enum{}).first(count)) names.push_back(known.name);
  return add_choice(
             app, name, names, [&target](std::size_t i) { target = enum_names(Enum{})[i].value; }, doc)
      ->default_str(std::string(name_of(target)));
}

/// The same where "auto" leaves the choice open.
template <NamedEnum Enum>
CLI::Option* add_enum(CLI::App& app, const std::string& name, std::optional<Enum>& target,
                      const std::string& doc) {
  std::vector<std::string_view> names = {"auto"};
  for (const auto& known : enum_names(Enum{})) names.push_back(known.name);
  return add_choice(
             app, name, names,
             [&target](std::size_t i) {
               target = i == 0 ? std::nullopt : std::optional(enum_names(Enum{})[i - 1].value);
             },
             doc)
      ->default_str("auto");
}

}  // namespace resonid::cli
