// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/io/detail/atomic_file.hpp>
#include <resonid/report/detail/track.hpp>
#include <resonid/report/json.hpp>

#include "brief.hpp"
#include "errors.hpp"
#include "help.hpp"
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

/// Rows that page, JSON and summary are made of; the CSV file holds all.
constexpr std::size_t kKeptRows = 2000;
/// Rows of a long recording, unless --every is given: the modes of every sample take longer than the
/// tracking.
constexpr std::size_t kMostRows = 200'000;

struct TrackVerbOptions {
  RecordOptions record;
  MethodOptions method;
  identification::TrackOptions track;
  std::string out, json, report, start, baseline, result;
  bool require_trusted = false;
};

/// The rows as CSV, written as they come: a record's rows may not fit in memory.
class RowWriter {
 public:
  explicit RowWriter(const std::string& path) : standard_output_(path == "-") {
    if (standard_output_) return;
    auto file = io::AtomicFile::create(path);
    if (!file) throw std::runtime_error(message_of(file.error()));
    file_.emplace(std::move(*file));
  }

  void columns(std::span<const std::string> names) {
    for (std::size_t i = 0; i < names.size(); ++i)
      fmt::format_to(std::back_inserter(text_), "{}{}", i == 0 ? "" : ",", names[i]);
    end_line();
  }
  void row(std::span<const double> values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i > 0) text_.push_back(',');
      if (std::isfinite(values[i])) fmt::format_to(std::back_inserter(text_), "{:.10g}", values[i]);
    }
    end_line();
  }
  void finish() {
    flush();
    if (!file_) return;
    if (const auto done = file_->commit(); !done) throw std::runtime_error(message_of(done.error()));
  }

 private:
  void end_line() {
    constexpr std::size_t kPiece = std::size_t{1} << 20U;
    text_.push_back('\n');
    if (text_.size() >= kPiece) flush();
  }
  void flush() {
    const std::string_view piece(text_.data(), text_.size());
    if (standard_output_) {
      print(piece);
    } else if (const auto written = file_->write(piece); !written) {
      throw std::runtime_error(message_of(written.error()));
    }
    text_.clear();
  }

  bool standard_output_;
  std::optional<io::AtomicFile> file_;
  fmt::memory_buffer text_;
};

void read_models(TrackVerbOptions& o) {
  if (!o.start.empty()) {
    const auto result = read_result(o.start, "--start");
    if (!result.model)
      throw InputError(fmt::format("--start: '{}': holds no model; required: an initial model", o.start));
    o.track.start = result.model->drive;
    o.track.start_units = result.units;
  }
  if (!o.baseline.empty()) o.track.baseline = read_result(o.baseline, "--baseline");
}

void add_method(CLI::App& verb, TrackVerbOptions& o) {
  auto& t = o.track;
  verb.option_defaults()->group("On-line estimator");
  add_enum(verb, "--method", t.method, "the on-line estimator");
  add_number(verb, "--learn", t.learn_s, "SECONDS",
             "length of the stretch that method, excitation and start are decided from; rows begin after it; "
             "otherwise half a second or more, doubled while it does not suffice");
  verb.add_flag(
      "--whole-record", t.whole_record,
      "learn from the whole recording: rows begin at its first sample and know what came after them");
  add_number(verb, "--memory", t.memory_s, "SECONDS", "how long the estimate remembers; otherwise chosen");
  add_enum(verb, "--forgetting", t.forgetting,
           "arx, oe, rpem, cloe, f-cloe, d-cloe: how old samples lose weight");
  verb.add_flag("--long-term", t.long_term,
                "for hours: physical forgets all parameters over its memory, two seconds or thirty periods "
                "of the resonance unless told");
  verb.add_flag("--extrapolate", t.extrapolate,
                "iv: extrapolate to the newest sample; no lag, and nearly twice the variance");
  add_number(
      verb, "--drift", t.drift_per_s, "1/S",
      "physical: relative change of the stiffness per second that the machine can reach; otherwise chosen");
  add_enum(verb, "--detect-change", t.change_of, "figure to be watched for a lasting change", "");
  add_number(verb, "--false-alarms", t.false_alarm_interval_s, "SECONDS",
             "mean time between changes that are none");
  static_assert(std::is_same_v<std::size_t, std::uint64_t>);
  add_count(verb, "--every", t.every, "a row every so many samples", 1)
      ->default_str(fmt::format("1, or what leaves {} rows", kMostRows));
  verb.add_flag("--raw-time", t.raw_time,
                "time of the newest sample instead of the time that the estimate describes");
  verb.add_option("--result", o.result,
                  "result of identify that tells columns, units, scales, controller and delay; otherwise "
                  "--baseline or --start does")
      ->type_name("FILE.json");
  verb.add_option("--start", o.start, "result of identify whose model the estimate begins with")
      ->type_name("FILE.json");
  verb.add_option("--baseline", o.baseline, "result of identify to which the gap is taken")
      ->type_name("FILE.json");
}

