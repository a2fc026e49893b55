// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/io/controller_file.hpp>
#include <resonid/io/number_list.hpp>
#include <resonid/io/record_reader.hpp>
#include <resonid/io/response_file.hpp>
#include <resonid/report/json.hpp>
#include <resonid/report/page.hpp>

#include "errors.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

using identification::ExcitationType;
using identification::Method;
using identification::ModelChoice;

struct IdentifyOptions {
  std::string record;
  io::ColumnMapping columns;
  identification::Options options;
  std::string controller;
  std::string report, json, response;
  double sample_rate_hz = 0.0;
  double lambda = 0.0, pole_radius = 0.0;
  bool require_trusted = false;
};

void add_text(CLI::App& verb, const std::string& name, std::optional<std::string>& target,
              const std::string& doc, const std::string& type) {
  verb.add_option_function<std::string>(
          name, [&target](const std::string& text) { target = text; }, doc)
      ->type_name(type);
}

void add_seconds(CLI::App& verb, const std::string& name, std::optional<double>& target,
                 const std::string& doc) {
  verb.add_option_function<std::string>(
          name,
          [name, &target](const std::string& text) {
            target = io::parse_number(text);
            if (!target)
              throw UsageError(fmt::format("{}: found '{}', required a number of seconds", name, text));
          },
          doc)
      ->type_name("SECONDS");
}

/// Numbers with colons, "LO:HI".
void add_colons(CLI::App& verb, const std::string& name, std::size_t count, const std::string& form,
                std::function<void(const std::vector<double>&)> assign, const std::string& doc) {
  verb.add_option_function<std::string>(
          name,
          [name, count, form, assign](const std::string& text) {
            const auto numbers = io::parse_colons(text, count, form);
            if (!numbers) throw UsageError(name + ": " + numbers.error().message);
            assign(*numbers);
          },
          doc)
      ->type_name(form);
}

void add_record_options(CLI::App& verb, IdentifyOptions& o) {
  static constexpr std::array<std::string_view, 3> kQuantities = {"velocity", "position", "acceleration"};
  static constexpr std::array<std::string_view, 2> kMotions = {"rotary", "linear"};
  auto& c = o.columns;
  add_text(verb, "--time", c.time, "time column, in seconds", "COL");
  add_number(verb, "--sample-rate", o.columns.sample_rate_hz, "HZ",
             "sample rate, for a record without a time column");
  add_text(verb, "--input", c.input, "input u: torque (force) that the drive receives", "COL");
  add_text(verb, "--output", c.output, "output y: what is measured on the driven side", "COL");
  add_text(verb, "--excitation", c.excitation, "excitation ru, added to the controller's output", "COL");
  add_text(verb, "--reference", c.reference, "reference r of the loop", "COL");
  add_number(verb, "--input-scale", c.input_scale, "X", "factor of the input, for example 0.564 Nm/A");
  add_number(verb, "--output-scale", c.output_scale, "X",
             "factor of the output, for example -1 for a mirrored encoder");
  add_text(verb, "--input-unit", c.input_unit, "unit of the scaled input, if its column's name does not tell",
           "UNIT");
  add_text(verb, "--output-unit", c.output_unit, "unit of the scaled output", "UNIT");
  add_choice(
      verb, "--motion", kMotions, [&c](std::size_t i) { c.motion = static_cast<data::Motion>(i); },
      "kgm2 and Nm/rad, or kg and N/m")
      ->default_str("rotary");
  add_choice(
      verb, "--output-quantity", kQuantities,
      [&c](std::size_t i) { c.output_quantity = static_cast<data::OutputQuantity>(i); },
      "what the output is; the response is always that of the velocity")
      ->default_str("velocity");
  add_seconds(verb, "--from", c.from_s, "first instant used");
  add_seconds(verb, "--to", c.to_s, "first instant no longer used");
}

