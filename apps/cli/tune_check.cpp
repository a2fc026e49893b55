// SPDX-License-Identifier: MIT
#include "tune_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <resonid/identification/detail/inspect.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/io/record_reader.hpp>
#include <string>
#include <utility>
#include <vector>

#include "errors.hpp"
#include "inherit.hpp"
#include "options.hpp"
#include "profile.hpp"
#include "result_words.hpp"

namespace resonid::cli {
namespace {

constexpr std::array<std::string_view, 11> kHowIdentified = {
    "method", "model",  "friction",    "ground",       "torque-lag", "output-filter",
    "radius", "lambda", "pole-radius", "no-smoothing", "no-offset"};

std::string long_name(const CLI::Option& option) {
  return option.get_lnames().empty() ? std::string() : option.get_lnames().front();
}

bool is_told(const TuneCheck& check, std::string_view name) {
  return std::ranges::any_of(check.told, [&](const auto& t) { return t.name == name && !t.by_profile; });
}

/// Those that the verb has.
void give(CLI::App& verb, const std::vector<TuneCheck::Told>& told, bool by_profile) {
  for (const auto& t : told) {
    auto* option = verb.get_option_no_throw("--" + t.name);
    if (option == nullptr || option->count() > 0 || t.by_profile != by_profile) continue;
    for (const auto& value : t.values) option->add_result(value);
    option->run_callback();
  }
}

/// A column of excitation or second output that the result names need not be in another recording, and the
/// excitation then is the one that is found.
data::Record read_checked(const TuneCheck& check, const TuneCheck& told, const std::string& file) {
  auto columns = check.record.columns;
  auto record = io::read_record(check.record.record, columns);
  if (!record) {
    if (!is_told(told, "excitation")) columns.excitation.reset();
    if (!is_told(told, "second-output")) columns.second_output.reset();
    auto found = io::read_record(check.record.record, columns);
    if (!found)
      throw InputError(
          fmt::format("--check: {} (read as the recording of {} was)", in_options(record.error()), file));
    record = std::move(found);
  }
  return *std::move(record);
}

/// Whether the recording by itself shows with what it was excited.
bool tells_excitation(const data::Record& record, const identification::Options& options) {
  const auto seen = identification::inspect(record, options);
  return seen && seen->excitation != name_of(identification::ExcitationType::other);
}

}  // namespace

void add_check_options(CLI::App& verb, TuneCheck& check) {
  verb.option_defaults()->group("Check");
  verb.add_option("--check", check.record.record,
                  "a recording under the controller that is judged (--evaluate) or was designed, with an "
                  "excitation: is the loop as promised? It is identified as the result was, unless given")
      ->type_name("RECORD");
  add_signal_options(verb, check.record);
  add_second_output_options(verb, check.record);
  add_excitation_options(verb, check.method);
  add_method_option(verb, check.method, "how the response of the recording of --check is measured");
  add_radius_option(verb, check.method);
  add_drive_model_option(verb, check.method);
  add_drive_options(verb, check.method);
  add_tracker_options(verb, check.method);
}

void inherit_for_tune(CLI::App& verb, TuneCheck& check, const identification::Result& result,
                      const std::string& file) {
  for (const auto* option : verb.get_options())
    if (option->count() > 0 && !long_name(*option).empty())
      check.told.push_back({long_name(*option), option->results(), is_from_profile(*option)});
  inherit_wanted(verb, result.options, file,
                 [](const CLI::Option& option) { return long_name(option) == "controller"; });
}

bool are_checked_alike(const identification::Result& a, const identification::Result& b) {
  constexpr std::array<std::string_view, 7> kOfOneRecord = {
      "controller", "planned-controller", "approach", "delay", "from", "to", "band"};
  const auto of_check = [&](const identification::Result& r) {
    std::vector<std::pair<std::string, std::string>> stored;
    for (const auto& o : r.options)
      if (std::ranges::find(kOfOneRecord, o.name) == kOfOneRecord.end()) stored.emplace_back(o.name, o.value);
    std::ranges::sort(stored);
    return stored;
  };
  return a.known_delay_s == b.known_delay_s && of_check(a) == of_check(b);
}

identification::Result identified_for_check(const TuneCheck& told, const identification::Result& designed_for,
                                            const std::string& file, const data::TransferFunction& controller,
                                            std::function<void(std::string_view)> progress) {
  // A call of its own: what one result stores is nothing that another was told.
  TuneCheck check;
  CLI::App verb;
  add_check_options(verb, check);
  give(verb, told.told, false);
  inherit_wanted(verb, designed_for.options, file, [](const CLI::Option& option) {
    const auto name = long_name(option);
    if (name == "from" || name == "to") return false;
    return option.get_group() == "Recording" ||
           std::ranges::find(kHowIdentified, name) != kHowIdentified.end();
  });
  give(verb, told.told, true);
  auto& options = check.method.options;
  options.controller = data::Controller(controller);
  options.delay_s = designed_for.known_delay_s;
  options.progress = std::move(progress);
  const auto record = read_checked(check, told, file);
  const auto group = verb.get_options([](const CLI::Option* o) { return o->get_group() == "Excitation"; });
  const bool has_excitation =
      std::any_of(group.begin(), group.end(), [](const CLI::Option* o) { return o->count() > 0; });
  if (!has_excitation && !tells_excitation(record, options))
    inherit_wanted(verb, designed_for.options, file,
                   [](const CLI::Option& o) { return o.get_group() == "Excitation"; });
  cli::check(verb, check.method);
  auto measured = identification::identify(record, options);
  if (!measured)
    throw UsageError(fmt::format("--check: {} (identified as {} was)", in_options(measured.error()), file));
  return *std::move(measured);
}

}  // namespace resonid::cli
