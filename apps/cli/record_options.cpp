// SPDX-License-Identifier: MIT
#include "record_options.hpp"

#include <fmt/format.h>

#include <array>
#include <resonid/base/error_text.hpp>
#include <resonid/io/controller_file.hpp>

#include "errors.hpp"
#include "options.hpp"

namespace resonid::cli {

using identification::ModelChoice;

namespace {

constexpr std::size_t kTrackedModels = 4;      // without a black box
constexpr std::uint64_t kFewestReplicas = 20;  // fewer have no tails
constexpr std::size_t kHighestOrder = 20;

}  // namespace

void add_record_options(CLI::App& verb, RecordOptions& o) {
  verb.add_option("RECORD", o.record, "CSV or MAT file, also packed (.gz); - is standard input")
      ->required()
      ->type_name("FILE");
  add_signal_options(verb, o);
  for (const char* name : {"--second-output", "--second-output-kind"})
    verb.add_option_function<std::string>(
            name,
            [name, &verb](const std::string&) {
              throw UsageError(
                  fmt::format("{}: {} works on one output; only identify measures and fits a second one",
                              name, verb.get_name()));
            },
            "refused")
        ->group("");  // not listed
}

void add_second_output_options(CLI::App& verb, RecordOptions& o) {
  verb.option_defaults()->group("Recording");
  auto& c = o.columns;
  add_text(verb, "--second-output", c.second_output,
           "motion measured at the load; the drive model is fitted to both outputs", "COL");
  add_enum(verb, "--second-output-kind", c.second_output_kind, "what the second output is");
  add_number(verb, "--second-output-scale", c.second_output_scale, "X", "factor of the second output");
  add_text(verb, "--second-output-unit", c.second_output_unit,
           "unit of the scaled second output, if its column's name does not tell", "UNIT");
}

namespace {

/// How a text file is written, where it is not sniffed right.
void add_layout_options(CLI::App& verb, io::TextLayout& layout) {
  static constexpr std::array<std::string_view, 3> kMarks = {"auto", "point", "comma"};
  add_choice(
      verb, "--decimal", kMarks,
      [&layout](std::size_t i) {
        layout.decimal = i == 0 ? std::nullopt : std::optional(i == 1 ? '.' : ',');
      },
      "decimal mark of a text file")
      ->default_str("auto");
  add_count(verb, "--skip", layout.skip_lines, "lines to leave out at the beginning of a text file", 0)
      ->default_str("");
  verb.add_option_function<std::uint64_t>(
          "--header-line", [&layout](std::uint64_t line) { layout.header_line = line; },
          "line of the column names in a text file, from 1; 0: there is none, columns are called c1, c2 ...")
      ->type_name("N");
}

}  // namespace

void add_signal_options(CLI::App& verb, RecordOptions& o) {
  verb.option_defaults()->group("Recording");
  auto& c = o.columns;
  add_text(verb, "--time", c.time, "time column; 'none' ignores one", "COL");
  add_enum(verb, "--time-unit", c.time_unit, "of the time column; samples: numbers of samples");
  add_number(verb, "--sample-rate", c.sample_rate_hz, "HZ",
             "sample rate, for a recording without a time column");
  add_text(verb, "--input", c.input, "input u: torque (force) that the drive receives", "COL");
  add_text(verb, "--output", c.output,
           "output y: what is measured on the motor side; signals may be sums of columns, '34.2*a - 3.3*b'",
           "COL");
  add_text(verb, "--excitation", c.excitation, "excitation ru, added to the controller's output", "COL");
  add_text(verb, "--reference", c.reference, "reference r of the loop", "COL");
  add_number(verb, "--input-scale", c.input_scale, "X", "factor of the input, for example 0.564 Nm/A");
  add_number(verb, "--output-scale", c.output_scale, "X",
             "factor of the output, for example -1 for a mirrored encoder");
  add_text(verb, "--input-unit", c.input_unit, "unit of the scaled input, if its column's name does not tell",
           "UNIT");
  add_text(verb, "--output-unit", c.output_unit, "unit of the scaled (and differentiated) output", "UNIT");
  add_number(verb, "--counts-per-rev", c.counts_per_rev, "N",
             "counts of the encoder per turn, for an output in counts");
  add_number(verb, "--rated-torque", c.rated_torque, "NM",
             "what 100 % are, for an input in % of the rated torque");
  add_number(verb, "--torque-constant", c.torque_constant, "NM_A", "torque per ampere, for an input in A");
  add_enum(verb, "--motion", c.motion, "kg m2 and Nm/rad, or kg and N/m");
  add_enum(verb, "--output-quantity", c.output_quantity,
           "what the output is; the response is always that of the velocity");
  verb.add_flag("--differentiate", c.differentiate,
                "turn a position into a velocity by backward differences (half a sample late)");
  add_number(verb, "--from", c.from_s, "SECONDS", "first instant used");
  add_number(verb, "--to", c.to_s, "SECONDS", "first instant no longer used");
  add_enum(verb, "--missing", c.missing, "what is done about isolated missing samples, at most 1 %");
  add_layout_options(verb, c.layout);
}

data::Record read_record(const CLI::App& verb, const RecordOptions& o) {
  if (verb.get_option("--sample-rate")->count() > 0 && !(o.columns.sample_rate_hz > 0.0))
    throw UsageError(fmt::format("--sample-rate: found {:g}, required > 0 Hz", o.columns.sample_rate_hz));
  auto record = io::read_record(o.record, o.columns);
  if (!record) throw InputError(in_options(record.error()));
  return std::move(*record);
}

void add_excitation_options(CLI::App& verb, MethodOptions& o) {
  verb.option_defaults()->group("Excitation");
  auto& k = o.options;
  add_enum(verb, "--excitation-type", k.excitation_type, "how the drive was excited");
  add_colons(
      verb, "--chirp", 3, "F0:F1:SECONDS",
      [&k](const std::vector<double>& v) {
        k.chirp = online::SweepLaw{v[0], v[1], v[2]};
      },
      "the excitation is a linear chirp from the first used sample on; otherwise detected");
  add_lines(
      verb, "--lines", [&k](std::span<const double> hz) { k.lines_hz.assign(hz.begin(), hz.end()); },
      "frequencies to report");
  static_assert(std::is_same_v<std::size_t, std::uint64_t>);
  add_count(verb, "--period-samples", k.period_samples, "period of the excitation; otherwise detected")
      ->default_str("");
  add_count(verb, "--drop-periods", k.drop_periods, "discard so many periods at the start");
}

void add_loop_options(CLI::App& verb, MethodOptions& o) {
  verb.option_defaults()->group("Loop");
  auto& k = o.options;
  add_enum(verb, "--approach", k.approach, "auto: joint with an excitation, else direct");
  verb.add_option("--controller", o.controller, "controller of the loop: pi:KP,TI or a JSON file")
      ->type_name("SPEC");
  add_number(verb, "--delay", k.delay_s, "SECONDS", "known delay in the measured output");
}

void add_result_options(CLI::App& verb, MethodOptions& o) {
  verb.option_defaults()->group("Estimation");
  auto& k = o.options;
  add_colons(
      verb, "--band", 2, "LO:HI",
      [&k](const std::vector<double>& v) {
        k.band_hz = {v[0], v[1]};
      },
      "frequencies to use, in Hz");
  add_number(verb, "--confidence", k.confidence, "P", "of the error bars");
  add_radius_option(verb, o);
}

void add_radius_option(CLI::App& verb, MethodOptions& o) {
  add_number(verb, "--radius", o.options.radius_m, "M",
             "radius of the driven roller: also report stiffness in N/m");
}

void add_method_option(CLI::App& verb, MethodOptions& o, const std::string& doc) {
  verb.option_defaults()->group("Estimation");
  add_enum(verb, "--method", o.options.method, doc);
}

void add_drive_model_option(CLI::App& verb, MethodOptions& o) {
  verb.option_defaults()->group("Model");
  add_enum(verb, "--model", o.options.model, "drive model to fit", kTrackedModels);
}

void add_friction_option(CLI::App& verb, MethodOptions& o, const std::string& doc) {
  verb.option_defaults()->group("Model");
  add_enum(verb, "--friction", o.options.friction, doc);
}

void add_drive_options(CLI::App& verb, MethodOptions& o) {
  auto& k = o.options;
  add_friction_option(verb, o, "friction of the drive model");
  add_enum(verb, "--ground", k.ground, "side of the drive model that a spring ties to the ground");
  add_number(
      verb, "--torque-lag", k.torque_lag_s, "SECONDS",
      "time constant of the torque loop, 0 for none; otherwise estimated where the recording shows it");
  add_number(verb, "--output-filter", k.output_filter_s, "SECONDS",
             "time constant of the drive's filter of the measured velocity, 0 for none; otherwise estimated");
}

void add_model_options(CLI::App& verb, MethodOptions& o) {
  verb.option_defaults()->group("Model");
  auto& k = o.options;
  add_enum(verb, "--model", k.model, "drive model to fit, or a black box without drive structure");
  add_drive_options(verb, o);
  static_assert(std::is_same_v<std::size_t, std::uint64_t>);
  add_count(verb, "--order", k.order, "of the black-box model, 1 ... 20; otherwise chosen", 1)
      ->default_str("");
  add_count(verb, "--bootstrap", k.bootstrap,
            "repeat the experiment so often on the fitted model: intervals without linearisation",
            kFewestReplicas)
      ->default_str("");
  add_count(verb, "--seed", k.seed, "of the bootstrap");
}

void add_tracker_options(CLI::App& verb, MethodOptions& o) {
  verb.option_defaults()->group("Kalman method");
  auto& k = o.options;
  add_number(verb, "--lambda", o.lambda, "X",
             "kalman: fixed gain of the published filter instead of placed poles");
  add_number(verb, "--pole-radius", o.pole_radius, "R", "kalman: radius of the placed poles, 0 ... 1");
  verb.add_flag(
      "--no-smoothing", [&k](std::int64_t) { k.tracker.smoothing = false; },
      "kalman: one pass, with the filter's lag");
  verb.add_flag(
      "--no-offset", [&k](std::int64_t) { k.tracker.offset = false; }, "kalman: without the constant state");
}

void check(const CLI::App& verb, MethodOptions& o) {
  const auto given = [&](const char* name) {
    const auto* option = verb.get_option_no_throw(name);
    return option != nullptr && option->count() > 0;
  };
  if (given("--lambda")) o.options.tracker.lambda = o.lambda;
  if (given("--pole-radius")) o.options.tracker.pole_radius = o.pole_radius;
  if (given("--order")) {
    if (o.options.model != ModelChoice::black_box)
      throw UsageError("--order: is the order of a black-box model; required --model black-box with it");
    if (o.options.order > kHighestOrder)
      throw UsageError(fmt::format("--order: found {}, required 1 ... {}", o.options.order, kHighestOrder));
  }
  const bool drive = o.options.model != ModelChoice::none && o.options.model != ModelChoice::black_box;
  if (given("--friction") && !drive)
    throw UsageError("--friction: is that of a drive model; required --model other than none and black-box");
  for (const char* name : {"--ground", "--torque-lag", "--output-filter"})
    if (given(name) && !drive)
      throw UsageError(
          fmt::format("{}: is that of a drive model; required --model other than none and black-box", name));
  if (const double lag = o.options.torque_lag_s.value_or(0.0); !(lag >= 0.0))
    throw UsageError(fmt::format("--torque-lag: found {:g} s, required >= 0", lag));
  if (const double lag = o.options.output_filter_s.value_or(0.0); !(lag >= 0.0))
    throw UsageError(fmt::format("--output-filter: found {:g} s, required >= 0", lag));
  const bool repeats = verb.get_option_no_throw("--bootstrap") != nullptr;  // else the seed is another one's
  if (repeats && given("--seed") && !given("--bootstrap"))
    throw UsageError("--seed: is the seed of the bootstrap; required --bootstrap N with it");
  if (given("--bootstrap") && o.options.model == ModelChoice::none)
    throw UsageError("--bootstrap: repeats the experiment on the model; required --model other than none");
  const double radius = o.options.radius_m.value_or(1.0);
  if (!(radius > 0.0)) throw UsageError(fmt::format("--radius: found {:g} m, required > 0", radius));
}

void complete(MethodOptions& o, const data::Record& record) {
  const auto read = [&](const char* option, const std::string& text,
                        std::optional<data::Controller>& target) {
    if (text.empty()) return;
    auto controller = io::read_controller(text, record.sample_time_s());
    if (!controller) throw UsageError(fmt::format("{}: {}", option, message_of(controller.error())));
    target = std::move(*controller);
  };
  read("--controller", o.controller, o.options.controller);
  read("--planned-controller", o.planned_controller, o.options.planned_controller);
}

}  // namespace resonid::cli