void add_method_options(CLI::App& verb, IdentifyOptions& o) {
  static constexpr std::array<std::string_view, 6> kTypes = {"auto", "chirp",        "multisine",
                                                             "prbs", "stepped-sine", "other"};
  static constexpr std::array<std::string_view, 9> kMethods = {
      "auto",        "kalman",        "sliding-dft", "welch", "periodic", "local-polynomial",
      "local-cubic", "least-squares", "model"};
  static constexpr std::array<std::string_view, 4> kApproaches = {"auto", "direct", "indirect", "joint"};
  static constexpr std::array<std::string_view, 4> kModels = {"auto", "none", "rigid", "two-mass"};
  auto& k = o.options;
  add_choice(
      verb, "--excitation-type", kTypes,
      [&k](std::size_t i) { k.excitation_type = static_cast<ExcitationType>(i); },
      "how the drive was excited")
      ->default_str("auto");
  add_colons(
      verb, "--chirp", 3, "F0:F1:SECONDS",
      [&k](const std::vector<double>& v) {
        k.chirp = identification::Chirp{v[0], v[1], v[2]};
      },
      "the excitation is a linear chirp from the first used sample on; otherwise detected");
  add_lines(
      verb, "--lines", [&k](std::span<const double> hz) { k.lines_hz.assign(hz.begin(), hz.end()); },
      "frequencies to report");
  static_assert(std::is_same_v<std::size_t, std::uint64_t>);
  add_count(verb, "--period-samples", k.period_samples, "period of the excitation; otherwise detected");
  add_count(verb, "--drop-periods", k.drop_periods, "discard so many periods at the start");
  add_choice(
      verb, "--method", kMethods, [&k](std::size_t i) { k.method = static_cast<Method>(i); },
      "how the response is measured")
      ->default_str("auto");
  add_choice(
      verb, "--approach", kApproaches,
      [&k](std::size_t i) {
        k.approach = i == 0 ? std::nullopt : std::optional(static_cast<Approach>(i - 1));
      },
      "auto: joint with an excitation, else direct")
      ->default_str("auto");
  verb.add_option("--controller", o.controller, "controller of the loop: pi:KP,TI or a JSON file")
      ->type_name("SPEC");
  add_number(verb, "--delay", k.delay_s, "SECONDS", "known delay in the measured output");
  add_colons(
      verb, "--band", 2, "LO:HI",
      [&k](const std::vector<double>& v) {
        k.band_hz = {v[0], v[1]};
      },
      "frequencies to use, in Hz");
  add_choice(
      verb, "--model", kModels, [&k](std::size_t i) { k.model = static_cast<ModelChoice>(i); },
      "drive model to fit")
      ->default_str("auto");
  add_number(verb, "--confidence", k.confidence, "P", "of the error bars");
  add_number(verb, "--lambda", o.lambda, "X",
             "kalman: fixed gain of the published filter instead of placed poles");
  add_number(verb, "--pole-radius", o.pole_radius, "R", "kalman: radius of the placed poles, 0 ... 1");
  verb.add_flag(
      "--no-smoothing", [&k](std::int64_t) { k.tracker.smoothing = false; },
      "kalman: one pass, with the filter's lag");
  verb.add_flag(
      "--no-offset", [&k](std::int64_t) { k.tracker.offset = false; }, "kalman: without the constant state");
}

void run_identify(const CLI::App& verb, IdentifyOptions& o) {
  const bool quiet =
      standard_output_taken({{"--report", o.report}, {"--json", o.json}, {"--response", o.response}});
  refuse_shared_files({o.record}, {{"--report", o.report}, {"--json", o.json}, {"--response", o.response}});
  if (verb.get_option("--lambda")->count() > 0) o.options.tracker.lambda = o.lambda;
  if (verb.get_option("--pole-radius")->count() > 0) o.options.tracker.pole_radius = o.pole_radius;
  if (verb.get_option("--sample-rate")->count() > 0 && !(o.columns.sample_rate_hz > 0.0))
    throw UsageError(fmt::format("--sample-rate: found {:g}, required > 0 Hz", o.columns.sample_rate_hz));
  const double radius = o.options.radius_m.value_or(1.0);
  if (!(radius > 0.0)) throw UsageError(fmt::format("--radius: found {:g} m, required > 0", radius));
  Progress progress;
  progress.stage("reading " + o.record);
  const auto record = io::read_record(o.record, o.columns);
  if (!record) throw InputError(record.error().message);
  if (!o.controller.empty()) {
    auto controller = io::read_controller(o.controller, record->sample_time_s());
    if (!controller) throw UsageError("--controller: " + controller.error().message);
    o.options.controller = std::move(*controller);
  }
  o.options.progress = [&progress](std::string_view stage) { progress.stage(stage); };
  const auto result = identification::identify(*record, o.options);
  if (!result) throw UsageError("--" + result.error().option + ": " + result.error().message);
  progress.stage("writing");
  if (!o.response.empty()) write_output(o.response, io::response_csv(result->response));
  if (!o.report.empty()) write_output(o.report, report::page(report::page_json(*result, *record)));
  if (!o.json.empty()) write_json(o.json, report::to_json(*result));
  if (!quiet) {
    print(report::summary_text(*result));
    if (!o.report.empty()) print(fmt::format("Report written to {}\n", o.report));
  }
  if (o.require_trusted && !result->trusted)
    throw NotTrustedError("the result is not to be trusted; the findings say why");
}

}  // namespace

void add_identify(CLI::App& app) {
  auto* verb =
      app.add_subcommand("identify", "Finds response, resonance, parameters and margins in a record");
  verb->footer(
      "Examples:\n"
      "  resonid identify demo.csv --chirp 35:1.5:17 --controller pi:1.036,0.147 --delay 0.004 --report "
      "demo.html\n"
      "  resonid identify bench.csv --input iq_A --input-scale 0.564 --output theta_rad\n"
      "      --output-quantity position --drop-periods 1\n"
      "Columns with usual names (time, u, torque, y, velocity, ru, ...) are found without options.");
  const auto o = std::make_shared<IdentifyOptions>();
  verb->add_option("RECORD", o->record, "CSV or MAT file")->required()->type_name("FILE");
  add_record_options(*verb, *o);
  add_method_options(*verb, *o);
  verb->add_option_function<std::string>(
          "--radius",
          [o](const std::string& text) {
            o->options.radius_m = io::parse_number(text);
            if (!o->options.radius_m)
              throw UsageError(fmt::format("--radius: found '{}', required a number", text));
          },
          "radius of the driven roller: also report stiffness in N/m")
      ->type_name("M");
  verb->add_option("--report", o->report, "self-contained HTML report")->type_name("FILE");
  verb->add_option("--json", o->json, "result for machines ('-': standard output)")->type_name("FILE");
  verb->add_option("--response", o->response, "frequency response as CSV")->type_name("FILE");
  verb->add_flag("--require-trusted", o->require_trusted, "exit code 3 when the result is not to be trusted");
  verb->callback([verb, o] { run_identify(*verb, *o); });
}

}  // namespace resonid::cli
