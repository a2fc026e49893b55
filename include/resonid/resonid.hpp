// SPDX-License-Identifier: MIT
#pragma once

/// The front door: a record in; what it shows of the drive, and a page that shows it, out.
///
///     const auto record = resonid::read_record("run.csv").value();
///     const auto result = resonid::identify(record, {.controller = resonid::pi(1.036, 0.147)}).value();
///     resonid::write_report("report.html", result, record).value();
///
/// Every verb has one shape, expected<Result, Error> verb(input, options = {}). An error is a wrong call or
/// an unreadable file; poor data give a result whose findings say so. find_package(resonid) and
/// target_link_libraries(app resonid::resonid). What runs in a drive is the stage resonid::online.
#include <filesystem>
#include <resonid/base/error.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/controller.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/batch.hpp>
#include <resonid/identification/compare.hpp>
#include <resonid/identification/first_loop.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/identification/join.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/identification/tune_export.hpp>
#include <resonid/identification/validate.hpp>
#include <resonid/io/controller_file.hpp>
#include <resonid/io/record_reader.hpp>
#include <resonid/planning/plan.hpp>
#include <resonid/plant/experiment.hpp>
#include <string>
#include <string_view>

namespace resonid {

using data::Record;
using identification::Result;

/// Reads a CSV or MAT file; columns with usual names are found by themselves.
using ReadOptions = io::ColumnMapping;
[[nodiscard]] expected<Record, Error> read_record(const std::filesystem::path& file,
                                                  const ReadOptions& options = {});

/// Frequency response, modes, model, margins and trust of a record; of several records of one machine.
using IdentifyOptions = identification::Options;
using identification::identify;
using identification::join;
using identification::Joint;

/// Many records one by one, in parallel, their figures side by side.
using identification::Batch;
using identification::BatchTask;
using identification::identify_batch;

/// The record sample by sample through an on-line estimator.
using identification::Track;
using identification::track;
using identification::TrackOptions;

/// How a model holds on a record that it was not fitted to.
using identification::ModelValidation;
using identification::validate;
using identification::ValidateOptions;

/// What changed between two results.
using identification::Changes;
using identification::compare;
using identification::CompareOptions;

/// A controller for an identified drive, or for several, that keeps its bounds whatever the identification
/// leaves open; or the verdict on one that is given.
using identification::tune;
using identification::TuneOptions;
using identification::Tuning;

/// Results for a gain schedule, TuneOptions::positions, from one result and the rows of a track.
using identification::results_over_position;
using identification::ResultsOverPosition;

/// What the controller does on a simulated machine beside what was promised: the identified one, or that of
/// any experiment. Put into Tuning::simulated.
using identification::experiment_of;
using identification::simulate_on;
using identification::simulate_on_model;

/// What a recording under the controller, identified, shows beside what was promised. Put into Tuning::check.
using identification::check_on;
using identification::TuningCheck;

/// A loop soft enough to excite a machine in of which only inertias are known.
using identification::first_loop;
using identification::FirstLoop;
using identification::FirstLoopOptions;

/// The controller as C, structured text, LinuxCNC HAL or Klipper's lines, in SI units; what a format cannot
/// express is refused, by check_exportable() before it is designed.
using identification::check_exportable;
using identification::exported;
using identification::ExportFormat;
using identification::ExportNames;
using identification::first_step;

/// What takes gains to the recording's own units, which Tuning::input_scale and the fields beside it tell.
using identification::own_gains;
using identification::OwnGains;

/// The controller as the JSON file that read_controller(), and every option --controller, reads.
[[nodiscard]] expected<std::string, Error> controller_json(const Tuning& tuning);
[[nodiscard]] std::string controller_json(const FirstLoop& loop);

/// A controller from such a file, from its text, or as "pi:KP,TI", for records of that sample time.
using io::ControllerFile;
using io::read_controller;

/// The excitation that reaches the wanted accuracies within the drive's limits; of an identified drive, its
/// model and noise are put in place of those of the options.
using planning::Plan;
using PlanOptions = planning::PlanConfig;
[[nodiscard]] expected<Plan, Error> plan(const PlanOptions& options);
[[nodiscard]] expected<Plan, Error> plan(const Result& identified, PlanOptions options = {});

/// A simulated experiment, as its TOML file tells it, and the record that it gives with what is true of it.
using plant::Simulation;
using plant::Truth;
using SimulateOptions = plant::ExperimentConfig;
[[nodiscard]] expected<SimulateOptions, Error> read_experiment(const std::filesystem::path& file);
[[nodiscard]] expected<Simulation, Error> simulate(const SimulateOptions& options);

/// One self-contained page; it appears complete or not at all. Returns the file.
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Result& result,
                                                    const Record& record);
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Batch& batch);
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Batch& batch,
                                                    const Joint& joint);
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file,
                                                    const ModelValidation& validation, const Record& record);
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Track& track);
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file,
                                                    const Changes& changes);
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Plan& plan);
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file, const Tuning& tuning);
expected<std::filesystem::path, Error> write_report(const std::filesystem::path& file,
                                                    const Simulation& simulation);

/// A result as the command line writes it; docs/results.md lists the keys.
[[nodiscard]] std::string to_json(const Result& result);
[[nodiscard]] std::string to_json(const Batch& batch);
[[nodiscard]] std::string to_json(const Batch& batch, const Joint& joint);
[[nodiscard]] std::string to_json(const Track& track);
[[nodiscard]] std::string to_json(const ModelValidation& validation);
[[nodiscard]] std::string to_json(const Changes& changes);
[[nodiscard]] std::string to_json(const Plan& plan);
[[nodiscard]] std::string to_json(const Tuning& tuning);
[[nodiscard]] std::string to_json(const Truth& truth);

/// What to_json() wrote. What a file does not hold is empty: residuals, loop curves, samples. A file of
/// several records holds a Batch and, where they were joined, a Joint.
template <class T>
[[nodiscard]] expected<T, Error> from_json(std::string_view text) = delete;
template <>
[[nodiscard]] expected<Result, Error> from_json<Result>(std::string_view text);
template <>
[[nodiscard]] expected<Batch, Error> from_json<Batch>(std::string_view text);
template <>
[[nodiscard]] expected<Joint, Error> from_json<Joint>(std::string_view text);
template <>
[[nodiscard]] expected<Track, Error> from_json<Track>(std::string_view text);
template <>
[[nodiscard]] expected<ModelValidation, Error> from_json<ModelValidation>(std::string_view text);
template <>
[[nodiscard]] expected<Changes, Error> from_json<Changes>(std::string_view text);
template <>
[[nodiscard]] expected<Plan, Error> from_json<Plan>(std::string_view text);
template <>
[[nodiscard]] expected<Tuning, Error> from_json<Tuning>(std::string_view text);
template <>
[[nodiscard]] expected<Truth, Error> from_json<Truth>(std::string_view text);

}  // namespace resonid
