// SPDX-License-Identifier: MIT
#include "monitor_replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <resonid/base/error_text.hpp>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "errors.hpp"
#include "option_names.hpp"
#include "output.hpp"
#include "profile.hpp"
#include "progress.hpp"

namespace resonid::cli {
namespace {

/// Groups of the options that tell how a recording is followed.
constexpr std::string_view kOfTheRecording[] = {"Recording",  "Excitation", "On-line estimator", "Loop",
                                                "Estimation", "Model",      "Kalman method"};

std::vector<const CLI::Option*> recording_options_given(const CLI::App& verb) {
  return verb.get_options([](const CLI::Option* option) {
    return option->count() > 0 && !is_from_profile(*option) &&
           std::find(std::begin(kOfTheRecording), std::end(kOfTheRecording), option->get_group()) !=
               std::end(kOfTheRecording);
  });
}

/// The only axis of a configuration, unless one is named.
std::string axis_of(const ReplayOptions& o, const monitor::Configuration& configuration) {
  if (!o.axis.empty()) return o.axis;
  const auto& axes = configuration.axes.tables;
  if (axes.size() == 1) return axes.begin()->first;
  std::string names;
  for (const auto& [name, axis] : axes) names += (names.empty() ? "" : ", ") + name;
  throw UsageError("--axis: is required, one of: " + names);
}

}  // namespace

void add_replay_options(CLI::App& verb, ReplayOptions& o) {
  verb.option_defaults()->group("Replay");
  verb.add_option(
          "--replay", o.follow.record.record,
          "recording that is followed as one axis, CSV or MAT, also packed (.gz); - is standard input")
      ->type_name("FILE");
  verb.add_option("--axis", o.axis, "axis of CONFIG that the recording is of, where it has several")
      ->type_name("NAME");
  verb.add_option(
          "--rows", o.rows,
          "write the rows as CSV ('-': standard output), as track --out does, and end with the recording")
      ->type_name("FILE");
  add_signal_options(verb, o.follow.record);
  add_follow_options(verb, o.follow, "those of 0.1 s");
}

void refuse_without_effect(const CLI::App& verb, const ReplayOptions& o, bool configured) {
  const bool replays = !o.follow.record.record.empty();
  for (const char* name : {"--axis", "--rows"})
    if (!replays && verb.get_option(name)->count() > 0)
      throw UsageError(fmt::format("{}: is for --replay", name));
  if (replays && !configured && !o.axis.empty())
    throw UsageError("--axis: names an axis of a configuration, which is required with it");
  const auto given = recording_options_given(verb);
  if (given.empty() || (replays && !configured)) return;
  throw UsageError(fmt::format("{}: {}", given.front()->get_name(),
                               replays ? "is told by the configuration: leave one of them out"
                                       : "is for --replay; an axis tells it in the configuration"));
}

monitor::Replay read_replay(CLI::App& verb, ReplayOptions& o, const monitor::Configuration* configuration) {
  auto& f = o.follow;
  refuse_shared_files({f.record.record, f.start, f.baseline, f.result}, {{"--rows", o.rows}});
  refuse_unwritable({o.rows});
  if (configuration == nullptr) settle(verb, f);
  Progress progress;
  progress.stage("reading " + f.record.record);
  if (configuration != nullptr) {
    auto replay = monitor::replay_of(*configuration, axis_of(o, *configuration), f.record.record);
    if (!replay) throw InputError(message_of(replay.error()));
    return std::move(*replay);
  }
  auto record = read_followed(verb, f);
  if (const auto fault = monitor::motion_fault(record)) throw InputError(in_options(*fault));
  const bool every = verb.get_option("--every")->count() > 0;
  return monitor::replay_of(std::move(record), f.track, f.method.controller, every ? f.track.every : 0);
}

ReplayRows::ReplayRows(const std::string& path, const monitor::Replay& replay)
    : writer_(path),
      start_time_s_(replay.record->start_time_s),
      end_time_s_(start_time_s_ + replay.record->duration_s()),
      head_(data::part_of(*replay.record, 0, 1)) {
  options_.kept_rows = 2;  // they are in the file
  options_.on_columns = [this](std::span<const std::string> names) {
    if (columns_.empty()) {
      columns_.assign(names.begin(), names.end());
      return writer_.columns(names);
    }
    if (!std::equal(names.begin(), names.end(), columns_.begin(), columns_.end()))
      throw std::runtime_error(
          "--rows: the drive was learned anew, and what is followed of it now has other columns; choose "
          "--method");
  };
  options_.on_row = [this](std::span<const double> values) { writer_.row(values); };
}

void ReplayRows::begin(const monitoring::AxisMonitor& axis) {
  learned_from_ = axis.learned_from();
  track_.lines.clear();
  track_.parameters.clear();
  track_.figures.clear();
  format_.emplace(head_, options_, axis.follower()->setup(), axis.follower()->axis(), track_);
}

void ReplayRows::add(const monitoring::AxisMonitor& axis) noexcept {
  if (fault_) return;
  try {
    if (!format_ || axis.learned_from() != learned_from_) begin(axis);
    auto place = axis.follower()->place();
    place.time_s += start_time_s_;
    if (!watched_from_s_) note_watch(axis, place.time_s);
    format_->add(axis.follower()->axis(), place);
  } catch (...) {  // in the service's thread
    fault_ = std::current_exception();
  }
}

void ReplayRows::note_watch(const monitoring::AxisMonitor& axis, double time_s) {
  if (!first_row_s_) {
    first_row_s_ = time_s;
    baseline_s_ = axis.baseline_s();
  }
  for (std::size_t i = 0; i < monitoring::kWatched; ++i)
    if (axis.watches(static_cast<monitoring::Watched>(i))) watched_from_s_ = time_s;
}

std::string ReplayRows::told_from() const {
  if (watched_from_s_)
    return fmt::format("changes are told from {:.1f} s on: what comes before is the baseline",
                       *watched_from_s_);
  return fmt::format(
      "no change could be told: the baseline takes {:.1f} s of trusted rows, from {:.1f} s on, and the "
      "recording ends at {:.1f} s",
      baseline_s_, first_row_s_.value_or(start_time_s_), end_time_s_);
}

void ReplayRows::finish() {
  if (fault_) std::rethrow_exception(fault_);
  writer_.finish();
}

std::string replay_text(const monitor::web::Backend& backend, const std::string& rows_path,
                        const ReplayRows& rows) {
  constexpr std::uint32_t kMostAlarms = 1000;
  auto alarms = backend.alarms({monitor::web::AlarmFilter::all, "", kMostAlarms}).value();
  std::stable_sort(alarms.begin(), alarms.end(),
                   [](const auto& a, const auto& b) { return a.raised_time_s < b.raised_time_s; });
  std::string text = fmt::format("{} rows written to {}\n", rows.rows(), rows_path);
  for (const auto& alarm : alarms) text += fmt::format("{}: {}\n", name_of(alarm.severity), alarm.text);
  text += fmt::format("{} alarm{}; {}\n", alarms.size(), alarms.size() == 1 ? "" : "s", rows.told_from());
  return text;
}

}  // namespace resonid::cli
