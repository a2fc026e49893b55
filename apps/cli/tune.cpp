// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/identification/tune_export.hpp>
#include <resonid/io/controller_file.hpp>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/experiment.hpp>
#include <resonid/report/detail/tune.hpp>
#include <utility>

#include "brief.hpp"
#include "errors.hpp"
#include "experiment_source.hpp"
#include "first_loop.hpp"
#include "help.hpp"
#include "option_names.hpp"
#include "options.hpp"
#include "output.hpp"
#include "own_units.hpp"
#include "profile.hpp"
#include "progress.hpp"
#include "provenance.hpp"
#include "result_file.hpp"
#include "result_words.hpp"
#include "terminal.hpp"
#include "track_rows.hpp"
#include "tune_check.hpp"
#include "tune_conditions.hpp"
#include "tune_exports.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

struct TuneVerb {
  std::vector<std::string> results;
  identification::TuneOptions options;
  std::uint64_t biquads = 1, draws = 10'000;
  std::optional<std::string> evaluate, controller, schedule, experiment, first_loop;
  std::string evaluate_name;  ///< By the structure that the file of evaluate tells; empty: not told.
  std::optional<io::ControllerFile> evaluated;  ///< That file.
  std::optional<double> delay_s;                ///< With first_loop.
  std::vector<std::string> exports;
  identification::ExportNames names;
  TuneCheck check;
  std::string report, json;
  bool require_trusted = false;
};

io::ControllerFile controller_of(const char* option, const std::string& text, double sample_time_s) {
  auto read = io::read_controller(text, sample_time_s);
  if (!read) throw UsageError(fmt::format("{}: {}", option, message_of(read.error())));
  return *std::move(read);
}

/// Before anything is read.
TuneCall call_of(const TuneVerb& o) {
  TuneCall call;
  call.first_loop = o.first_loop.has_value();
  call.check = o.check.is_wanted();
  call.evaluate = o.evaluate.has_value();
  call.shaper = o.options.shaper;
  call.exports = !o.exports.empty();
  for (const auto& e : exports_of(o.exports)) {
    call.hal = call.hal || e.format == identification::ExportFormat::hal;
    call.klipper = call.klipper || e.format == identification::ExportFormat::klipper;
  }
  call.structure = o.options.structure;
  if (!o.evaluate) call.position_loop = call.structure == identification::ControllerStructure::cascade;
  return call;
}

/// A controller file tells the way of the reference too, and what is a position loop.
void read_controllers(TuneVerb& o, double sample_time_s) {
  auto& t = o.options;
  if (o.evaluate) {
    auto file = controller_of("--evaluate", *o.evaluate, sample_time_s);
    if (file.structure == "cascade" && !file.position_gain)
      throw UsageError(
          fmt::format("--evaluate: {} is a position loop and does not tell its \"position_gain\" (1/s), "
                      "required to judge it",
                      *o.evaluate));
    if (!file.denominator.empty())
      o.evaluate_name = name_of_structure(file.structure, file.denominator.size() - 1);
    o.evaluated = file;
    t.evaluate_reference = std::move(file.reference_numerator);
    t.evaluate_position_gain = file.position_gain;
    t.evaluate = data::Controller(data::TransferFunction(std::move(file)));
  }
  if (!o.controller) return;
  auto file = controller_of("--controller", *o.controller, sample_time_s);
  t.running_reference = std::move(file.reference_numerator);
  t.running_position_gain = file.position_gain;
  t.running = data::Controller(data::TransferFunction(std::move(file)));
}

/// Numbers with commas between them, or nothing.
std::optional<std::vector<double>> positions_in(const std::string& text) {
  std::vector<double> positions;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find(',', from), text.size());
    const auto position = io::parse_number(text.substr(from, to - from));
    if (!position) return std::nullopt;
    positions.push_back(*position);
    from = to + 1;
  }
  return positions;
}

/// Where --schedule is no list of positions.
std::optional<std::string> rows_file(const TuneVerb& o) {
  if (!o.schedule || positions_in(*o.schedule)) return std::nullopt;
  return o.schedule;
}

