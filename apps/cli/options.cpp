// SPDX-License-Identifier: MIT
#include "options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/detail/suggestion.hpp>

#include "errors.hpp"
#include "option_names.hpp"

namespace resonid::cli {
namespace {

[[noreturn]] void refuse_text(const std::string& name, const std::string& found,
                              const std::string& required) {
  throw UsageError(fmt::format("{}: found '{}', required {}", name, found, required));
}

/// What every option that takes names takes; options live as long as the program.
std::map<const CLI::Option*, std::vector<std::string>>& choices() {
  static std::map<const CLI::Option*, std::vector<std::string>> all;
  return all;
}

}  // namespace

std::span<const std::string> choices_of(const CLI::Option& option) {
  const auto found = choices().find(&option);
  return found == choices().end() ? std::span<const std::string>() : found->second;
}

CLI::Option* add_number(CLI::App& app, const std::string& name, double& target, const std::string& unit,
                        const std::string& doc) {
  const auto read = [name, &target](const std::string& text) {
    const auto value = io::parse_number(text);
    if (!value) refuse_text(name, text, "a number");
    target = *value;
  };
  auto* option = app.add_option_function<std::string>(name, read, doc)->type_name(unit);
  if (target != 0.0) option->default_str(fmt::format("{}", target));
  return option;
}

CLI::Option* add_count(CLI::App& app, const std::string& name, std::uint64_t& target, const std::string& doc,
                       std::uint64_t least) {
  const auto read = [name, &target, least](const std::string& text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size())
      refuse_text(name, text, fmt::format("a whole number >= {}", least));
    if (value < least) throw UsageError(fmt::format("{}: found {}, required >= {}", name, value, least));
    target = value;
  };
  return app.add_option_function<std::string>(name, read, doc)
      ->type_name("N")
      ->default_str(fmt::format("{}", target));
}

CLI::Option* add_lines(CLI::App& app, const std::string& name,
                       std::function<void(std::span<const double>)> assign, const std::string& doc) {
  const auto read = [name, assign](const std::string& text) {
    const auto lines = io::parse_lines(text);
    if (!lines) throw UsageError(name + ": " + lines.error().requirement.str());
    assign(*lines);
  };
  return app.add_option_function<std::string>(name, read, doc)->type_name("F0:F1:STEP|F,F,F");
}

CLI::Option* add_choice(CLI::App& app, const std::string& name, std::span<const std::string_view> names,
                        std::function<void(std::size_t)> assign, const std::string& doc) {
  const std::vector<std::string> known(names.begin(), names.end());
  const auto read = [name, known, assign](const std::string& text) {
    const auto found = std::find(known.begin(), known.end(), text);
    if (found == known.end())
      refuse_text(name, text,
                  fmt::format("one of {}{}", fmt::join(known, ", "), io::suggestion(text, known)));
    assign(static_cast<std::size_t>(found - known.begin()));
  };
  auto* option = app.add_option_function<std::string>(
      name, read, fmt::format("{}; one of {}", doc, fmt::join(known, ", ")));
  choices()[option] = known;
  return option->type_name("NAME");
}

CLI::Option* add_text(CLI::App& app, const std::string& name, std::optional<std::string>& target,
                      const std::string& doc, const std::string& unit) {
  const auto keep = [&target](const std::string& text) { target = text; };
  return app.add_option_function<std::string>(name, keep, doc)->type_name(unit);
}

CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& target,
                        const std::string& unit, const std::string& doc) {
  const auto read = [name, unit, &target](const std::string& text) {
    target = io::parse_number(text);
    if (!target) refuse_text(name, text, unit == "SECONDS" ? "a number of seconds" : "a number");
  };
  return app.add_option_function<std::string>(name, read, doc)->type_name(unit);
}

CLI::Option* add_colons(CLI::App& app, const std::string& name, std::size_t count, const std::string& form,
                        std::function<void(const std::vector<double>&)> assign, const std::string& doc) {
  const auto read = [name, count, form, assign](const std::string& text) {
    const auto numbers = io::parse_colons(text, count, form);
    if (!numbers) throw UsageError(name + ": " + numbers.error().requirement.str());
    assign(*numbers);
  };
  return app.add_option_function<std::string>(name, read, doc)->type_name(form);
}

void OptionVisitor::add_field_lines(const std::string& name, online::LineList& target,
                                    const std::string& doc) {
  const auto assign = [name, &target](std::span<const double> hz) {
    if (!target.assign(hz))
      refuse_text(name, fmt::format("{} lines", hz.size()), fmt::format("at most {}", online::kMaxLines));
  };
  add_lines(app_, name, assign, doc);
}

void refuse_option(const CLI::App& app, const Error& error) {
  const std::string name = option_name(error.field);
  const CLI::Option* option = app.get_option_no_throw(name);
  if (option != nullptr && option->count() == 0)
    throw UsageError(fmt::format("{} is required: it {}", name, error.requirement.view()));
  const std::string found = std::isnan(error.value) ? std::string() : fmt::format("found {}, ", error.value);
  throw UsageError(fmt::format("{}: {}{}", name, found, error.requirement.view()));
}

}  // namespace resonid::cli
