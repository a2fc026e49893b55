// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/io/record_reader.hpp>
#include <string>

namespace resonid::cli {

/// The verbs that work on a record share its options: the same words mean the same everywhere.
struct RecordOptions {
  std::string record;
  io::ColumnMapping columns;
};

/// RECORD itself, and which column is which signal; a second output is refused.
void add_record_options(CLI::App& verb, RecordOptions& o);
/// Which column is which signal.
void add_signal_options(CLI::App& verb, RecordOptions& o);
/// --second-output and what goes with it.
void add_second_output_options(CLI::App& verb, RecordOptions& o);

/// Reads the record that the options name; a wrong one is an InputError.
[[nodiscard]] data::Record read_record(const CLI::App& verb, const RecordOptions& o);

/// What the user knows and wants, and the words whose meaning needs the record.
struct MethodOptions {
  identification::Options options;
  std::string controller, planned_controller;  ///< As written; in `options` after complete().
  double lambda = 0.0, pole_radius = 0.0;
};

/// --excitation-type, --chirp, --lines, --period-samples, --drop-periods.
void add_excitation_options(CLI::App& verb, MethodOptions& o);
/// --approach, --controller, --delay.
void add_loop_options(CLI::App& verb, MethodOptions& o);
/// --radius
void add_radius_option(CLI::App& verb, MethodOptions& o);
/// --band, --confidence, --radius.
void add_result_options(CLI::App& verb, MethodOptions& o);
/// --friction
void add_friction_option(CLI::App& verb, MethodOptions& o, const std::string& doc);
/// --model of what can be tracked.
void add_drive_model_option(CLI::App& verb, MethodOptions& o);
/// --method
void add_method_option(CLI::App& verb, MethodOptions& o, const std::string& doc);
/// --friction, --ground, --torque-lag, --output-filter: what is known of the drive.
void add_drive_options(CLI::App& verb, MethodOptions& o);
/// --model of all that can be fitted off line, --order, --bootstrap, --seed.
void add_model_options(CLI::App& verb, MethodOptions& o);
/// --lambda, --pole-radius, --no-smoothing, --no-offset of the kalman method.
void add_tracker_options(CLI::App& verb, MethodOptions& o);

/// Refuses what can be refused before the record is read.
void check(const CLI::App& verb, MethodOptions& o);
/// The controller at the record's sample time.
void complete(MethodOptions& o, const data::Record& record);

}  // namespace resonid::cli