/// A result for each position that gains are scheduled over: those given, or one along the rows of a track.
void read_schedule(TuneVerb& o, std::vector<identification::Result>& results) {
  if (!o.schedule) return;
  const auto file = rows_file(o);
  if (!file) {
    o.options.positions = *positions_in(*o.schedule);
    return;
  }
  if (results.size() != 1)
    throw UsageError(
        fmt::format("--schedule: '{}': found {} RESULTs, required one, whose parameters the rows "
                    "follow; or a list of positions",
                    *file, results.size()));
  auto over = identification::results_over_position(results.front(), read_track_rows(*file, "--schedule"));
  if (!over) throw InputError(fmt::format("--schedule: '{}': {}", *file, message_of(over.error())));
  o.options.positions = std::move(over->positions);
  results = std::move(over->results);
}

/// What is read.
std::vector<std::string> input_files(const TuneVerb& o) {
  auto files = o.results;
  if (const auto rows = rows_file(o)) files.push_back(*rows);
  if (o.check.is_wanted()) files.push_back(o.check.record.record);
  for (const auto* text : {&o.evaluate, &o.controller, &o.experiment})
    if (*text && !(*text)->starts_with("pi:") && std::filesystem::exists(**text)) files.push_back(**text);
  return files;
}

std::string brief_of(const identification::Tuning& tuning) {
  auto said = report::sentences(tuning);
  const auto verdict = report::trust_text(tuning);
  if (!tuning.trusted && said.front().starts_with("Not trusted:") && verdict.starts_with("NOT trusted:"))
    said.erase(said.begin());  // the verdict itself
  return brief_text(verdict, said, tuning.findings);
}

std::optional<plant::ExperimentConfig> read_experiment(const TuneVerb& o) {
  if (!o.experiment) return std::nullopt;
  const auto source = experiment_source(*o.experiment);
  auto config = io::parse_experiment(source.text, source.name);
  if (!config) throw InputError("--simulate: " + message_of(config.error()));
  return *std::move(config);
}

/// In every text a result is called by the file that the call names, which it may share its recording with.
expected<identification::Tuning, Error> tuned(const TuneVerb& o,
                                              std::vector<identification::Result>& results) {
  std::vector<std::string> records;
  for (std::size_t i = 0; i < results.size(); ++i)
    records.push_back(std::exchange(results[i].record.file, o.results[std::min(i, o.results.size() - 1)]));
  auto tuning = identification::tune(results, o.options);
  for (std::size_t i = 0; i < results.size(); ++i) results[i].record.file = records[i];
  if (!tuning) return tuning;
  tuning->files = std::move(records);
  tuning->results = o.results;
  return tuning;
}

void simulate(const std::optional<plant::ExperimentConfig>& experiment, identification::Tuning& tuning,
              const identification::Result& result) {
  if (!experiment) {  // an unstable loop tells nothing more there
    if (tuning.proposed().stable) identification::simulate_on_model(tuning, result);
    return;
  }
  constexpr double kOnCircle = 1e-6;
  for (const auto& pole : tuning.proposed().feedback.poles())
    if (std::abs(pole) > 1.0 + kOnCircle)
      throw UsageError(fmt::format(
          "--simulate: found a controller that is unstable by itself, with a pole at |z| = {:.4g}, "
          "required one without a pole outside the unit circle",
          std::abs(pole)));
  const auto done = identification::simulate_on(tuning, *experiment);
  if (!done) throw UsageError(in_options(done.error()));
}

void check_record(const TuneVerb& o, identification::Tuning& tuning,
                  const std::vector<identification::Result>& designed_for) {
  std::vector<identification::Result> measured;  // once for all results that were identified alike
  for (std::size_t i = 0; i < designed_for.size(); ++i) {
    const auto same = std::ranges::find_if(
        designed_for, [&](const auto& other) { return are_checked_alike(other, designed_for[i]); });
    const auto at = static_cast<std::size_t>(same - designed_for.begin());
    if (at < measured.size())
      measured.push_back(identification::Result(measured[at]));
    else
      measured.push_back(identified_for_check(o.check, designed_for[i], o.results[i],
                                              tuning.proposed().feedback, o.options.progress));
  }
  const auto done = identification::check_on(tuning, designed_for, measured);
  if (!done) throw UsageError(in_options(done.error()));
}

