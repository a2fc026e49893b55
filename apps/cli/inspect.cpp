// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/identification/detail/inspect.hpp>
#include <resonid/io/detail/column_facts.hpp>
#include <resonid/report/detail/inspection.hpp>

#include "errors.hpp"
#include "inherit.hpp"
#include "option_names.hpp"
#include "output.hpp"
#include "provenance.hpp"
#include "record_options.hpp"
#include "result_words.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

struct InspectVerb {
  RecordOptions record;
  std::string report, json;
};

/// What a unit asks for, or columns that were not found.
std::string further_options(const report::FileInspection& i, const RecordOptions& o) {
  std::string text;
  if (!i.recording) {
    if (!o.columns.input) text += " --input COL";
    if (!o.columns.output) text += " --output COL";
    return text;
  }
  for (const auto& note : i.recording->record.reading)
    for (const char* option : {"--torque-constant", "--rated-torque", "--counts-per-rev"})
      if (note.find(std::string("give ") + option) != note.npos) text += fmt::format(" {} X", option);
  if (i.recording->loop == identification::LoopState::closed) text += " --controller pi:KP,TI";
  return text;
}

/// The options of this call that name columns and units.
std::string words_given(const CLI::App& verb) {
  std::string text;
  for (const auto& option : given_options(verb)) {
    text += " --" + option.name;
    if (option.value != "true") text += " " + shell_word(option.value);
  }
  return text;
}

std::string command_of(const CLI::App& verb, const InspectVerb& o, const report::FileInspection& i) {
  const std::string page = o.record.record == "-"
                               ? "report.html"
                               : std::filesystem::path(o.record.record).stem().string() + ".html";
  return fmt::format("resonid identify {}{}{} --report {}", shell_word(o.record.record), words_given(verb),
                     further_options(i, o.record), shell_word(page));
}

void run_inspect(const CLI::App& verb, const InspectVerb& o) {
  const bool quiet = no_summary({{"--report", o.report}, {"--json", o.json}});
  refuse_shared_files({o.record.record}, {{"--report", o.report}, {"--json", o.json}});
  refuse_unwritable({o.report, o.json});
  const auto table = io::read_table(o.record.record, o.record.columns.layout);
  if (!table) throw InputError(in_options(table.error()));
  report::FileInspection i;
  i.file = table->source;
  i.rows = table->columns.front().size();
  i.reading = table->notes;
  for (const auto& c : io::column_facts(*table))
    i.columns.push_back({c.name, c.unit, c.guess, c.missing, c.least, c.greatest});
  const auto record = io::to_record(*table, o.record.columns);
  if (record) {
    auto inspection = identification::inspect(*record);
    if (inspection)
      i.recording = std::move(*inspection);
    else
      i.obstacle = in_options(inspection.error());
  } else {
    i.obstacle = in_options(record.error());
  }
  put_in_options(i.reading);
  if (i.recording) {
    put_in_options(i.recording->record.reading);
    put_in_options(i.recording->findings);
  }
  i.command = command_of(verb, o, i);
  const auto provenance = provenance_of_files({o.record.record});
  if (!o.report.empty()) {
    auto page = report::document(i, record ? &*record : nullptr);
    page.provenance = provenance;
    write_output(o.report, report::document_page(page));
  }
  if (!o.json.empty()) {
    auto json = report::to_json(i);
    report::put_provenance(json, provenance);
    write_json(o.json, json);
  }
  if (quiet) return;
  print_summary(report::summary_text(i));
  if (!o.report.empty()) print(fmt::format("Report written to {}\n", o.report));
}

}  // namespace

void add_inspect(CLI::App& app) {
  auto* verb = app.add_subcommand("inspect", "Shows what a file holds, and the command to go on with");
  verb->footer(
      "Examples:\n"
      "  resonid inspect recording.csv\n"
      "  resonid inspect trace.csv --report trace.html\n"
      "Columns with their units and what they seem to be; of the recording in them rate, gaps, resolution, "
      "drift,\n"
      "excitation, and whether the loop was closed. The options are those of identify.");
  const auto o = std::make_shared<InspectVerb>();
  add_record_options(*verb, o->record);
  verb->option_defaults()->group("Results");
  verb->add_option("--report", o->report, "self-contained HTML page: signals and spectra")->type_name("FILE");
  verb->add_option("--json", o->json, "for machines ('-': standard output)")->type_name("FILE");
  verb->callback([verb, o] { run_inspect(*verb, *o); });
}

}  // namespace resonid::cli
