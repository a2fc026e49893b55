// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/plant/experiment.hpp>
#include <resonid/report/detail/page.hpp>
#include <resonid/report/json.hpp>

#include "brief.hpp"
#include "help.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "provenance.hpp"
#include "result_words.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

constexpr const char* kExperiment = "demo";  // a shipped one

struct DemoOptions {
  std::string report = "resonid-demo.html";
  std::string json;
};

/// "anti-resonance 10.67 Hz, resonance 15.09 Hz": what the simulated drive has.
std::string truth_text(const plant::Truth& truth) {
  std::string text;
  const auto add = [&text](const char* name, const std::vector<data::UndampedMode>& modes) {
    for (const auto& mode : modes)
      text += fmt::format("{}{} {:.2f} Hz", text.empty() ? "" : ", ", name, mode.frequency_hz);
  };
  add("anti-resonance", truth.antiresonances);
  add("resonance", truth.resonances);
  return text;
}

void run_demo(const DemoOptions& o) {
  const bool quiet = no_summary({{"--report", o.report}, {"--json", o.json}});
  refuse_shared_files({}, {{"--report", o.report}, {"--json", o.json}});
  refuse_unwritable({o.report, o.json});
  Progress progress;
  progress.stage(fmt::format("simulating {}", kExperiment));
  auto simulation = plant::simulate_closed_loop(io::shipped_experiment(kExperiment)).value();
  auto& record = simulation.record;
  record.source = fmt::format("{} (simulated)", kExperiment);
  identification::Options options;
  options.controller = simulation.truth.controller;
  options.delay_s = simulation.truth.delay_s;
  options.progress = [&progress](std::string_view stage) { progress.stage(stage); };
  auto result = identification::identify(record, options).value();
  put_in_options(result);
  progress.stage("writing");
  std::error_code unknown;
  const bool replaced = o.report != "-" && std::filesystem::is_regular_file(o.report, unknown);
  const auto with_provenance = [](nlohmann::json data) {
    report::put_provenance(data, provenance_of_files({}));
    return data;
  };
  write_output(o.report, report::page(with_provenance(report::page_json(result, record))));
  if (!o.json.empty()) write_json(o.json, with_provenance(report::to_json(result)));
  if (quiet) return;
  print_summary(output_settings().brief
                    ? brief_text(trusted_text(result.trusted), report::sentences(result), result.findings)
                    : report::summary_text(result));
  print(fmt::format("\nThe simulated drive has {}.\nPage {} {}: open it in a browser.\n",
                    truth_text(simulation.truth), replaced ? "replaced in" : "written to", o.report));
  print(
      "Next, on a recording of your own (time, torque, velocity):\n"
      "  resonid identify recording.csv --report report.html\n"
      "or on other simulated drives: resonid simulate --list\n");
}

}  // namespace

void add_demo(CLI::App& app) {
  auto* verb = app.add_subcommand("demo", "Simulates a drive, identifies it and writes a page, in a second");
  verb->footer(
      "Example:\n"
      "  resonid demo --report demo.html\n"
      "The drive is the shipped experiment 'demo': two masses and a belt, a chirp in closed loop, noise and "
      "delay.");
  const auto o = std::make_shared<DemoOptions>();
  add_summary_options(*verb);
  verb->add_option("--report", o->report, "self-contained HTML report")
      ->type_name("FILE")
      ->default_str(o->report);
  verb->add_option("--json", o->json, "result for machines ('-': standard output)")->type_name("FILE");
  verb->callback([o] { run_demo(*o); });
}

}  // namespace resonid::cli
