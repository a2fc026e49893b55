// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/identification/join.hpp>
#include <resonid/io/csv.hpp>
#include <resonid/report/detail/page.hpp>
#include <resonid/report/json.hpp>

#include "brief.hpp"
#include "errors.hpp"
#include "help.hpp"
#include "identify_many.hpp"
#include "inherit.hpp"
#include "option_names.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "provenance.hpp"
#include "record_options.hpp"
#include "result_file.hpp"
#include "result_words.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

void identify_one(const CLI::App& verb, IdentifyOptions& o) {
  const std::vector<std::pair<std::string_view, std::string_view>> outputs = {
      {"--report", o.report},
      {"--json", o.json},
      {"--response", o.response},
      {"--save-profile", o.save_profile}};
  const bool quiet = no_summary(outputs);
  refuse_shared_files({o.record.record, o.validate_on.empty() ? o.record.record : o.validate_on}, outputs);
  refuse_unwritable({o.report, o.json, o.response, o.save_profile});
  Progress progress;
  progress.stage("reading " + o.record.record);
  const auto record = read_record(verb, o.record);
  complete(o.method, record);
  o.method.options.jobs = o.jobs;
  o.method.options.progress = [&progress](std::string_view stage) { progress.stage(stage); };
  auto result = identification::identify(record, o.method.options);
  if (!result) throw UsageError(in_options(result.error()));
  validate_elsewhere(verb, o, *result);
  put_in_options(*result);
  result->options = given_options(verb);
  progress.stage("writing");
  if (!o.save_profile.empty()) write_output(o.save_profile, profile_text(verb, result->record));
  if (!o.response.empty()) write_response(o.response, *result);
  const auto with_provenance = [&](nlohmann::json data) {
    report::put_provenance(data, provenance_of_files({o.record.record, o.validate_on}));
    return data;
  };
  if (!o.report.empty())
    write_output(o.report, report::page(with_provenance(report::page_json(*result, record))));
  if (!o.json.empty()) write_json(o.json, with_provenance(report::to_json(*result)));
  if (!quiet) {
    print_summary(output_settings().brief ? brief_text(trusted_text(result->trusted),
                                                       report::sentences(*result), result->findings)
                                          : report::summary_text(*result));
    if (!o.report.empty()) print(fmt::format("Report written to {}\n", o.report));
  }
  if (o.require_trusted && !result->trusted)
    throw NotTrustedError("the result is not reliable; the findings say why");
}

void run_identify(const CLI::App& verb, IdentifyOptions& o) {
  check(verb, o.method);
  if (o.join && o.record.columns.second_output)
    throw UsageError("--second-output: is fitted recording by recording; leave --join out");
  if (o.join)
    if (const auto joinable = identification::check_join(o.method.options); !joinable)
      throw UsageError(in_options(joinable.error()));
  if (!o.validate_on.empty() && o.method.options.model == identification::ModelChoice::none)
    throw UsageError("--validate-on: simulates the model; required --model other than none");
  const auto files = expanded(o.records);
  if (!o.save_profile.empty() && files.size() > 1)
    throw UsageError("--save-profile: holds what one recording was read with; required a single recording");
  if (std::find(files.begin(), files.end(), o.validate_on) != files.end())
    throw UsageError("--validate-on: " + o.validate_on + " is fitted too; required a recording of its own");
  if (files.size() > 1) return identify_many(verb, o, files);
  if (o.join) throw UsageError("--join: joins repeated experiments; found 1 recording, required at least 2");
  o.record.record = files.front();
  identify_one(verb, o);
}

}  // namespace

void add_identify(CLI::App& app) {
  auto* verb =
      app.add_subcommand("identify", "Finds response, resonance, parameters and margins in a recording");
  verb->footer(
      "Examples:\n"
      "  resonid identify demo.csv --chirp 35:1.5:17 --controller pi:1.036,0.147 --delay 0.004 --report "
      "demo.html\n"
      "  resonid identify bench.csv --input iq_A --input-scale 0.564 --output theta_rad\n"
      "      --output-quantity position --drop-periods 1\n"
      "  resonid identify bench/*.csv --join --report bench.html --json bench.json\n"
      "Several recordings give one table, one report and one JSON; a recording that cannot be read gets a "
      "row with "
      "its error, does not stop the others, and makes the exit code 2.\n"
      "Columns with usual names (time, u, torque, y, velocity, ru, ...) are found without options.");
  const auto o = std::make_shared<IdentifyOptions>();
  verb->add_option("RECORD", o->records,
                   "CSV or MAT files, also packed (.gz), or folders of them; - is standard input")
      ->required()
      ->type_name("FILE ...");
  add_signal_options(*verb, o->record);
  add_second_output_options(*verb, o->record);
  add_excitation_options(*verb, o->method);
  add_method_option(*verb, o->method, "how the response is measured");
  add_loop_options(*verb, o->method);
  verb->add_option("--planned-controller", o->method.planned_controller,
                   "also show the margins with this controller, which is to run")
      ->type_name("SPEC");
  add_result_options(*verb, o->method);
  add_model_options(*verb, o->method);
  add_tracker_options(*verb, o->method);
  add_summary_options(*verb);
  verb->add_option("--report", o->report, "self-contained HTML report")->type_name("FILE");
  verb->add_option("--json", o->json, "result for machines ('-': standard output)")->type_name("FILE");
  verb->add_option("--response", o->response, "frequency response as CSV (several recordings: with --join)")
      ->type_name("FILE");
  verb->add_flag("--join", o->join,
                 "take several recordings for repetitions of one experiment: one estimate of all");
  verb->add_option("--validate-on", o->validate_on,
                   "simulate the model on this recording too, to which it is not fitted")
      ->type_name("FILE");
  add_count(*verb, "--jobs", o->jobs, "threads for several recordings or the bootstrap; 0: one per core");
  verb->add_option("--save-profile", o->save_profile,
                   "write the options given and the columns found as a profile for later calls")
      ->type_name("FILE.toml");
  verb->add_flag("--require-trusted", o->require_trusted, "exit code 3 when the result is not reliable");
  verb->callback([verb, o] { run_identify(*verb, *o); });
}

}  // namespace resonid::cli
