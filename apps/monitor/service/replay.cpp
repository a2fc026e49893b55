// SPDX-License-Identifier: MIT
#include "monitor/service/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/io/detail/suggestion.hpp>
#include <resonid/io/record_reader.hpp>
#include <utility>
#include <vector>

#include "io/text.hpp"
#include "monitor/service/axis_spec_of.hpp"
#include "monitor/sources/replay_source.hpp"
#include "monitoring/threshold.hpp"

namespace resonid::monitor {
namespace {

io::ColumnMapping mapping_of(const AxisConfig& a) {
  const auto given = [](const std::string& text) {
    return text.empty() ? std::nullopt : std::optional(text);
  };
  io::ColumnMapping m;
  m.input = a.input;
  m.output = a.output;
  m.excitation = given(a.excitation);
  m.position = given(a.position);
  m.sample_rate_hz = a.sample_rate_hz;
  m.input_scale = a.input_scale;
  m.output_scale = a.output_scale;
  m.output_quantity = a.output_quantity;
  m.motion = a.motion;
  m.input_unit = given(a.input_unit);
  m.output_unit = given(a.output_unit);
  m.counts_per_rev = a.counts_per_rev;
  m.rated_torque = a.rated_torque;
  m.torque_constant = a.torque_constant;
  return m;
}

Error in_keys(Error fault) {
  fault.requirement = library_keys(fault.requirement.str());
  return fault;
}

/// The specification of one axis of the configuration.
expected<monitoring::AxisSpec, Error> spec_in(const Configuration& configuration, const std::string& axis) {
  auto all = axis_specs(configuration);
  if (!all) return unexpected(std::move(all.error()));
  return std::move(
      *std::find_if(all->begin(), all->end(), [&](const auto& spec) { return spec.name == axis; }));
}

}  // namespace

Replay replay_of(data::Record record, const identification::TrackOptions& options, std::string controller,
                 std::size_t every) {
  constexpr double kShareWatched = 0.1, kMostWatched_s = 600.0, kRow_s = 0.1;
  const double interval_s = MonitorConfig{}.false_alarm_interval_s;
  Replay replay;
  replay.controller = std::move(controller);
  auto& s = replay.spec;
  s.name = axis_name(std::filesystem::path(record.source).stem().string());
  s.sample_rate_hz = record.sample_rate_hz;
  s.motion = record.motion;
  s.output_quantity = record.output_quantity;
  s.has_excitation = record.excitation.present();
  s.has_position = record.position.present();
  s.input_unit = record.input.unit;
  s.output_unit = record.output.unit;
  s.track = options;
  s.row_every_s = every > 0 ? static_cast<double>(every) / record.sample_rate_hz : kRow_s;
  s.baseline_s = std::min(kMostWatched_s, kShareWatched * record.duration_s());
  s.alarms = standard_alarms();
  s.false_alarm_interval_s = *monitoring::detector_interval_s(interval_s, detectors_of(AxisConfig{}));
  replay.record = std::make_shared<const data::Record>(std::move(record));
  return replay;
}

std::optional<Error> motion_fault(const data::Record& record) {
  auto fault = motion_fault(record.motion, ColumnUnit{record.input.name, record.input.unit},
                            ColumnUnit{record.output.name, record.output.unit});
  if (!fault) return std::nullopt;
  return Error{"motion", std::move(*fault)};
}

expected<Replay, Error> replay_of(const Configuration& configuration, const std::string& axis,
                                  const std::filesystem::path& path) {
  const auto& axes = configuration.axes.tables;
  const auto found = axes.find(axis);
  if (found == axes.end()) {
    std::vector<std::string> names;
    for (const auto& [name, config] : axes) names.push_back(name);
    return refuse("axis", fmt::format("found {}{}, required one of: {}", io::in_quotes(axis),
                                      io::suggestion(axis, names), io::listed(names)));
  }
  auto spec = spec_in(configuration, axis);
  if (!spec) return unexpected(std::move(spec.error()));
  // The reader converts a position by its unit; what its scale is beyond that is left to the monitor.
  Configuration unscaled = configuration;
  unscaled.axes.tables.at(axis).position_scale = 1.0;
  const auto converted = spec_in(unscaled, axis);
  if (!converted) return unexpected(converted.error());
  auto record = io::read_record(path, mapping_of(found->second));
  if (!record) return unexpected(in_keys(std::move(record.error())));
  if (!spec->has_excitation) record->excitation = {};
  if (!spec->has_position) record->position = {};
  for (double& ru : record->excitation.samples) ru *= spec->excitation_scale;
  spec->input_scale = spec->excitation_scale = spec->output_scale = 1.0;
  spec->position_scale /= converted->position_scale;
  return Replay{std::make_shared<const data::Record>(std::move(*record)), std::move(*spec),
                found->second.controller};
}

Installation replay_installation(Replay replay, const std::filesystem::path& data, double speed,
                                 std::string version) {
  constexpr double kMostInRing = 1e6;  // samples: those of half a second at full speed, and more
  constexpr double kNever_s = 1e9;
  const auto& record = *replay.record;
  const std::int64_t first_ns = now_ns();
  Installation all;
  all.data = data;
  all.version = std::move(version);
  all.engine.workers = 1;
  all.engine.stale_s = kNever_s;      // the end of a recording is no fault
  all.engine.snapshot_every_s = 0.2;  // with which room comes into the ring
  all.engine.time_text = [first_ns, start_s = record.start_time_s](std::int64_t ns) {
    return fmt::format("{:.3f} s", start_s + 1e-9 * static_cast<double>(ns - first_ns));
  };
  InstalledAxis axis;
  axis.columns = {replay.spec.has_excitation ? "ru" : "", "u", "y",
                  replay.spec.has_position ? "position" : ""};
  axis.source = "replay";
  axis.ring_s = std::max(axis.ring_s, std::min(kMostInRing, 2.0 * static_cast<double>(record.samples())) /
                                          record.sample_rate_hz);
  axis.controller = std::move(replay.controller);
  axis.configuration = "replay of " + record.source;
  axis.spec = std::move(replay.spec);
  all.axes.push_back(std::move(axis));
  all.sources.push_back(
      {"replay", "replay", [settings = ReplaySettings{replay.record, first_ns, speed}](Axes& axes) {
         return make_replay_source(settings, axes);
       }});
  return all;
}

}  // namespace resonid::monitor
