// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <string>

#include "monitor/service/configuration.hpp"
#include "monitor/service/installation.hpp"

namespace resonid::monitor {

/// A recording that goes through the monitor as one axis.
struct Replay {
  std::shared_ptr<const data::Record> record;
  monitoring::AxisSpec spec;  ///< Of the samples as the record holds them.
  std::string controller;     ///< In words; empty: not told.
};

/// The axis as the options of `track` tell it; changes are told after a tenth of the recording, ten minutes
/// at most. `every`: samples per row; 0: a tenth of a second.
[[nodiscard]] Replay replay_of(data::Record record, const identification::TrackOptions& options,
                               std::string controller, std::size_t every);

/// What contradicts the motion of a recording in its units: the monitor would name its figures wrongly.
[[nodiscard]] std::optional<Error> motion_fault(const data::Record& record);

/// A recording in the place of the source of an axis, whose columns, units, rate and settings count. Errors:
/// as io::read_record(), in the keys of the configuration; no such axis.
[[nodiscard]] expected<Replay, Error> replay_of(const Configuration& configuration, const std::string& axis,
                                                const std::filesystem::path& path);

/// What runs a replay with this data folder. The recording begins now; texts of alarms tell its own times.
/// `speed`: its seconds per second; 0: as fast as it goes.
[[nodiscard]] Installation replay_installation(Replay replay, const std::filesystem::path& data, double speed,
                                               std::string version);

}  // namespace resonid::monitor
