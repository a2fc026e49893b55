// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/controller_file.hpp>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/detail/suggestion.hpp>
#include <resonid/planning/plan.hpp>
#include <resonid/report/detail/plan.hpp>

#include "brief.hpp"
#include "errors.hpp"
#include "help.hpp"
#include "name_values.hpp"
#include "option_names.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "provenance.hpp"
#include "result_file.hpp"
#include "result_words.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

struct PlanOptions {
  planning::PlanConfig config;
  std::string model, parameters, controller, accuracy;
  std::optional<double> noise, sample_rate_hz, delay_s;
  std::optional<double> max_torque, max_excitation, max_torque_rms, max_velocity, max_stroke, max_time_s;
  std::optional<double> period_s;
  std::string out, experiment, json, report;
};

void read_parameters(const std::string& text, fit::DriveModel& model) {
  std::vector<std::string> known(fit::kParameterNames.begin(), fit::kParameterNames.end());
  // The known delay is an option of its own; plans know neither the torque loop's lag nor springs to the
  // ground.
  std::erase_if(known, [](const std::string& name) {
    const auto is = [&](fit::Parameter p) {
      return name == fit::kParameterNames[static_cast<std::size_t>(p)];
    };
    return is(fit::kDelay) || is(fit::kTorqueLag) || is(fit::kOutputFilter) ||
           is(fit::kMotorGroundStiffness) || is(fit::kLoadGroundStiffness);
  });
  std::array<std::optional<double>, fit::kParameterCount> given;
  for (const auto& item : name_values("--parameters", text)) {
    const double number = number_of("--parameters", item, known);
    const auto at = std::find(fit::kParameterNames.begin(), fit::kParameterNames.end(), item.name);
    given[static_cast<std::size_t>(at - fit::kParameterNames.begin())] = number;
  }
  const bool three = given[fit::kMiddleInertia] || given[fit::kStiffness2] || given[fit::kDamping2];
  const bool two = given[fit::kLoadInertia] || given[fit::kStiffness] || given[fit::kDamping];
  model.structure = three ? fit::Structure::three_mass
                    : two ? fit::Structure::two_mass
                          : fit::Structure::rigid;
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (const auto at = static_cast<std::size_t>(i); i != fit::kDelay && i != fit::kViscousFriction &&
                                                     fit::has_parameter(model.structure, i) && !given[at])
      throw UsageError(
          fmt::format("--parameters: {} is required{}", fit::kParameterNames[at],
                      two || three ? fmt::format(" of a {} drive", fit::name_of(model.structure)) : ""));
  const auto value = [&](fit::Parameter p) { return given[static_cast<std::size_t>(p)].value_or(0.0); };
  model.parameters = {
      data::TwoMassParameters{value(fit::kDrivenInertia), value(fit::kLoadInertia), value(fit::kStiffness),
                              value(fit::kDamping), value(fit::kViscousFriction)},
      value(fit::kMiddleInertia), value(fit::kStiffness2), value(fit::kDamping2)};
  model.parameters.load_viscous_friction = value(fit::kLoadViscousFriction);
  model.estimated =
      fit::estimated_parameters(model.structure, given[fit::kViscousFriction].has_value(), false);
}

/// Model, known delay, and where the file tells it the noise.
void read_model(PlanOptions& o) {
  const auto result = read_result(o.model);
  if (!result.model) throw InputError(o.model + ": holds no drive model; required a result with one");
  auto& drive = o.config.drive;
  drive.model = result.model->drive;
  // To a plan the lags of torque loop and output filter are a delay as long as themselves.
  drive.model.known_delay_s += drive.model.delay_s + drive.model.torque_lag_s + drive.model.output_filter_s;
  drive.model.delay_s = drive.model.torque_lag_s = drive.model.output_filter_s = 0.0;
  drive.model.estimated[fit::kTorqueLag] = drive.model.estimated[fit::kOutputFilter] = false;
  if (!o.noise && result.validation) o.noise = result.validation->residual_rms;
}

