// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/experiment_schema.hpp>
#include <resonid/io/detail/suggestion.hpp>
#include <resonid/io/experiment.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/plant/experiment.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/detail/truth.hpp>
#include <resonid/report/json.hpp>

#include "errors.hpp"
#include "experiment_source.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "provenance.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

struct SimulateOptions {
  std::string experiment;
  std::string out;
  std::string truth;
  std::string json;
  std::string report;
  std::uint64_t seed = 1;
  double duration_s = 0.0;
  std::vector<double> lines_hz;
  bool list = false;
  bool schema = false;
};

/// The comment that a file begins with, up to the line that ends a sentence.
std::string about(std::string_view text) {
  std::string words;
  while (text.starts_with("# ")) {
    const auto end = std::min(text.find('\n'), text.size());
    words += (words.empty() ? "" : " ") + std::string(text.substr(2, end - 2));
    if (words.ends_with('.') && !words.ends_with("...")) break;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return words;
}

void run_list(const SimulateOptions& o) {
  nlohmann::json json{{"schema", "resonid.experiments/1"}, {"experiments", nlohmann::json::array()}};
  std::string text;
  for (const auto& shipped : io::shipped_experiments()) {
    text += fmt::format("{:<26} {}\n", shipped.name, about(shipped.text));
    json["experiments"].push_back({{"name", shipped.name}, {"about", about(shipped.text)}});
  }
  if (!o.json.empty()) write_json(o.json, json);
  if (o.json != "-") print_text(text);
}

struct Statistics {
  double mean = 0.0;
  double deviation = 0.0;
  double lowest = 0.0;
  double highest = 0.0;
};

Statistics statistics(const std::vector<double>& x) {
  Statistics s;
  const auto count = static_cast<double>(x.size());
  for (const double v : x) s.mean += v;
  s.mean /= count;
  for (const double v : x) s.deviation += (v - s.mean) * (v - s.mean) / count;
  s.deviation = std::sqrt(s.deviation);
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  s.lowest = *low;
  s.highest = *high;
  return s;
}

std::string record_csv(const data::Record& record) {
  std::vector<double> time(record.samples());
  for (std::size_t k = 0; k < time.size(); ++k) time[k] = static_cast<double>(k) / record.sample_rate_hz;
  std::vector<CsvColumn> columns{{"time_s", time},
                                 {"ru", record.excitation.samples},
                                 {"u", record.input.samples},
                                 {"y", record.output.samples}};
  if (record.reference.present()) columns.push_back({"r", record.reference.samples});
  if (record.position.present()) columns.push_back({"position", record.position.samples});
  if (record.second_output.present())
    columns.push_back({record.second_output.name, record.second_output.samples});
  return csv_text(columns);
}

std::vector<const data::Channel*> channels_of(const data::Record& record) {
  std::vector<const data::Channel*> channels{&record.excitation, &record.input, &record.output};
  for (const auto* channel : {&record.reference, &record.position, &record.second_output})
    if (channel->present()) channels.push_back(channel);
  return channels;
}

nlohmann::json summary_json(const SimulateOptions& o, const plant::Simulation& simulation) {
  const auto& record = simulation.record;
  nlohmann::json json{{"schema", "resonid.simulation/1"},        {"experiment", o.experiment},
                      {"seed", simulation.truth.seed},           {"samples", record.samples()},
                      {"sample_rate_hz", record.sample_rate_hz}, {"duration_s", record.duration_s()}};
  for (const auto* channel : channels_of(record)) {
    const auto s = statistics(channel->samples);
    json["signals"][channel->name] = {{"unit", channel->unit},
                                      {"mean", s.mean},
                                      {"standard_deviation", s.deviation},
                                      {"minimum", s.lowest},
                                      {"maximum", s.highest}};
  }
  if (!o.out.empty() && o.out != "-") json["file"] = o.out;
  if (!o.truth.empty() && o.truth != "-") json["truth"] = o.truth;
  return json;
}

/// "0.38 ... 1.65"
std::string range_text(const std::vector<double>& x) {
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  return fmt::format("{:.4g} ... {:.4g}", *low, *high);
}

std::string machine_text(const plant::Truth& truth) {
  std::string text = fmt::format("  {} drive", name_of(truth.structure));
  const auto add = [&text](const std::vector<data::UndampedMode>& modes, const char* kind) {
    for (std::size_t i = 0; i < modes.size(); ++i)
      text += i == 0 ? fmt::format(", {}{} {:.2f}", kind, modes.size() > 1 ? "s" : "", modes[i].frequency_hz)
                     : fmt::format(", {:.2f}", modes[i].frequency_hz);
    if (!modes.empty()) text += " Hz";
  };
  add(truth.antiresonances, "anti-resonance");
  add(truth.resonances, "resonance");
  text += truth.resonances.empty() ? ", no resonance\n" : truth.over_time ? " at the start\n" : "\n";
  if (!truth.over_time) return text;
  text += fmt::format("  over the run: resonance {} Hz", range_text(truth.over_time->resonance_hz));
  if (!truth.over_time->position_m.empty())
    text += fmt::format(", position {} m", range_text(truth.over_time->position_m));
  return text + "\n";
}

std::string summary_text(const SimulateOptions& o, const plant::Simulation& simulation) {
  const auto& record = simulation.record;
  const auto& truth = simulation.truth;
  std::string text = fmt::format("{}: {} samples at {:g} Hz, {:g} s, seed {}\n", o.experiment,
                                 record.samples(), record.sample_rate_hz, record.duration_s(), truth.seed);
  text += machine_text(truth);
  text += fmt::format("  {}, feedback delay {:g} ms\n", truth.controller ? "closed loop" : "open loop",
                      1e3 * truth.delay_s);
  for (const auto* channel : channels_of(record)) {
    const auto s = statistics(channel->samples);
    text += fmt::format("  {:<8} mean {:.4g}, standard deviation {:.4g}, {:.4g} ... {:.4g} {}\n",
                        channel->name, s.mean, s.deviation, s.lowest, s.highest, channel->unit);
  }
  if (!o.out.empty()) text += fmt::format("  recording written to {}\n", o.out);
  if (!o.truth.empty()) text += fmt::format("  truth written to {}\n", o.truth);
  if (!o.report.empty()) text += fmt::format("  report written to {}\n", o.report);
  return text;
}

/// `--list` and `--schema`; true when one of them was asked for.
bool told_about(const SimulateOptions& o) {
  if (o.list && o.schema) throw UsageError("--list and --schema: required one of them");
  if ((o.list || o.schema) && !o.experiment.empty())
    throw UsageError(fmt::format("EXPERIMENT: found '{}', required none with {}", o.experiment,
                                 o.list ? "--list" : "--schema"));
  if ((o.list || o.schema) &&
      (!o.out.empty() || !o.truth.empty() || !o.report.empty() || (o.schema && !o.json.empty())))
    throw UsageError(
        fmt::format("{}: runs nothing, required no file for a result", o.list ? "--list" : "--schema"));
  if (o.list) run_list(o);
  if (o.schema) print(io::experiment_schema());
  if (o.list || o.schema) return true;
  if (o.experiment.empty())
    throw UsageError("EXPERIMENT: required: a TOML file or the name of a shipped experiment (see --list)");
  return false;
}

plant::Simulation simulated(const CLI::App& verb, const SimulateOptions& o) {
  const bool shorter = verb.get_option("--duration")->count() > 0;
  if (shorter && !(o.duration_s > 0.0))
    throw UsageError(fmt::format("--duration: found {:g} s, required > 0", o.duration_s));
  const ExperimentSource source = experiment_source(o.experiment);
  auto config =
      io::parse_experiment(source.text, source.name, shorter ? std::optional(o.duration_s) : std::nullopt);
  if (!config) throw InputError(message_of(config.error()));
  if (verb.get_option("--seed")->count() > 0) config->run.seed = o.seed;
  for (const double f : o.lines_hz)
    if (!(f > 0.0 && f <= 0.5 * config->run.sample_rate_hz))
      throw UsageError(
          fmt::format("--lines: found {} Hz, required > 0 and at most half the sample rate, {} Hz", f,
                      0.5 * config->run.sample_rate_hz));
  auto simulation = plant::simulate_closed_loop(*config, o.lines_hz);
  if (!simulation)
    throw InputError(message_of(io::explain_experiment(source.text, source.name, simulation.error())));
  return std::move(*simulation);
}

void run_simulate(const CLI::App& verb, const SimulateOptions& o) {
  if (told_about(o)) return;
  const bool quiet =
      no_summary({{"--out", o.out}, {"--truth", o.truth}, {"--json", o.json}, {"--report", o.report}});
  refuse_shared_files({o.experiment},
                      {{"--out", o.out}, {"--truth", o.truth}, {"--json", o.json}, {"--report", o.report}});
  refuse_unwritable({o.out, o.truth, o.json, o.report});
  Progress progress;
  progress.stage("simulating " + o.experiment);
  const auto simulation = simulated(verb, o);
  progress.stage("writing");
  if (!o.out.empty()) write_output(o.out, record_csv(simulation.record));
  const auto provenance = provenance_of_files({o.experiment});
  const auto write_with_provenance = [&](const std::string& path, nlohmann::json json) {
    report::put_provenance(json, provenance);
    write_json(path, json);
  };
  if (!o.truth.empty())
    write_with_provenance(o.truth, report::to_json(report::simulated_truth(simulation.truth)));
  if (!o.json.empty()) write_with_provenance(o.json, summary_json(o, simulation));
  if (!o.report.empty()) {
    auto page = report::document(simulation);
    page.provenance = provenance;
    write_output(o.report, report::document_page(page));
  }
  if (!quiet) print_text(summary_text(o, simulation));
}

}  // namespace

