// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/diagnostics/gap.hpp>
#include <resonid/diagnostics/residuals.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>
#include <string>
#include <vector>

namespace resonid::identification {

/// What is to be validated: an identified drive, or any transfer function from input to velocity.
struct CandidateModel {
  std::string source;                ///< File it comes from.
  std::optional<ModelResult> model;  ///< Of a result.
  std::optional<data::TransferFunction> transfer_function;
  std::string units_response;  ///< Of the result; empty: unknown.
  bool trusted = true;         ///< Of the result.
};

struct ValidateOptions {
  Options common;  ///< Delay, controller, approach, band, excitation ... as for identify().
  std::size_t max_lag = 25;
};

enum class Verdict {
  accepted,  ///< Nothing speaks against the model.
  doubtful,  ///< It describes the drive, and misses something that shows.
  rejected,  ///< It is not this drive.
};

/// How well a model holds on a record that it was not fitted to.
struct ModelValidation {
  RecordFacts record;
  Units units;
  CandidateModel candidate;
  std::string
      approach;  ///< "direct": simulated from the input; "indirect": from the excitation, in closed loop.
  double known_delay_s = 0.0;
  double simulation_fit_percent = 0.0;  ///< 100 (1 - |y - yh|/|y - mean y|), yh from the input alone.
  /// The same one step ahead: with the noise model that the residual shows, past outputs known.
  double prediction_fit_percent = 0.0;
  std::optional<fit::Estimate> offset;            ///< Constant torque, estimated on this record.
  std::optional<fit::Estimate> coulomb_friction;  ///< Where the model has it: estimated on this record again.
  diagnostics::ResidualTest residual_test;
  std::vector<double> simulated, residual;  ///< [sample] from first_sample on.
  std::size_t first_sample = 0;
  std::optional<data::FrequencyResponse> measured;  ///< The record's own response, where it has one.
  std::optional<data::FrequencyResponse> modelled;  ///< The model's at the same lines.
  std::optional<diagnostics::GapCurve> gap;         ///< Between these two.
  std::optional<double>
      response_error;  ///< Relative difference of the two (rms over lines) beyond the noise.
  /// The line at which the two differ most in multiples of their noise, by how much of |G| beyond the noise,
  /// and how probable noise alone makes that at any line.
  std::optional<double> worst_line_hz, worst_line_error, response_probability;
  Verdict verdict = Verdict::accepted;
  bool trusted = false;  ///< Not rejected, and nothing wrong with the record.
  std::vector<diagnostics::Finding> findings;
};

/// Simulates a model on an independent record; constant torque and initial state are estimated, nothing else.
/// Residual tests (METHOD 9), distance to the record's own response where there is an excitation to measure
/// it.
///
/// A model is rejected when model and measured response differ by more than 30 % (rms over the lines, beyond
/// the noise), or when it reproduces less than half of the output and the rest follows the input beyond the
/// practical limit. It is doubtful beyond 10 %, beyond the practical limit, or where a single line differs by
/// more than 10 % and noise cannot be why (probability below 1e-4, all lines counted). The limit of 3 % per
/// lag is shown with the signal-to-noise ratio and decides nothing: at high ratios even the true model fails
/// it.
///
/// `common.approach` indirect: the closed-loop predictor, driven by the excitation (and reference) alone
/// through the known controller, so that no noise reaches the model's input.
[[nodiscard]] expected<ModelValidation, Refusal> validate(const data::Record& record,
                                                          const CandidateModel& candidate,
                                                          const ValidateOptions& options);

}  // namespace resonid::identification
