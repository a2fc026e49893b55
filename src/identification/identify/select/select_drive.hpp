// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/measure/methods.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/fit/response_fit.hpp>
#include <resonid/identification/result.hpp>
#include <span>

namespace resonid::identification::detail {

/// How far the response of the record that a model with dry friction simulates is from the measured one.
struct MeasuredAlike {
  double error = 0.0;        ///< As ModelResult::model_error.
  bool by_friction = false;  ///< The record simulated without the friction leaves it unexplained.
};

/// The chosen model and how it was come by.
struct Selection {
  ModelResult result;            ///< The offset of a single record only: every record has its own.
  std::vector<double> residual;  ///< Of a single record's simulation, from residual_start on; empty for a
                                 ///< model of the response.
  std::size_t residual_start = 0;
  double fit_percent = 0.0;                      ///< Of all records together.
  double residual_rms = 0.0;                     ///< Likewise.
  std::vector<double> fit_percents;              ///< [record]; empty for a model of the response.
  std::vector<fit::Consistency> against_others;  ///< [record] Of several, where fitted to them.
  std::optional<diagnostics::Finding> outliers;  ///< Of the residual of a single record.
  std::vector<fit::Constancy> inconstant;        ///< Parameters that a single record shows to change.
  std::vector<StructureTrial> structures;        ///< All that were fitted, the simplest first.
  Choice choice;                                 ///< Of the structure.
  std::optional<ModelResult> simpler;  ///< Two masses where three were chosen, both fitted to the record.
  /// The model with the spring to the ground on the other side, where the record does not tell which it is.
  std::optional<fit::DriveModel> other_ground;
  bool in_motion = false;  ///< From inverse dynamics: the measured response has no say.
  /// Where ModelResult::model_error of the drive alone is large and the model has dry friction.
  std::optional<MeasuredAlike> measured_alike;
  std::optional<diagnostics::Finding> contradiction;  ///< By the motion, see inspect_against_motion().
};

/// Fits rigid, two-mass and three-mass structures and chooses by what each says of samples that it has not
/// seen; nothing when no fit came out (the findings say why). Several records of one sample rate are fitted
/// in one likelihood. Beside the response's fits, `starts` of the same structure begin the fits to the
/// records. Without `to_records` the response alone is fitted: so it must be
/// where its standard deviations hold distortion, which records repeat with every period, and their
/// likelihood would take each for new information.
[[nodiscard]] std::optional<Selection> select_model(std::span<const data::Record> records, const Plan& plan,
                                                    const Options& options,
                                                    const data::FrequencyResponse& response,
                                                    std::span<const fit::DriveModel> starts = {},
                                                    bool to_records = true);

/// How far a model is from the measured response beyond its noise, relative.
[[nodiscard]] double unexplained_difference(const fit::DriveModel& model,
                                            const data::FrequencyResponse& response);

}  // namespace resonid::identification::detail
