// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/identify.hpp>
#include <resonid/response/line_estimates.hpp>
#include <resonid/tracking/sweep.hpp>

namespace resonid::identification::detail {

/// What will be done with a record, every choice made.
struct Plan {
  ExcitationType excitation = ExcitationType::other;
  Method method = Method::welch;  ///< Never automatic; for Method::model, how the response is measured first.
  Approach approach = Approach::direct;
  std::size_t period_samples = 0;           ///< 0: not periodic.
  std::optional<tracking::SweepLaw> sweep;  ///< Of a chirp that is known.
  double low_hz = 0.0;
  double high_hz = 0.0;
  std::vector<double> grid_hz;  ///< Frequencies to report; empty: those of the method.
  /// The record's own, with which the model is simulated in its loop; absent: by the recorded input.
  std::optional<data::TransferFunction> loop_controller;
};

[[nodiscard]] expected<Plan, Refusal> make_plan(const data::Record& record, const Options& options);

[[nodiscard]] std::string name_of(Method method);
[[nodiscard]] std::string name_of(Approach approach);

/// Ru, U and Y at the lines, by the plan's method.
[[nodiscard]] expected<response::LineEstimates, Refusal> measure(const data::Record& record, const Plan& plan,
                                                                 const Options& options);

}  // namespace resonid::identification::detail
