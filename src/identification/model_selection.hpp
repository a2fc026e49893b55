// SPDX-License-Identifier: MIT
#pragma once

#include <identification/measurement.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/fit/response_fit.hpp>

namespace resonid::identification::detail {

/// The chosen model and how it was come by.
struct Selection {
  ModelResult result;
  std::vector<double>
      residual;  ///< Of the simulation, from residual_start on; empty for a model of the response.
  std::size_t residual_start = 0;
  double fit_percent = 0.0;
  std::vector<StructureTrial> structures;  ///< All that were fitted, the simplest first.
  Choice choice;                           ///< Of the structure.
};

/// Fits rigid, two-mass and three-mass structures and chooses by what each says of samples that it has not
/// seen; nothing when no fit came out (the findings say why). `to_record` false: the response alone is
/// fitted. So it must be where its standard deviations hold distortion: the record repeats that with every
/// period, and its likelihood would take each for new information.
[[nodiscard]] std::optional<Selection> select_model(const data::Record& record, const Plan& plan,
                                                    const Options& options,
                                                    const data::FrequencyResponse& response,
                                                    bool to_record = true);

}  // namespace resonid::identification::detail
