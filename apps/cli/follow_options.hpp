// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/track.hpp>
#include <string>

#include "record_options.hpp"

namespace resonid::cli {

/// How a recording is followed by an on-line estimator, for every verb that does.
struct FollowOptions {
  RecordOptions record;
  MethodOptions method;
  identification::TrackOptions track;
  std::string start, baseline, result;
};

/// Excitation, estimator, loop, band, model; those of the recording are add_record_options() and
/// add_signal_options(). `every_standard` tells in words what --every is otherwise.
void add_follow_options(CLI::App& verb, FollowOptions& o, const std::string& every_standard);

/// Takes what the first of the results that are given stores of the machine, and refuses what can be refused
/// before the recording is read.
void settle(CLI::App& verb, FollowOptions& o);

/// The recording; `o.track` is complete then.
[[nodiscard]] data::Record read_followed(CLI::App& verb, FollowOptions& o);

}  // namespace resonid::cli