/// What --controller and --evaluate read.
expected<std::string> file_export(const identification::Tuning& tuning, bool of_first_step) {
  const auto json = of_first_step ? report::first_step_json(tuning) : report::controller_json(tuning);
  if (!json) return tl::unexpected(json.error());
  return json->dump(2) + "\n";
}

/// All texts before the first is written.
void write(const TuneVerb& o, const std::vector<TuneExport>& exports, const std::vector<std::string>& inputs,
           bool quiet, identification::Tuning& tuning) {
  put_in_options(tuning);
  std::vector<std::string> texts;
  for (const auto& e : exports) {
    using identification::ExportFormat;
    const bool of_first_step = e.format == ExportFormat::first_step;
    auto text = of_first_step || e.format == ExportFormat::json
                    ? file_export(tuning, of_first_step)
                    : identification::exported(tuning, e.format, o.names);
    if (!text)
      throw UsageError(fmt::format("--export {}: {}{}", name_of(e.format), message_of(text.error()),
                                   exports.size() > 1 ? "; none of the other exports was written" : ""));
    texts.push_back(std::move(*text));
  }
  const auto provenance = provenance_of_files(inputs);
  for (std::size_t i = 0; i < exports.size(); ++i) write_output(exports[i].file, texts[i]);
  if (!o.report.empty()) {
    auto page = report::document(tuning);
    page.provenance = provenance;
    put_in_options(page.summary);
    write_output(o.report, report::document_page(page));
  }
  if (!o.json.empty()) {
    auto json = report::to_json(tuning);
    report::put_provenance(json, provenance);
    write_json(o.json, json);
  }
  if (!quiet) {
    print_summary(in_options(output_settings().brief ? brief_of(tuning) : report::summary_text(tuning)));
    if (!o.report.empty()) print(fmt::format("Report written to {}\n", o.report));
    for (const auto& e : exports) print(fmt::format("{} written to {}\n", name_of(e.format), e.file));
  }
}

void run_tune(CLI::App& verb, TuneVerb& o) {
  const auto exports = exports_of(o.exports);
  std::vector<std::pair<std::string_view, std::string_view>> outputs = {{"--report", o.report},
                                                                        {"--json", o.json}};
  for (const auto& e : exports) outputs.emplace_back("--export", e.file);
  const bool quiet = no_summary(outputs);
  const auto inputs = input_files(o);
  refuse_shared_files({inputs.begin(), inputs.end()}, outputs);
  for (const auto& [option, file] : outputs) refuse_unwritable({file});
  o.options.biquads = o.biquads;
  o.options.draws = o.draws;
  Progress progress;
  std::vector<identification::Result> results;
  for (const auto& file : o.results) results.push_back(read_result(file));
  inherit_for_tune(verb, o.check, results.front(), o.results.front());
  read_schedule(o, results);
  for (const auto& e : exports)
    if (const auto checked = identification::check_exportable(o.options, e.format); !checked)
      throw UsageError(fmt::format("--export {}: {}", name_of(e.format), message_of(checked.error())));
  const auto experiment = read_experiment(o);
  const double sample_time_s = 1.0 / results.front().record.sample_rate_hz;
  read_controllers(o, sample_time_s);
  auto call = call_of(o);
  call.by_response = !results.front().model;
  if (o.evaluate) call.position_loop = o.options.evaluate_position_gain.has_value();
  refuse_unused(verb, call);
  o.options.progress = [&progress](std::string_view stage) { progress.stage(stage); };
  auto tuning = tuned(o, results);
  if (!tuning) throw UsageError(in_options(tuning.error()));
  if (auto& judged = tuning->candidates.front(); !o.evaluate_name.empty() && !judged.position_gain)
    judged.name = o.evaluate_name;
  if (o.evaluated && !put_parts(*o.evaluated, tuning->candidates.front()))
    throw UsageError(fmt::format(
        "--evaluate: {}: \"gains\" and what stands beside them are not what numerator, denominator "
        "and reference_numerator are made of; required the same law, or none of them",
        *o.evaluate));
  put_own_units(results.front(), *tuning);
  if (tuning->schedule && o.check.is_wanted())
    throw UsageError("--check: found with --schedule, required the controller of one place (--evaluate)");
  if (tuning->by_response && (o.experiment || o.check.is_wanted()))
    throw UsageError(fmt::format("{}: needs a drive model, which {} does not hold",
                                 o.experiment ? "--simulate" : "--check", o.results.front()));
  if (!tuning->by_response) {
    progress.stage("simulating");
    simulate(experiment, *tuning, results.front());
  }
  if (o.check.is_wanted()) {
    progress.stage("checking on " + o.check.record.record);
    check_record(o, *tuning, results);
  }
  write(o, exports, inputs, quiet, *tuning);
  if (o.require_trusted && !tuning->trusted)
    throw NotTrustedError("the controller is not sure to work; the findings say why");
  // A design may be trusted though a recording cannot tell.
  if (o.require_trusted && tuning->check && !tuning->check->agrees)
    throw NotTrustedError("the check does not tell that the loop is as promised; the findings say why");
}

