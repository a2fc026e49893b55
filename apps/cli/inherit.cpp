// SPDX-License-Identifier: MIT
#include "inherit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/json_file.hpp>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/detail/profile.hpp>

#include "errors.hpp"
#include "help.hpp"
#include "output.hpp"
#include "profile.hpp"
#include "terminal.hpp"

namespace resonid::cli {
namespace {

/// Groups of options that are no part of what a result came from.
constexpr std::array<std::string_view, 2> kNotOfTheMachine = {"Results", "General"};
/// Beside the recording's, options that hold for every record of the machine.
constexpr std::array<std::string_view, 3> kOfTheMachine = {"controller", "delay", "radius"};
/// Those that hold for one record only, beside what is known of its excitation.
constexpr std::array<std::string_view, 4> kOfOneRecord = {"from", "to", "band", "confidence"};

template <std::size_t Size>
bool contains(const std::array<std::string_view, Size>& all, std::string_view one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

std::string name_of_option(const CLI::Option& option) {
  return option.get_lnames().empty() ? std::string() : option.get_lnames().front();
}

/// A controller as it can be read without its file.
std::string with_contents(const std::string& controller) {
  if (controller.starts_with("pi:") || controller.starts_with('{')) return controller;
  const auto json = io::read_json(controller);
  return json ? json->dump() : controller;
}

std::string value_of(const CLI::Option& option) {
  return takes_value(option) ? fmt::format("{}", fmt::join(option.results(), ",")) : "true";
}

std::vector<const CLI::Option*> options_given(const CLI::App& verb) {
  return verb.get_options([](const CLI::Option* option) {
    return option->nonpositional() && option->count() > 0 && !option->get_group().empty() &&
           !contains(kNotOfTheMachine, option->get_group());
  });
}

bool is_inherited(const CLI::Option& option, bool same_record) {
  const auto name = name_of_option(option);
  if (contains(kOfOneRecord, name) || option.get_group() == "Excitation") return same_record;
  return option.get_group() == "Recording" || contains(kOfTheMachine, name);
}

/// "output-scale = -1", "chirp = \"35:1.5:17\"".
std::string toml_line(const std::string& name, const std::string& value, bool flag) {
  const bool plain = flag || io::parse_number(value).has_value();
  return fmt::format("{} = {}\n", name, plain ? value : io::toml_text(value));
}

}  // namespace

std::vector<identification::GivenOption> given_options(const CLI::App& verb) {
  std::vector<identification::GivenOption> options;
  for (const auto* option : options_given(verb)) {
    const auto name = name_of_option(*option);
    const auto value = value_of(*option);
    options.push_back({name, name == "controller" ? with_contents(value) : value});
  }
  return options;
}

void inherit_wanted(CLI::App& verb, const std::vector<identification::GivenOption>& options,
                    const std::string& file, const std::function<bool(const CLI::Option&)>& wanted) {
  std::vector<std::string> names;
  const auto is_given = [&](const char* name) {
    const auto* option = verb.get_option_no_throw(name);
    return option != nullptr && option->count() > 0 && !is_from_profile(*option);
  };
  const bool other_stretch = is_given("--from") || is_given("--to");
  for (auto* option : verb.get_options()) {
    const auto name = name_of_option(*option);
    if (other_stretch && (name == "from" || name == "to")) continue;
    const auto stored =
        std::find_if(options.begin(), options.end(), [&](const auto& o) { return o.name == name; });
    if (stored == options.end() || option->get_group().empty() || !wanted(*option)) continue;
    if (option->count() > 0 && !is_from_profile(*option)) continue;
    forget_profile_of(*option);
    option->clear();
    option->add_result(stored->value);
    try {
      option->run_callback();
    } catch (const std::exception& error) {
      throw InputError(fmt::format("{}: the options that it stores: {}", file, error.what()));
    }
    names.push_back(name);
  }
  if (!names.empty() && !output_settings().quiet)
    print_error(fmt::format("resonid: from {}: {}\n", file, fmt::join(names, ", ")));
}

void inherit(CLI::App& verb, const std::vector<identification::GivenOption>& options, const std::string& file,
             bool same_record) {
  inherit_wanted(verb, options, file,
                 [&](const CLI::Option& option) { return is_inherited(option, same_record); });
}

bool is_of_record(const identification::Result& result, const std::string& record) {
  return std::filesystem::path(result.record.file).filename() == std::filesystem::path(record).filename();
}

std::string profile_text(const CLI::App& verb, const identification::RecordFacts& record) {
  std::string common = "# Defaults of all verbs, as identified from " + record.file + ".\n", own;
  const std::array<std::pair<const char*, const std::string*>, 5> found = {
      {{"time", &record.time},
       {"input", &record.input},
       {"output", &record.output},
       {"excitation", &record.excitation},
       {"reference", &record.reference}}};
  for (const auto& [name, column] : found)
    if (!column->empty() && verb.get_option(std::string("--") + name)->count() == 0)
      common += toml_line(name, *column, false);
  for (const auto* option : options_given(verb)) {
    const auto name = name_of_option(*option);
    (is_inherited(*option, false) ? common : own) +=
        toml_line(name, value_of(*option), !takes_value(*option));
  }
  return own.empty() ? common : common + "\n[identify]\n" + own;
}

}  // namespace resonid::cli