void read_drive(const CLI::App& verb, PlanOptions& o) {
  auto& drive = o.config.drive;
  if (o.model.empty() == o.parameters.empty())
    throw UsageError(o.model.empty() ? "--model or --parameters is required: a nominal model of the drive"
                                     : "--model and --parameters: required one of them");
  if (!o.model.empty())
    read_model(o);
  else
    read_parameters(o.parameters, drive.model);
  if (o.sample_rate_hz && !(*o.sample_rate_hz > 0.0))
    refuse_option(verb, {"sample_rate_hz", "must be > 0", *o.sample_rate_hz});
  if (o.sample_rate_hz) drive.model.sample_time_s = 1.0 / *o.sample_rate_hz;
  if (!(drive.model.sample_time_s > 0.0)) throw UsageError("--sample-rate is required with --parameters");
  if (o.delay_s) drive.model.known_delay_s = *o.delay_s;
  if (!o.controller.empty()) {
    auto controller = io::read_controller(o.controller, drive.model.sample_time_s);
    if (!controller) throw UsageError("--controller: " + message_of(controller.error()));
    drive.controller = std::move(*controller);
  }
  if (!o.noise)
    throw UsageError("--noise is required: the standard deviation of the measured velocity's noise");
  if (!(*o.noise > 0.0)) throw UsageError(fmt::format("--noise: found {:g}, required > 0", *o.noise));
  drive.noise.innovation_variance = *o.noise * *o.noise;
}

/// A figure's name as given, or as `identify` has it: with its unit behind, "damping_ratio" for "damping".
std::string figure_name(const std::string& given, const std::vector<std::string>& known) {
  for (const std::string_view ending : {"_hz", "_deg", "_ratio"}) {
    if (given.size() <= ending.size() ||
        given.compare(given.size() - ending.size(), ending.size(), ending) != 0)
      continue;
    const std::string plain = given.substr(0, given.size() - ending.size());
    if (std::find(known.begin(), known.end(), plain) != known.end()) return plain;
  }
  return given;
}

/// "0.5%" -> 0.005; nothing for all else.
std::optional<double> percentage(const std::string& text) {
  const auto number = io::parse_number(text.substr(0, text.size() - 1));
  if (text.back() != '%' || !number || !(*number > 0.0)) return std::nullopt;
  return 0.01 * *number;
}

void read_targets(PlanOptions& o) {
  if (o.accuracy.empty()) return;
  if (const auto all = percentage(o.accuracy)) {
    o.config.accuracy_of_all = *all;
    return;
  }
  const auto known = planning::figure_names(o.config.drive);
  for (const auto& [given, value] : name_values("--accuracy", o.accuracy)) {
    const std::string name = figure_name(given, known);
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw UsageError(fmt::format("--accuracy: found '{}', required one of {} (a {} drive){}", given,
                                   fmt::join(known, ", "), fit::name_of(o.config.drive.model.structure),
                                   io::suggestion(given, known)));
    const auto share = percentage(value), number = io::parse_number(value);
    if (!share && !(number && *number > 0.0))
      throw UsageError(fmt::format("--accuracy: {}: found '{}', required a number > 0, with % or in its unit",
                                   name, value));
    o.config.targets.push_back({name, share ? *share : *number, share.has_value()});
  }
}

void read_limits(PlanOptions& o) {
  auto& l = o.config.limits;
  const auto put = [](double& limit, const std::optional<double>& given) {
    if (given) limit = *given;
  };
  put(l.torque, o.max_torque);
  put(l.excitation, o.max_excitation);
  put(l.torque_rms, o.max_torque_rms);
  put(l.velocity, o.max_velocity);
  put(l.stroke, o.max_stroke);
  put(l.time_s, o.max_time_s);
  o.config.period_s = o.period_s;
}

std::string numbers(const std::vector<double>& values) {
  return fmt::format("[{:.12g}]", fmt::join(values, ", "));
}