/// A design from a RESULT, or from what is known before there is one.
void run(CLI::App& verb, TuneVerb& o) {
  if (!o.first_loop) {
    if (o.results.empty()) throw UsageError("RESULT is required, or --first-loop");
    refuse_unused(verb, call_of(o));
    return run_tune(verb, o);
  }
  if (!o.results.empty())
    throw UsageError(
        "--first-loop: found with a RESULT, required one of them: with a result there is more to go by");
  refuse_unused(verb, call_of(o));
  std::optional<double> sample_rate_hz;
  const auto* rate = verb.get_option("--sample-rate");
  if (rate->count() > 0 && !is_from_profile(*rate)) sample_rate_hz = o.check.record.columns.sample_rate_hz;
  run_first_loop(
      {*o.first_loop, sample_rate_hz, o.delay_s, o.options.torque_limit, o.exports, o.names, o.json});
}

void add_wishes(CLI::App& verb, TuneVerb& o) {
  auto& t = o.options;
  verb.option_defaults()->group("Specification");
  add_enum(verb, "--structure", t.structure, "what the controller is made of");
  add_number(verb, "--ms", t.largest_sensitivity, "X", "largest |S|: 1.4 keeps 42 deg and 11 dB");
  add_number(verb, "--load-peak", t.largest_load_transfer, "X",
             "largest |T_load|, reference to the load's velocity: 1.3 calm, 1.5 stiff");
  add_number(
      verb, "--position-peak", t.largest_position_transfer, "X",
      "largest |T_position|, position of the load by its reference, of a cascade, in place of --load-peak");
  add_number(verb, "--mt", t.largest_complementary, "X", "largest |T|");
  add_number(verb, "--controller-peak", t.largest_controller_sensitivity, "X",
             "largest |C S| in torque per velocity; default: twice that of the best PI");
  add_count(verb, "--biquads", o.biquads, "filters of pi+biquads, 1 ... 4", 1);
  add_number(verb, "--bandwidth", t.least_bandwidth_hz, "HZ", "least bandwidth of the load, or refuse");
  add_number(verb, "--max-torque", t.torque_limit, "NM", "torque limit of the drive");
  add_number(verb, "--noise-torque", t.largest_noise_torque, "NM",
             "largest rms of the torque that measurement noise makes");
  add_number(verb, "--step", t.reference_step, "X",
             "step of the velocity reference, of a cascade of the position's, that figures are given for");
  add_number(verb, "--overshoot", t.overshoot, "PART", "of the load after it, for the set-point weight");
  verb.option_defaults()->group("Uncertainty");
  add_number(verb, "--confidence", t.confidence, "P", "probability that every bound is met");
  add_enum(verb, "--guarantee", t.guarantee, "what the confidence is of: ellipsoid is surer and softer");
  add_number(verb, "--delay-uncertainty", t.delay_std_s, "SECONDS",
             "standard deviation of the delay; default: that of the result, else a quarter of a sample");
  add_count(verb, "--draws", o.draws, "machines that the confidence is counted on", 100);
  add_count(verb, "--seed", t.seed, "seed of draws and searches");
  verb.add_flag("--force", t.force, "also of a result that is not trusted; every output says so");
}

}  // namespace

