// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/measure/loop_evidence.hpp>
#include <identification/identify/measure/methods.hpp>
#include <identification/identify/prepare/prepare.hpp>

namespace resonid::identification::detail {

/// The response as it was measured, and what it and the record show of the loop.
struct Measurement : Measured {
  Plan plan;                         ///< With the method and the band that came out of it.
  std::optional<Choice> method;      ///< Where that is not the planned one.
  std::optional<Choice> resolution;  ///< Of averaged spectra.
  data::FrequencyResponse response;
  std::optional<data::FrequencyResponse> second_response;  ///< Of the load's velocity, where it is measured.
  std::optional<Distortion> distortion;
  LoopEvidence evidence;
  bool controller_differs = false;  ///< The controller that was told is not the one that ran.
  std::vector<diagnostics::Finding> findings;
};

/// The second step of identify(). Averages take for noise whatever does not repeat with the excitation, such
/// as a motion: where they leave next to nothing and the method is not asked for, local polynomials take its
/// smooth spectrum out. Refused: what the method refuses, and records without a finite response.
[[nodiscard]] expected<Measurement, Error> measure(const Experiment& experiment, const Options& options);

/// Input to velocity of the load by these samples in the place of the record's second output, at the lines of
/// the output and as they were measured; by U, which the indirect approach does without. `segment_samples`:
/// what a simulation leaves does not show local fits how wide they may be; averaged spectra of such segments
/// take their place.
[[nodiscard]] expected<data::FrequencyResponse, Error> load_response(const data::Record& record,
                                                                     std::vector<double> samples,
                                                                     std::size_t segment_samples,
                                                                     const Measurement& measurement,
                                                                     const Options& options);

/// By the plan's method, nothing else tried.
[[nodiscard]] expected<data::FrequencyResponse, Error> measure_response(const data::Record& record,
                                                                        const Plan& plan,
                                                                        const Options& options);

}  // namespace resonid::identification::detail