/// A file for `resonid simulate`: the nominal drive, its loop, and the excitation.
std::string experiment_toml(const planning::Plan& plan) {
  const auto& drive = plan.config.drive;
  const auto& p = drive.model.parameters;
  const auto& x = plan.planned();
  std::string text = "# Written by 'resonid plan': the planned experiment on the nominal model.\n\n[drive]\n";
  text += fmt::format("structure = \"{}\"\n", fit::name_of(drive.model.structure));
  if (drive.model.structure != fit::Structure::rigid)
    text += fmt::format("load_inertia = {:.12g}\nstiffness = {:.12g}\ndamping = {:.12g}\n", p.load_inertia,
                        p.stiffness, p.damping);
  if (drive.model.structure == fit::Structure::three_mass)
    text += fmt::format("middle_inertia = {:.12g}\nstiffness_2 = {:.12g}\ndamping_2 = {:.12g}\n",
                        p.middle_inertia, p.stiffness_2, p.damping_2);
  text += fmt::format("driven_inertia = {:.12g}\nviscous_friction = {:.12g}\n", p.driven_inertia,
                      p.viscous_friction);
  if (drive.controller)
    text += fmt::format("\n[controller]\nkind = \"transfer-function\"\nnumerator = {}\ndenominator = {}\n",
                        numbers(drive.controller->numerator), numbers(drive.controller->denominator));
  text += fmt::format("\n[excitation]\nkind = \"{}\"\n", name_of(x.type));
  using enum planning::ExcitationType;
  if (x.type == multisine)
    text += fmt::format("lines_hz = {}\nline_amplitudes = {}\nphases = \"given\"\nphases_rad = {}\n",
                        numbers(x.frequency_hz), numbers(x.line_amplitude), numbers(x.phase_rad));
  else
    text += fmt::format("amplitude = {:.12g}\n", x.amplitude);
  if (x.type == chirp)
    text += fmt::format("from_hz = {:.12g}\nto_hz = {:.12g}\nduration_s = {:.12g}\n", x.from_hz, x.to_hz,
                        x.duration_s);
  if (x.type == prbs)
    text += fmt::format("register_length = {}\nclock_divider = {}\n", x.register_length, x.clock_divider);
  text += fmt::format("\n[measurement]\ndelay_s = {:.12g}\nnoise_rms = {:.12g}\n", drive.model.known_delay_s,
                      std::sqrt(drive.noise.innovation_variance));
  return text + fmt::format("\n[run]\nsample_rate_hz = {:.12g}\nduration_s = {:.12g}\n",
                            1.0 / drive.model.sample_time_s, x.duration_s);
}

void write_results(const planning::Plan& plan, const PlanOptions& o) {
  const auto& x = plan.planned();
  if (!o.out.empty()) {
    std::vector<double> time(x.excitation.size());
    for (std::size_t k = 0; k < time.size(); ++k)
      time[k] = static_cast<double>(k) * plan.config.drive.model.sample_time_s;
    write_output(o.out, csv_text({{"time_s", time}, {"ru", x.excitation}}));
  }
  if (!o.experiment.empty()) write_output(o.experiment, experiment_toml(plan));
  const auto provenance = provenance_of_files({o.model});
  if (!o.json.empty()) {
    auto json = report::to_json(plan);
    report::put_provenance(json, provenance);
    write_json(o.json, json);
  }
  if (!o.report.empty()) {
    auto page = report::document(plan);
    put_in_options(page.summary);
    page.provenance = provenance;
    write_output(o.report, report::document_page(page));
  }
}

/// Errors of the plan in the words of the command line.
[[noreturn]] void refuse_plan(const CLI::App& verb, const Error& error) {
  for (const auto name : fit::kParameterNames)
    if (error.field == name)
      throw UsageError(
          fmt::format("--parameters: {}: found {:g}, {}", name, error.value, error.requirement.view()));
  refuse_option(verb, error);
}

void run_plan(const CLI::App& verb, PlanOptions& o) {
  const bool quiet = no_summary(
      {{"--out", o.out}, {"--experiment", o.experiment}, {"--json", o.json}, {"--report", o.report}});
  refuse_shared_files(
      {o.model},
      {{"--out", o.out}, {"--experiment", o.experiment}, {"--json", o.json}, {"--report", o.report}});
  refuse_unwritable({o.out, o.experiment, o.json, o.report});
  read_drive(verb, o);
  if (const auto ok = planning::check(o.config.drive); !ok) refuse_plan(verb, ok.error());
  read_targets(o);
  read_limits(o);
  Progress progress;
  o.config.progress = [&progress](std::string_view stage) { progress.stage(stage); };
  const auto plan = planning::make_plan(o.config);
  if (!plan) refuse_plan(verb, plan.error());
  write_results(*plan, o);
  if (quiet) return;
  print_text(in_options(output_settings().brief ? brief_text(std::string("Plan."), report::sentences(*plan))
                                                : report::summary_text(*plan)));
  for (const auto& path : {o.out, o.experiment, o.report})
    if (!path.empty()) print(fmt::format("Written to {}\n", path));
}

