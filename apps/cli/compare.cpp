// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/compare.hpp>
#include <resonid/io/controller_file.hpp>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/report/detail/compare.hpp>

#include "brief.hpp"
#include "errors.hpp"
#include "help.hpp"
#include "inherit.hpp"
#include "option_names.hpp"
#include "options.hpp"
#include "output.hpp"
#include "provenance.hpp"
#include "result_file.hpp"
#include "result_words.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

struct CompareVerb {
  std::string first, second;
  std::string controller, weight;
  identification::CompareOptions options;
  std::string report, json;
  bool require_trusted = false, require_unchanged = false;
};

/// A plain factor, or a transfer function.
data::TransferFunction weight_of(const std::string& text, double sample_time_s) {
  if (const auto factor = io::parse_number(text)) {
    if (*factor == 0.0) throw UsageError("--weight: found 0, required a number other than 0 or a JSON file");
    return {{*factor}, {1.0}, sample_time_s};
  }
  const auto file = io::read_controller(text, sample_time_s);
  if (!file) throw UsageError("--weight: " + message_of(file.error()));
  return *file;
}

void run_compare(CLI::App& verb, CompareVerb& o) {
  const bool quiet = no_summary({{"--report", o.report}, {"--json", o.json}});
  refuse_shared_files({o.first, o.second}, {{"--report", o.report}, {"--json", o.json}});
  if (!o.controller.empty() && !o.weight.empty())
    throw UsageError("--weight: found beside --controller, required one of the two");
  if (!(o.options.confidence > 0.0 && o.options.confidence < 1.0))
    throw UsageError(fmt::format("--confidence: found {:g}, required between 0 and 1", o.options.confidence));
  refuse_unwritable({o.report, o.json});
  const auto first = read_result(o.first), second = read_result(o.second);
  // With a weight of its own the comparison needs none, the Nyquist curves of the page do.
  if (o.weight.empty() || !o.report.empty()) {
    inherit(verb, first.options, o.first);
    if (o.controller.empty()) inherit(verb, second.options, o.second);
  }
  const double sample_time_s = 1.0 / first.record.sample_rate_hz;
  std::optional<data::TransferFunction> controller;
  if (!o.controller.empty()) {
    auto read = io::read_controller(o.controller, sample_time_s);
    if (!read) throw UsageError("--controller: " + message_of(read.error()));
    controller = std::move(*read);
  }
  if (!o.weight.empty())
    o.options.weight = weight_of(o.weight, sample_time_s);
  else if (controller)
    o.options.weight = controller;
  auto comparison = identification::compare(first, second, o.options).value();
  put_in_options(comparison);
  const auto provenance = provenance_of_files({o.first, o.second});
  if (!o.report.empty()) {
    report::ComparedResults results{first, second};
    results.controller = controller;
    auto page = report::document(comparison, results);
    page.provenance = provenance;
    write_output(o.report, report::document_page(page));
  }
  if (!o.json.empty()) {
    auto json = report::to_json(comparison);
    report::put_provenance(json, provenance);
    write_json(o.json, json);
  }
  if (!quiet) {
    print_summary(output_settings().brief
                      ? brief_text(std::string(comparison.changed ? "Changed." : "No change shown.") +
                                       (comparison.trusted ? "" : " NOT trusted."),
                                   report::sentences(comparison), comparison.findings)
                      : report::summary_text(comparison));
    if (!o.report.empty()) print(fmt::format("Report written to {}\n", o.report));
  }
  if (o.require_trusted && !comparison.trusted)
    throw NotTrustedError("the comparison is not reliable; the findings say why");
  if (o.require_unchanged && comparison.changed)
    throw NotTrustedError("the two results differ significantly");
}

}  // namespace

void add_compare(CLI::App& app) {
  auto* verb = app.add_subcommand("compare", "Tells what changed between two results, and how surely");
  verb->footer(
      "Example:\n"
      "  resonid compare january.json june.json --controller pi:1.036,0.147 --report changes.html\n"
      "A.json and B.json are what 'resonid identify ... --json FILE' writes. Responses are compared by their "
      "chordal distance, which depends on the unit: they are scaled by the controller, that of A (else of B) "
      "unless given, or by a "
      "weight (--weight 1: not at all).");
  const auto o = std::make_shared<CompareVerb>();
  verb->add_option("A", o->first, "result of identify --json, the baseline")->required()->type_name("A.json");
  verb->add_option("B", o->second, "result of identify --json, what it is now")
      ->required()
      ->type_name("B.json");
  verb->option_defaults()->group("Comparison");
  verb->add_option("--controller", o->controller,
                   "scale both responses by the controller: pi:KP,TI or a JSON file")
      ->type_name("SPEC");
  verb->add_option("--weight", o->weight,
                   "scale them by a number, or by the transfer function of a JSON file")
      ->type_name("X|FILE");
  add_number(*verb, "--confidence", o->options.confidence, "P",
             "of the verdict over all differences together");
  add_summary_options(*verb);
  verb->add_option("--report", o->report, "self-contained HTML report")->type_name("FILE");
  verb->add_option("--json", o->json, "comparison for machines ('-': standard output)")->type_name("FILE");
  verb->add_flag("--require-trusted", o->require_trusted, "exit code 3 when the comparison is not reliable");
  verb->add_flag("--require-unchanged", o->require_unchanged,
                 "exit code 3 when anything changed significantly");
  verb->callback([verb, o] { run_compare(*verb, *o); });
}

}  // namespace resonid::cli