void add_tune(CLI::App& app) {
  auto* verb = app.add_subcommand(
      "tune", "Designs a controller that holds its margins for every machine in the error bars");
  verb->footer(
      "Examples:\n"
      "  resonid tune result.json --report tune.html --export json:controller.json\n"
      "  resonid tune result.json --structure pi --ms 1.6 --load-peak 1.5 --export st:controller.st\n"
      "  resonid tune result.json --evaluate pi:2,0.1\n"
      "  resonid tune result.json --evaluate controller.json --check after.csv\n"
      "  resonid tune result.json --schedule rows.csv --export c:controller.h\n"
      "  resonid tune --first-loop motor_inertia=0.032,largest_ratio=10 --sample-rate 500 --delay 0.004\n"
      "RESULT.json is what 'resonid identify ... --json FILE' writes; of several one controller suits all "
      "machines, or with --schedule gains over their positions; of one, with the rows of a track, gains over "
      "the positions of these. Controller, units and scales are those that the result stores unless given. A "
      "controller that is exported is in SI units, as the result is.");
  const auto o = std::make_shared<TuneVerb>();
  verb->add_option("RESULT", o->results, "results of identify --json")->type_name("RESULT.json ...");
  add_wishes(*verb, *o);
  verb->option_defaults()->group("Before there is a result");
  add_text(
      *verb, "--first-loop", o->first_loop,
      "a soft loop to excite the machine in: two of motor_inertia=J1, total_inertia=J, largest_ratio=J2/J1; "
      "torque_lag_s, least_damping; with --sample-rate",
      "NAME=X,...");
  add_number(*verb, "--delay", o->delay_s, "SECONDS", "from its torque to the measured velocity");
  verb->option_defaults()->group("Loop");
  add_text(*verb, "--controller", o->controller,
           "the controller that ran, to compare with: pi:KP,TI or a JSON file", "SPEC");
  add_text(*verb, "--evaluate", o->evaluate, "judge this controller in place of designing one", "SPEC");
  add_text(*verb, "--schedule", o->schedule,
           "gains over position: positions of the results, or rows of 'resonid track --out FILE'",
           "POSITION,...|FILE");
  add_number(*verb, "--speed", o->options.largest_speed, "X",
             "largest speed of that position per s: refused where the gains change too quickly");
  verb->add_flag("--shaper", o->options.shaper, "also choose an input shaper for the loop");
  add_number(*verb, "--shaper-limit", o->options.shaper_limit, "PART",
             "residual vibration that it may leave");
  add_text(*verb, "--simulate", o->experiment,
           "show the controller on the drive of this experiment (a file, or the name of a shipped one); "
           "default: on the model, with its friction",
           "EXPERIMENT");
  add_check_options(*verb, o->check);
  add_summary_options(*verb);
  verb->add_option("--export", o->exports,
                   "take the controller away: json, c, c-float, st, hal, klipper; first-step: a json of its "
                   "first step")
      ->type_name("FORMAT:FILE");
  verb->add_option("--export-name", o->names.name,
                   "name of what is exported; default: velocity_controller, of a cascade position_controller")
      ->type_name("NAME");
  static constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
  add_choice(
      *verb, "--export-axis", kAxes, [o](std::size_t i) { o->names.axis = kAxes[i]; },
      "the printer's axis, of klipper")
      ->default_str(o->names.axis);
  verb->add_option("--export-thread", o->names.thread, "the thread that runs it, of hal")->type_name("NAME");
  verb->add_option("--report", o->report, "self-contained HTML report")->type_name("FILE");
  verb->add_option("--json", o->json, "design for machines ('-': standard output)")->type_name("FILE");
  verb->add_flag("--require-trusted", o->require_trusted,
                 "exit code 3 when the controller is not sure to work, or --check fails or is undecided");
  verb->callback([verb, o] { run(*verb, *o); });
}

}  // namespace resonid::cli
