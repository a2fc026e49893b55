// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <CLI/Formatter.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "option_names.hpp"

namespace resonid::cli {

/// Options whose wrong values end as a UsageError that names option, what was found and what is required.
/// `unit` is the placeholder in --help ("HZ"). The target keeps its value when the option is not given.
CLI::Option* add_number(CLI::App& app, const std::string& name, double& target, const std::string& unit,
                        const std::string& doc);
/// A whole number of at least `least`.
CLI::Option* add_count(CLI::App& app, const std::string& name, std::uint64_t& target, const std::string& doc,
                       std::uint64_t least = 0);
CLI::Option* add_lines(CLI::App& app, const std::string& name,
                       std::function<void(std::span<const double>)> assign, const std::string& doc);
/// Calls `assign` with the index of the chosen name.
CLI::Option* add_choice(CLI::App& app, const std::string& name, std::span<const std::string_view> names,
                        std::function<void(std::size_t)> assign, const std::string& doc);
/// The names that an option of add_choice() or add_enum() takes; of others none.
[[nodiscard]] std::span<const std::string> choices_of(const CLI::Option& option);

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

/// The same where the word `open` leaves the choice open; empty: there is no such word.
template <NamedEnum Enum>
CLI::Option* add_enum(CLI::App& app, const std::string& name, std::optional<Enum>& target,
                      const std::string& doc, const std::string& open = "auto") {
  std::vector<std::string_view> names;
  if (!open.empty()) names.push_back(open);
  for (const auto& known : enum_names(Enum{})) names.push_back(known.name);
  const std::size_t first = open.empty() ? 0 : 1;
  return add_choice(
             app, name, names,
             [&target, first](std::size_t i) {
               target = i < first ? std::nullopt : std::optional(enum_names(Enum{})[i - first].value);
             },
             doc)
      ->default_str(open);
}

/// A text, kept apart from one that is not given.
CLI::Option* add_text(CLI::App& app, const std::string& name, std::optional<std::string>& target,
                      const std::string& doc, const std::string& unit);
/// A number, kept apart from one that is not given.
CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& target,
                        const std::string& unit, const std::string& doc);
/// Numbers with colons, "LO:HI".
CLI::Option* add_colons(CLI::App& app, const std::string& name, std::size_t count, const std::string& form,
                        std::function<void(const std::vector<double>&)> assign, const std::string& doc);

/// Makes an option of every field that describe() names, except those that are fixed by the command itself.
class OptionVisitor {
 public:
  explicit OptionVisitor(CLI::App& app) : app_(app) {}

  template <class Field>
  void operator()(std::string_view field, Field& target, std::string_view doc) {
    if (field == "kind") return;
    const std::string name = option_name(field);
    const std::string text(doc);
    if constexpr (std::is_same_v<Field, double>)
      add_number(app_, name, target, option_unit(field), text);
    else if constexpr (std::is_same_v<Field, std::uint64_t>)
      add_count(app_, name, target, text);
    else if constexpr (std::is_same_v<Field, bool>)
      app_.add_flag(name, target, text);
    else if constexpr (std::is_enum_v<Field>)
      add_enum(app_, name, target, text);
    else
      add_field_lines(name, target, text);
  }

 private:
  void add_field_lines(const std::string& name, online::LineList& target, const std::string& doc);
  CLI::App& app_;
};

/// Throws the UsageError for a refused configuration field, in the words of the command line.
[[noreturn]] void refuse_option(const CLI::App& app, const Error& error);

}  // namespace resonid::cli
