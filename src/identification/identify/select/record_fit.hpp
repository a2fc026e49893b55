// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/fit/detail/controller_estimate.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>
#include <span>

namespace resonid::identification::detail {

/// One drive fitted to one record or, in one likelihood, to several.
struct RecordFit {
  fit::DriveModel model;
  bool converged = false;
  std::optional<data::Estimate> coulomb_friction;
  fit::FurtherFriction further_friction;
  std::vector<fit::LackingFriction> lacking_friction;
  double fit_percent = 0.0;   ///< Of the simulations of all records together.
  double residual_rms = 0.0;  ///< Of all records together, means removed.
  double bic = 0.0;
  std::optional<fit::HoldoutFit> holdout;        ///< Of all records together.
  std::vector<fit::OutputErrorFit> records;      ///< [record]
  std::vector<fit::Consistency> against_others;  ///< [record] Of several: each against all others.
};

/// Nothing where the fit refuses the records. They have one sample rate and one output quantity.
[[nodiscard]] std::optional<RecordFit> fit_records(std::span<const data::Record> records,
                                                   fit::OutputErrorConfig config);

/// Dry friction is estimated as it was found, and from there.
void use_friction(const std::optional<data::Estimate>& coulomb, const fit::FurtherFriction& further,
                  fit::OutputErrorConfig& config);

/// An approach that was asked for holds for the fit to the records too. By itself the recorded input drives
/// the simulation: with the noise modelled that is right in closed loop too, and loses nothing.
/// With a `loop_controller` (Plan) the model is simulated in its loop.
void use_predictor(std::span<const data::Record> records, const Options& options,
                   const std::optional<fit::ControllerEstimate>& loop_controller,
                   fit::OutputErrorConfig& config);

/// Settings of the fit that a model came from, begun at the model.
[[nodiscard]] fit::OutputErrorConfig config_of(const ModelResult& model,
                                               std::span<const data::Record> records, const Options& options,
                                               const std::optional<fit::ControllerEstimate>& loop_controller);

/// The simulation by a model as it is on the record's input, from the state and with the load torque that
/// come nearest to the record; every delay to the fraction of a sample.
[[nodiscard]] expected<fit::OutputErrorFit, Error> simulation_by(const ModelResult& model,
                                                                 const data::Record& record,
                                                                 double known_delay_s);

/// The record with what was simulated in the place of its output.
[[nodiscard]] data::Record simulated_record(data::Record record, const std::vector<double>& residual);

}  // namespace resonid::identification::detail