void add_simulate(CLI::App& app) {
  auto* verb = app.add_subcommand("simulate", "Runs an experiment on a simulated drive");
  verb->footer(
      "Example:\n"
      "  resonid simulate experiments/demo.toml --out demo.csv --truth truth.json\n"
      "  resonid simulate --list\n"
      "  resonid simulate friction_reversal --duration 2 --out record.csv\n"
      "The recording has the columns time_s, ru, u, y; in closed loop r; of a tooth belt and under a "
      "position "
      "controller position; load_position or load_acceleration where it is measured.\n"
      "docs/experiment_files.md (or --schema) explains the files.");
  const auto o = std::make_shared<SimulateOptions>();
  verb->add_option("EXPERIMENT", o->experiment, "TOML file, or the name of a shipped experiment")
      ->type_name("FILE|NAME");
  verb->option_defaults()->group("Results");
  verb->add_option("--out", o->out, "CSV file for the recording ('-': standard output)")->type_name("FILE");
  verb->add_option("--truth", o->truth, "JSON file for what was true ('-': standard output)")
      ->type_name("FILE");
  verb->option_defaults()->group("Run");
  add_number(*verb, "--duration", o->duration_s, "SECONDS", "length of the recording, instead of the file's");
  add_count(*verb, "--seed", o->seed, "seed of the measurement noise, instead of the file's")
      ->default_str("");
  add_lines(
      *verb, "--lines", [o](std::span<const double> hz) { o->lines_hz.assign(hz.begin(), hz.end()); },
      "frequencies of the true response; otherwise the excitation's (Hz)");
  verb->option_defaults()->group("Results");
  verb->add_option("--json", o->json, "summary for machines ('-': standard output)")->type_name("FILE");
  verb->add_option("--report", o->report, "self-contained HTML report")->type_name("FILE");
  verb->option_defaults()->group("Instead of a run");
  verb->add_flag("--list", o->list, "names the shipped experiments, with --json for machines");
  verb->add_flag("--schema", o->schema, "prints all tables and keys of an experiment file as Markdown");
  verb->callback([verb, o] { run_simulate(*verb, *o); });
}

}  // namespace resonid::cli
