// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/report/detail/track.hpp>
#include <resonid/report/json.hpp>

#include "brief.hpp"
#include "errors.hpp"
#include "follow_options.hpp"
#include "help.hpp"
#include "option_names.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "provenance.hpp"
#include "result_words.hpp"
#include "row_writer.hpp"
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
  FollowOptions follow;
  std::string out, json, report;
  bool require_trusted = false;
};

/// What only a recording that is whole can be asked for, or that watches it otherwise than the monitor.
void add_track_options(CLI::App& verb, identification::TrackOptions& t) {
  verb.option_defaults()->group("On-line estimator");
  add_number(verb, "--learn", t.learn_s, "SECONDS",
             "length of the stretch that method, excitation and start are decided from; rows begin after it; "
             "otherwise half a second or more, doubled while it does not suffice");
  verb.add_flag(
      "--whole-record", t.whole_record,
      "learn from the whole recording: rows begin at its first sample and know what came after them");
  verb.add_flag("--long-term", t.long_term,
                "for hours: physical forgets all parameters over its memory, two seconds or thirty periods "
                "of the resonance unless told");
  add_enum(verb, "--detect-change", t.change_of, "figure to be watched for a lasting change", "");
  add_number(verb, "--false-alarms", t.false_alarm_interval_s, "SECONDS",
             "mean time between changes that are none");
  verb.add_flag("--raw-time", t.raw_time,
                "time of the newest sample instead of the time that the estimate describes");
}

void run_track(CLI::App& verb, TrackVerbOptions& o) {
  const bool quiet = no_summary({{"--out", o.out}, {"--report", o.report}, {"--json", o.json}});
  auto& f = o.follow;
  auto& options = f.track;
  refuse_shared_files({f.record.record, f.start, f.baseline, f.result},
                      {{"--out", o.out}, {"--report", o.report}, {"--json", o.json}});
  settle(verb, f);
  refuse_unwritable({o.out, o.report, o.json});
  Progress progress;
  progress.stage("reading " + f.record.record);
  const auto record = read_followed(verb, f);
  options.common.progress = [&progress](std::string_view stage) { progress.stage(stage); };
  options.kept_rows = kKeptRows;
  if (verb.get_option("--every")->count() == 0)
    options.every = std::max<std::size_t>(1, (record.samples() + kMostRows - 1) / kMostRows);
  std::optional<RowWriter> writer;
  if (!o.out.empty()) {
    options.on_columns = [&](std::span<const std::string> names) { writer.emplace(o.out).columns(names); };
    options.on_row = [&](std::span<const double> values) { writer->row(values); };
  }
  auto track = identification::track(record, options);
  if (!track) throw UsageError(in_options(track.error()));
  put_in_options(*track);
  progress.stage("writing");
  if (writer) writer->finish();
  const auto provenance = provenance_of_files({f.record.record, f.start, f.baseline, f.result});
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
  add_record_options(*verb, o->follow.record);
  add_follow_options(*verb, o->follow, fmt::format("1, or what leaves {} rows", kMostRows));
  add_track_options(*verb, o->follow.track);
  add_summary_options(*verb);
  verb->add_option("--out", o->out, "the rows as CSV ('-': standard output)")->type_name("FILE");
  verb->add_option("--report", o->report, "self-contained HTML report")->type_name("FILE");
  verb->add_option("--json", o->json, "summary and thinned rows for machines ('-': standard output)")
      ->type_name("FILE");
  verb->add_flag("--require-trusted", o->require_trusted, "exit code 3 when the rows are not reliable");
  verb->callback([verb, o] { run_track(*verb, *o); });
}

}  // namespace resonid::cli