/// What the first of the results that are given stores of the machine.
void inherit_from_results(CLI::App& verb, const TrackVerbOptions& o) {
  for (const auto& [option, file] :
       {std::pair{"--result", &o.result}, {"--baseline", &o.baseline}, {"--start", &o.start}}) {
    if (file->empty()) continue;
    const auto result = read_result(*file, option);
    return inherit(verb, result.options, *file, is_of_record(result, o.record.record));
  }
}

void run_track(CLI::App& verb, TrackVerbOptions& o) {
  const bool quiet = no_summary({{"--out", o.out}, {"--report", o.report}, {"--json", o.json}});
  refuse_shared_files({o.record.record, o.start, o.baseline, o.result},
                      {{"--out", o.out}, {"--report", o.report}, {"--json", o.json}});
  inherit_from_results(verb, o);
  check(verb, o.method);
  if (verb.get_option("--memory")->count() > 0 && !(o.track.memory_s > 0.0))
    throw UsageError(fmt::format("--memory: found {:g} s, required > 0", o.track.memory_s));
  refuse_unwritable({o.out, o.report, o.json});
  Progress progress;
  progress.stage("reading " + o.record.record);
  read_models(o);
  const auto record = read_record(verb, o.record);
  complete(o.method, record);
  o.track.common = o.method.options;
  o.track.common.progress = [&progress](std::string_view stage) { progress.stage(stage); };
  o.track.kept_rows = kKeptRows;
  if (verb.get_option("--every")->count() == 0)
    o.track.every = std::max<std::size_t>(1, (record.samples() + kMostRows - 1) / kMostRows);
  std::optional<RowWriter> writer;
  if (!o.out.empty()) {
    o.track.on_columns = [&](std::span<const std::string> names) { writer.emplace(o.out).columns(names); };
    o.track.on_row = [&](std::span<const double> values) { writer->row(values); };
  }
  auto track = identification::track(record, o.track);
  if (!track) throw UsageError(in_options(track.error()));
  put_in_options(*track);
  progress.stage("writing");
  if (writer) writer->finish();
  const auto provenance = provenance_of_files({o.record.record, o.start, o.baseline, o.result});
  if (!o.report.empty()) {
    auto page = report::track_document(*track, record);
    page.provenance = provenance;
    write_output(o.report, report::document_page(page));
  }
  if (!o.json.empty()) {
    auto json = report::to_json(*track);
    report::put_provenance(json, provenance);
    write_json(o.json, json);
  }
  if (!quiet) {
    print_summary(output_settings().brief
                      ? brief_text(trusted_text(track->trusted), report::track_document(*track).summary,
                                   track->findings)
                      : report::track_text(*track));
    if (!o.out.empty()) print(fmt::format("{} rows written to {}\n", track->rows, o.out));
    if (!o.report.empty()) print(fmt::format("Report written to {}\n", o.report));
  }
  if (o.require_trusted && !track->trusted)
    throw NotTrustedError("the rows are not reliable; the findings say why");
}

}  // namespace

void add_track(CLI::App& app) {
  auto* verb =
      app.add_subcommand("track", "Follows response, resonance, parameters and margins sample by sample");
  verb->footer(
      "Examples:\n"
      "  resonid track belt.csv --out rows.csv --delay 0.004 --report belt.html\n"
      "  resonid track today.csv --controller pi:1.036,0.147 --delay 0.004 --baseline first.json --every 50 "
      "--json -\n"
      "  resonid track axis.csv --method iv --controller pi.json --out rows.csv\n"
      "Methods: physical (inertias, stiffness, damping); iv, arx, oe, rpem, cloe, f-cloe, d-cloe "
      "(coefficients b, a); kalman, sliding-dft (response at lines, or along a chirp).\n"
      "A learning stretch at the beginning decides on method and start; no row depends on a later sample. "
      "Times are those that the estimate describes.\n"
      "Columns: time_s, what the method tracks, resonance_hz, antiresonance_hz with _std, margins with "
      "--controller, gap with --baseline, position_m, trusted.");
  const auto o = std::make_shared<TrackVerbOptions>();
  add_record_options(*verb, o->record);
  add_excitation_options(*verb, o->method);
  add_method(*verb, *o);
  add_loop_options(*verb, o->method);
  add_result_options(*verb, o->method);
  add_drive_model_option(*verb, o->method);
  add_friction_option(
      *verb, o->method,
      "of the initial model; dry: arx, iv and physical follow Coulomb friction, viscous: physical "
      "follows viscous friction");
  add_tracker_options(*verb, o->method);
  add_summary_options(*verb);
  verb->add_option("--out", o->out, "the rows as CSV ('-': standard output)")->type_name("FILE");
  verb->add_option("--report", o->report, "self-contained HTML report")->type_name("FILE");
  verb->add_option("--json", o->json, "summary and thinned rows for machines ('-': standard output)")
      ->type_name("FILE");
  verb->add_flag("--require-trusted", o->require_trusted, "exit code 3 when the rows are not reliable");
  verb->callback([verb, o] { run_track(*verb, *o); });
}

}  // namespace resonid::cli
