// SPDX-License-Identifier: MIT
#include "tune_check.hpp"

#include <algorithm>
#include <array>
#include <resonid/identification/detail/inspect.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/io/record_reader.hpp>
#include <utility>

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

bool is_told(const CLI::App& verb, const char* name) {
  const auto* option = verb.get_option(name);
  return option->count() > 0 && !is_from_profile(*option);
}

/// A column of excitation or second output that the result names need not be in another recording, and the
/// excitation then is the one that is found.
data::Record read_checked(const TuneCheck& check) {
  auto columns = check.record.columns;
  auto record = io::read_record(check.record.record, columns);
  if (!record) {
    if (!check.told_excitation) columns.excitation.reset();
    if (!check.told_second_output) columns.second_output.reset();
    auto found = io::read_record(check.record.record, columns);
    if (!found) throw InputError("--check: " + in_options(record.error()));
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
  check.told_excitation = is_told(verb, "--excitation");
  check.told_second_output = is_told(verb, "--second-output");
  inherit_wanted(verb, result.options, file, [&](const CLI::Option& option) {
    const auto name = long_name(option);
    if (name == "controller") return true;
    // Without a drive model there is no check, which is refused later.
    if (!check.is_wanted() || !result.model || name == "from" || name == "to") return false;
    return option.get_group() == "Recording" ||
           std::find(kHowIdentified.begin(), kHowIdentified.end(), name) != kHowIdentified.end();
  });
}

identification::Result identified_for_check(CLI::App& verb, TuneCheck& check,
                                            const identification::Result& designed_for,
                                            const std::string& file, const data::TransferFunction& controller,
                                            std::function<void(std::string_view)> progress) {
  auto& options = check.method.options;
  options.controller = data::Controller(controller);
  options.delay_s = designed_for.known_delay_s;
  options.progress = std::move(progress);
  const auto record = read_checked(check);
  const auto group = verb.get_options([](const CLI::Option* o) { return o->get_group() == "Excitation"; });
  const bool told =
      std::any_of(group.begin(), group.end(), [](const CLI::Option* o) { return o->count() > 0; });
  if (!told && !tells_excitation(record, options))
    inherit_wanted(verb, designed_for.options, file,
                   [](const CLI::Option& o) { return o.get_group() == "Excitation"; });
  cli::check(verb, check.method);
  auto measured = identification::identify(record, options);
  if (!measured) throw UsageError("--check: " + in_options(measured.error()));
  return *std::move(measured);
}

}  // namespace resonid::cli
