// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "monitor/brokers/publisher.hpp"
#include "monitor/engine/engine.hpp"
#include "monitor/samples/intake.hpp"
#include "monitor/sources/source.hpp"
#include "monitor/store/store.hpp"
#include "monitor/web/server.hpp"
#include "monitoring/axis_spec.hpp"

namespace resonid::monitor {

/// One axis of an installation: what it is, and where its samples come from.
struct InstalledAxis {
  monitoring::AxisSpec spec;
  ColumnNames columns;
  std::string source, channel;  ///< Name of the source, and of the axis there; empty: its only one.
  double ring_s = 120.0;        ///< Length of the ring of raw samples.
  std::string configuration;    ///< Canonical text of all that its rows depend on.
  std::string controller;       ///< In words; empty: not told.
};

/// One source of an installation.
struct InstalledSource {
  std::string name, kind;
  std::function<expected<std::unique_ptr<Source>, Error>(Axes&)> make;
};

/// Where alarms are told.
struct InstalledTarget {
  std::string name;   ///< Which messages that wait are for.
  std::string topic;  ///< As Publisher::publish() wants it.
  std::function<expected<std::unique_ptr<Publisher>, Error>()> make;
};

/// All that the service runs.
struct Installation {
  std::filesystem::path data;  ///< Folder of database, rings and evidence; made where it is not there.
  std::vector<InstalledAxis> axes;
  std::vector<InstalledSource> sources;
  std::vector<InstalledTarget> targets;
  EngineOptions engine;
  Retention retention;
  web::WebOptions web;
  std::string version;
  double false_alarm_interval_s = 3.6e6;  ///< Of the installation; those of the detectors stand in the axes.
};

}  // namespace resonid::monitor
