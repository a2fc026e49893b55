// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/io/experiment.hpp>
#include <resonid/plant/experiment.hpp>

#include "errors.hpp"
#include "options.hpp"
#include "output.hpp"
#include "truth_json.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

struct SimulateOptions {
  std::string experiment;
  std::string out;
  std::string truth;
  std::string json;
  std::uint64_t seed = 1;
  std::vector<double> lines_hz;
};

struct Statistics {
  double mean = 0.0;
  double deviation = 0.0;
  double lowest = 0.0;
  double highest = 0.0;
};

Statistics statistics(const std::vector<double>& x) {
  Statistics s;
  const auto count = static_cast<double>(x.size());
  for (const double v : x) s.mean += v / count;
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
  return csv_text(columns);
}

nlohmann::json summary_json(const SimulateOptions& o, const plant::Simulation& simulation) {
  const auto& record = simulation.record;
  nlohmann::json json{{"schema", "resonid.simulation/1"},        {"experiment", o.experiment},
                      {"seed", simulation.truth.seed},           {"samples", record.samples()},
                      {"sample_rate_hz", record.sample_rate_hz}, {"duration_s", record.duration_s()}};
  for (const auto* channel : {&record.excitation, &record.input, &record.output}) {
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

std::string summary_text(const SimulateOptions& o, const plant::Simulation& simulation) {
  const auto& record = simulation.record;
  const auto& truth = simulation.truth;
  std::string text = fmt::format("{}: {} samples at {:g} Hz, {:g} s, seed {}\n", o.experiment,
                                 record.samples(), record.sample_rate_hz, record.duration_s(), truth.seed);
  text += fmt::format("  {} drive",
                      plant::enum_names(truth.structure)[static_cast<std::size_t>(truth.structure)]);
  for (const auto& mode : truth.antiresonances)
    text += fmt::format(", anti-resonance {:.2f} Hz", mode.frequency_hz);
  for (const auto& mode : truth.resonances) text += fmt::format(", resonance {:.2f} Hz", mode.frequency_hz);
  if (truth.over_time) {
    const auto& resonance = truth.over_time->resonance_hz;
    const auto [low, high] = std::minmax_element(resonance.begin(), resonance.end());
    text += fmt::format("; over the run {:.2f} ... {:.2f} Hz", *low, *high);
  }
  text += "\n";
  text += fmt::format("  {}, feedback delay {:g} ms\n", truth.controller ? "closed loop" : "open loop",
                      1e3 * truth.delay_s);
  for (const auto* channel : {&record.excitation, &record.input, &record.output}) {
    const auto s = statistics(channel->samples);
    text += fmt::format("  {:<3} mean {:.4g}, deviation {:.4g}, {:.4g} ... {:.4g} {}\n", channel->name,
                        s.mean, s.deviation, s.lowest, s.highest, channel->unit);
  }
  if (!o.out.empty()) text += fmt::format("  record written to {}\n", o.out);
  if (!o.truth.empty()) text += fmt::format("  truth written to {}\n", o.truth);
  return text;
}

void run_simulate(const CLI::App& verb, const SimulateOptions& o) {
  const bool quiet = standard_output_taken({{"--out", o.out}, {"--truth", o.truth}, {"--json", o.json}});
  refuse_shared_files({o.experiment}, {{"--out", o.out}, {"--truth", o.truth}, {"--json", o.json}});
  auto config = io::read_experiment(o.experiment);
  if (!config) throw InputError(config.error().message);
  if (verb.get_option("--seed")->count() > 0) config->run.seed = o.seed;
  for (const double f : o.lines_hz)
    if (!(f > 0.0 && f <= 0.5 * config->run.sample_rate_hz))
      throw UsageError(
          fmt::format("--lines: found {} Hz, required > 0 and at most half the sample rate, {} Hz", f,
                      0.5 * config->run.sample_rate_hz));
  const auto simulation = plant::simulate_closed_loop(*config, o.lines_hz);
  if (!simulation) throw InputError(fmt::format("{}: {}", o.experiment, simulation.error().text()));
  if (!o.out.empty()) write_output(o.out, record_csv(simulation->record));
  if (!o.truth.empty()) write_json(o.truth, truth_json(simulation->truth));
  if (!o.json.empty()) write_json(o.json, summary_json(o, *simulation));
  if (!quiet) print(summary_text(o, *simulation));
}

}  // namespace

void add_simulate(CLI::App& app) {
  auto* verb = app.add_subcommand("simulate", "Runs a closed-loop experiment on a simulated drive");
  verb->footer(
      "Example:\n  resonid simulate experiments/demo.toml --out demo.csv --truth truth.json\n"
      "The record has the columns time_s, ru, u, y and, in closed loop, r.");
  const auto o = std::make_shared<SimulateOptions>();
  verb->add_option("EXPERIMENT", o->experiment,
                   "TOML file with [drive] [controller] [excitation] [measurement] [run]")
      ->required()
      ->type_name("FILE");
  verb->add_option("--out", o->out, "CSV file for the record ('-': standard output)")->type_name("FILE");
  verb->add_option("--truth", o->truth, "JSON file for what was true ('-': standard output)")
      ->type_name("FILE");
  add_count(*verb, "--seed", o->seed, "seed of the measurement noise, instead of the file's")
      ->default_str("");
  add_lines(
      *verb, "--lines", [o](std::span<const double> hz) { o->lines_hz.assign(hz.begin(), hz.end()); },
      "frequencies of the true response; otherwise the excitation's (Hz)");
  verb->add_option("--json", o->json, "summary for machines ('-': standard output)")->type_name("FILE");
  verb->callback([verb, o] { run_simulate(*verb, *o); });
}

}  // namespace resonid::cli