void add_drive_options(CLI::App& verb, PlanOptions& o) {
  verb.option_defaults()->group("Drive");
  verb.add_option("--model", o.model, "nominal model: a result of 'resonid identify --json'")
      ->type_name("RESULT.json");
  verb.add_option("--parameters", o.parameters,
                  "or its parameters: driven_inertia=J1,load_inertia=J2,stiffness=K,damping=D"
                  "[,viscous_friction=B]; with middle_inertia, stiffness_2, damping_2 too: three masses; "
                  "driven_inertia alone: rigid")
      ->type_name("NAME=X,...");
  add_number(verb, "--sample-rate", o.sample_rate_hz, "HZ", "of the drive; otherwise the model's");
  verb.add_option("--controller", o.controller,
                  "controller of the loop: pi:KP,TI or a JSON file; none: open loop")
      ->type_name("SPEC");
  add_number(verb, "--delay", o.delay_s, "SECONDS", "delay in the measured velocity; otherwise the model's");
  add_number(verb, "--noise", o.noise, "SD",
             "standard deviation of the measured velocity's noise; otherwise the model's residual");
  add_number(verb, "--spread", o.config.spread, "PART", "by which the nominal model may be wrong, 0 ... 0.5");
}

void add_target_options(CLI::App& verb, PlanOptions& o) {
  verb.option_defaults()->group("Limits");
  add_number(verb, "--max-torque", o.max_torque, "NM",
             "peak torque of the machine, above the operating point");
  add_number(verb, "--max-excitation", o.max_excitation, "NM",
             "peak of what is added to the controller's output");
  add_number(verb, "--max-torque-rms", o.max_torque_rms, "NM", "rms torque over the experiment");
  add_number(verb, "--max-velocity", o.max_velocity, "RAD/S", "peak velocity, above the operating point");
  add_number(verb, "--max-stroke", o.max_stroke, "RAD", "travel of the motor side, end to end");
  add_number(verb, "--max-time", o.max_time_s, "SECONDS", "length of the experiment");
  verb.option_defaults()->group("Targets");
  verb.add_option(
          "--accuracy", o.accuracy,
          "target standard deviations, in % or in the figure's unit; X% alone: of all parameters, as 1% "
          "without this option")
      ->type_name("NAME=X%,...|X%");
  add_enum(verb, "--criterion", o.config.criterion,
           "what the power is distributed for: the accuracy targets, or a D-, A- or E-optimal covariance");
  add_enum(verb, "--type", o.config.type, "auto: what needs the least time");
  add_colons(
      verb, "--band", 2, "LO:HI",
      [&o](const std::vector<double>& v) {
        o.config.band_hz = {v[0], v[1]};
      },
      "frequencies that may be excited, in Hz; of a PRBS 90 % of the power keep below HI, 80 % above LO");
  add_number(verb, "--period", o.period_s, "SECONDS", "of the multisine; otherwise chosen");
  add_count(verb, "--seed", o.config.seed, "seed of the search for phases");
}

}  // namespace

void add_plan(CLI::App& app) {
  auto* verb =
      app.add_subcommand("plan", "Plans the excitation that reaches the accuracy targets in the least time");
  verb->footer(
      "Examples:\n"
      "  resonid plan --model result.json --noise 0.1 --controller pi:1.036,0.147 --max-torque 2 --out "
      "next.csv\n"
      "  resonid plan --parameters driven_inertia=0.03,load_inertia=0.03,stiffness=140,damping=0.3 --noise "
      "0.1\n"
      "    --sample-rate 500 --controller pi:1.036,0.147 --delay 0.004 --max-torque 1 --max-velocity 2\n"
      "    --accuracy resonance=0.1%,stiffness=1% --report plan.html\n"
      "Figures: the drive's parameters, resonance, antiresonance, resonance_damping, antiresonance_damping, "
      "of "
      "three masses resonance_2 ... too; with a controller crossover, phase_margin, modulus_margin. "
      "Accuracies "
      "and error bars are one standard deviation.");
  const auto o = std::make_shared<PlanOptions>();
  add_drive_options(*verb, *o);
  add_target_options(*verb, *o);
  add_summary_options(*verb);
  verb->add_option("--out", o->out, "CSV file with time_s, ru ('-': standard output)")->type_name("FILE");
  verb->add_option("--experiment", o->experiment,
                   "TOML file for 'resonid simulate': a rehearsal on the nominal model")
      ->type_name("FILE");
  verb->add_option("--json", o->json, "the plan for machines ('-': standard output)")->type_name("FILE");
  verb->add_option("--report", o->report, "self-contained HTML page")->type_name("FILE");
  verb->callback([verb, o] { run_plan(*verb, *o); });
}

}  // namespace resonid::cli
