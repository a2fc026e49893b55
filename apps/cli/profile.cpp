// SPDX-License-Identifier: MIT
#include "profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/profile.hpp>
#include <resonid/io/detail/suggestion.hpp>
#include <set>

#include "errors.hpp"
#include "help.hpp"
#include "output.hpp"
#include "terminal.hpp"

namespace resonid::cli {
namespace {

constexpr const char* kUsualFile = "resonid.toml";
/// Not for a profile.
constexpr std::array<std::string_view, 7> kOfTheCommand = {"help",         "version", "profile", "no-profile",
                                                           "save-profile", "list",    "schema"};
/// Options of which one makes the other's default void, beside those that exclude one another.
constexpr std::array<std::pair<std::string_view, std::string_view>, 2> kAlternatives = {
    {{"controller", "weight"}, {"time", "sample-rate"}}};

struct Taken {
  std::string file;
  std::vector<std::string> names;             // without dashes, in the order of the verb's options
  std::map<std::string, std::string> places;  // in the file, of each
  bool told = false;
};
Taken& taken() {
  static Taken all;
  return all;
}

/// The options of a verb that a profile may give, by their names.
std::map<std::string, const CLI::Option*> keys_of(const CLI::App& verb) {
  std::map<std::string, const CLI::Option*> keys;
  for (const auto* option : verb.get_options())
    for (const auto& name : option->get_lnames())
      if (!option->get_group().empty() &&
          std::find(kOfTheCommand.begin(), kOfTheCommand.end(), name) == kOfTheCommand.end())
        keys[name] = option;
  return keys;
}

/// Those of the verb and all below it.
std::set<std::string> all_keys(const CLI::App& verb) {
  std::set<std::string> names;
  for (const auto& [name, option] : keys_of(verb)) names.insert(name);
  for (const auto* kind : listed_verbs(verb)) names.merge(all_keys(*kind));
  return names;
}

/// The verb that a table is for.
const CLI::App* verb_of_table(const CLI::App& app, std::string_view table) {
  if (table.empty()) return &app;
  const auto dot = std::min(table.find('.'), table.size());
  for (const auto* verb : listed_verbs(app))
    if (verb->get_name() == table.substr(0, dot))
      return verb_of_table(*verb, table.substr(std::min(dot + 1, table.size())));
  return nullptr;
}

/// Refuses tables and keys that no verb has.
void check_entry(const CLI::App& app, const io::ProfileEntry& entry) {
  const auto* verb = verb_of_table(app, entry.table);
  if (verb == nullptr) {
    std::vector<std::string> names;
    for (const auto* known : listed_verbs(app)) names.push_back(known->get_name());
    throw InputError(fmt::format("{}: unknown table '{}'{}; tables are named after verbs", entry.where,
                                 entry.table, io::suggestion(entry.table, names)));
  }
  if (entry.key.empty()) return;
  const auto known = all_keys(*verb);
  if (known.contains(entry.key)) return;
  throw InputError(fmt::format("{}: unknown key '{}'{}; keys are the names of options{}, without dashes",
                               entry.where, entry.key,
                               io::suggestion(entry.key, {known.begin(), known.end()}),
                               entry.table.empty() ? "" : " of '" + command_of(*verb) + "'"));
}

/// What the arguments say: which verb, where its options begin, which options they give, which profile.
struct CommandLine {
  const CLI::App* verb = nullptr;
  std::string table;  // the verb's, "excite.chirp"
  std::size_t behind_verb = 0;
  std::set<std::string> given;
  std::string file;
  bool no_profile = false, explains = false;
};

CommandLine command_line(const CLI::App& app, const std::vector<std::string>& arguments) {
  CommandLine line;
  line.verb = &app;
  for (std::size_t i = 0; i < arguments.size() && arguments[i] != "--"; ++i) {
    const auto& word = arguments[i];
    if (!word.starts_with('-')) {
      const auto verbs = listed_verbs(*line.verb);
      const auto verb = std::find_if(verbs.begin(), verbs.end(),
                                     [&](const CLI::App* known) { return known->get_name() == word; });
      if (verb == verbs.end()) continue;
      line.verb = *verb;
      line.table += (line.table.empty() ? "" : ".") + word;
      line.behind_verb = i + 1;
      continue;
    }
    const auto name = word.substr(0, word.find('='));
    const auto* option = line.verb->get_option_no_throw(name);
    if (name == "--no-profile") line.no_profile = true;
    if (name == "-h" || name == "--help" || name == "-V" || name == "--version") line.explains = true;
    if (name.starts_with("--")) line.given.insert(name.substr(2));
    const bool value_follows =
        option != nullptr && takes_value(*option) && name.size() == word.size() && i + 1 < arguments.size();
    if (name == "--profile")
      line.file = name.size() < word.size() ? word.substr(name.size() + 1)
                  : value_follows           ? arguments[i + 1]
                                            : "";
    if (value_follows) ++i;
  }
  return line;
}

/// A list as the option has it: with colons where its form has them alone, otherwise with commas.
std::string joined(const CLI::Option& option, const std::vector<std::string>& values) {
  const auto form = option.get_type_name();
  const bool colons = form.find(':') != std::string::npos && form.find(',') == std::string::npos;
  return fmt::format("{}", fmt::join(values, colons ? ":" : ","));
}

/// "--name=value"; nothing for a flag that is not to be set.
std::string argument_of(const CLI::Option& option, const io::ProfileEntry& entry) {
  const std::string name = "--" + entry.key;
  if (!takes_value(option)) {
    if (!entry.is_boolean)
      throw InputError(fmt::format("{}: '{}' requires true or false", entry.where, entry.key));
    return entry.values.front() == "true" ? name : "";
  }
  if (entry.is_boolean)
    throw InputError(fmt::format("{}: '{}' requires a value ({}), found {}", entry.where, entry.key,
                                 option.get_type_name(), entry.values.front()));
  return name + "=" + joined(option, entry.values);
}

/// Whether an option that is given makes this one's default void.
bool is_ruled_out(const CLI::Option& option, const std::string& name, const std::set<std::string>& given) {
  if (given.contains(name)) return true;
  for (const auto* other : option.get_excludes())
    for (const auto& excluded : other->get_lnames())
      if (given.contains(excluded)) return true;
  return std::any_of(kAlternatives.begin(), kAlternatives.end(), [&](const auto& pair) {
    return (name == pair.first && given.contains(std::string(pair.second))) ||
           (name == pair.second && given.contains(std::string(pair.first)));
  });
}

}  // namespace

void add_profile_options(CLI::App& app) {
  if (app.get_name() == "help") return;
  app.option_defaults()->group("General");
  app.add_option("--profile", "defaults of all options, a TOML file; otherwise resonid.toml of this folder")
      ->type_name("FILE");
  app.add_flag_function(
      "--no-profile", [](std::int64_t) {}, "pass over a resonid.toml");
  for (auto* verb : app.get_subcommands({})) add_profile_options(*verb);
}

std::vector<std::string> with_profile(const CLI::App& app, std::vector<std::string> arguments) {
  const auto line = command_line(app, arguments);
  const bool told = line.given.contains("profile");
  if (told && line.no_profile)
    throw UsageError("--profile: found beside --no-profile, required one of the two");
  std::error_code unknown;
  if (line.verb == &app || line.verb->get_name() == "help" || line.no_profile || line.explains)
    return arguments;
  if (told && line.file.empty()) return arguments;  // the parser says what is missing
  if (!told && !std::filesystem::is_regular_file(kUsualFile, unknown)) return arguments;
  const std::string file = told ? line.file : kUsualFile;
  auto entries = io::read_profile(file);
  const char* hint = told ? "" : "; --no-profile passes over it";
  if (!entries) throw InputError(message_of(entries.error()) + hint);
  std::map<std::string, std::string> words;  // of the options
  const auto keys = keys_of(*line.verb);
  std::stable_sort(entries->begin(), entries->end(), [](const auto& a, const auto& b) {
    return a.table.size() < b.table.size();  // a special table overrules a common one
  });
  for (const auto& entry : *entries) {
    try {
      check_entry(app, entry);
      const bool ours =
          entry.table.empty() || line.table == entry.table || line.table.starts_with(entry.table + ".");
      const auto key = keys.find(entry.key);
      if (!ours || key == keys.end() || is_ruled_out(*key->second, entry.key, line.given)) continue;
      words[entry.key] = argument_of(*key->second, entry);
      taken().places[entry.key] = entry.where;
    } catch (const InputError& error) {
      throw InputError(error.what() + std::string(hint));
    }
  }
  taken().file = file;
  std::vector<std::string> added;
  for (const auto* option : line.verb->get_options())
    for (const auto& name : option->get_lnames())
      if (const auto word = words.find(name); word != words.end() && !word->second.empty()) {
        added.push_back(word->second);
        taken().names.push_back(name);
      }
  arguments.insert(arguments.begin() + static_cast<std::ptrdiff_t>(line.behind_verb), added.begin(),
                   added.end());
  return arguments;
}

bool is_from_profile(const CLI::Option& option) {
  const auto& names = option.get_lnames();
  return std::any_of(names.begin(), names.end(), [](const std::string& name) {
    return std::find(taken().names.begin(), taken().names.end(), name) != taken().names.end();
  });
}

std::string profile_place(const std::string& complaint) {
  for (const auto& name : taken().names)
    if (complaint.starts_with("--" + name + ":")) return " (" + taken().places[name] + ")";
  return {};
}

void forget_profile_of(const CLI::Option& option) {
  for (const auto& name : option.get_lnames()) std::erase(taken().names, name);
}

void tell_profile() {
  auto& all = taken();
  if (all.told || all.names.empty() || output_settings().quiet) return;
  all.told = true;
  print_error(fmt::format("resonid: profile {}: {}\n", all.file, fmt::join(all.names, ", ")));
}

}  // namespace resonid::cli
