// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/diagnostics/detail/residual_dependence.hpp>
#include <resonid/diagnostics/gap.hpp>
#include <resonid/diagnostics/residuals.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>
#include <resonid/response/detail/power_spectrum.hpp>
#include <string>
#include <utility>
#include <vector>

namespace resonid::identification {

/// What a model leaves of the record that it was fitted to.
struct OwnResidual {
  double rms = 0.0;          ///< In the output's unit.
  double fit_percent = 0.0;  ///< Fit of the simulation.
};

/// What is to be validated: an identified drive, or any transfer function.
struct CandidateModel {
  std::string source;                                       ///< File it comes from.
  std::optional<ModelResult> model;                         ///< Model of a result.
  std::optional<data::TransferFunction> transfer_function;  ///< Without delay.
  Eigen::MatrixXd covariance;  ///< Covariance of its [b0, b1, ..., a1, a2, ...]; empty: unknown.
  /// Output quantity of the transfer function.
  data::OutputQuantity output_quantity = data::OutputQuantity::velocity;
  double known_delay_s = 0.0;      ///< Known delay of the result.
  std::size_t delay_samples = 0;   ///< Delay of a black box, the known one included; 0: the known one.
  std::optional<OwnResidual> own;  ///< Residual on the record that the result is from.
  std::string units_response;      ///< Unit of the result's response; empty: unknown.
  bool trusted = true;             ///< Whether the result is trusted.
  std::string record_file = {};    ///< Record that the result is from ...
  std::size_t record_samples = 0;  ///< ... and how many samples of it.
  /// Band in which it was identified: the lines of its result that are known to 50 %.
  std::optional<std::pair<double, double>> band_hz = {};
};

/// The model of a result that has one, drive or black box.
[[nodiscard]] CandidateModel candidate_of(const Result& result);

struct ValidateOptions {
  Options common;  ///< Delay, controller, approach, band, excitation ... as for identify().
  std::size_t max_lag = 25;
  std::optional<std::pair<double, double>> fit_band_hz =
      {};  ///< Also report the fit within it, 0 <= low < high.
  /// Whether the record's file is the one that the result is from; not known: by name and residual.
  std::optional<bool> own_record = {};
};

/// Share of the output that the residual is in a band of frequencies, low_hz <= f < high_hz.
struct ResidualBand {
  double low_hz = 0.0, high_hz = 0.0;
  double output_share = 0.0;          ///< Share of the output's power (about its mean), 0 ... 1.
  double residual_share = 0.0;        ///< Share of the residual's power.
  double residual_over_output = 0.0;  ///< Ratio of the powers there.
};

/// The band in which a model is judged; what lies outside is shown.
struct JudgedBand {
  double low_hz = 0.0, high_hz = 0.0;
  bool of_model = false;      ///< Where the model was identified; otherwise where this record has lines.
  double fit_percent = 0.0;   ///< 100 (1 - sqrt(residual/output power)) within it.
  double residual_rms = 0.0;  ///< Within it, in the output's unit.
};

enum class Verdict {
  accepted,  ///< Nothing speaks against the model.
  doubtful,  ///< It describes the drive, and misses something that shows.
  rejected,  ///< It is not this drive.
};
inline constexpr EnumName<Verdict> kVerdictNames[] = {
    {Verdict::accepted, "accepted"}, {Verdict::doubtful, "doubtful"}, {Verdict::rejected, "rejected"}};
[[nodiscard]] constexpr std::span<const EnumName<Verdict>> enum_names(Verdict) noexcept {
  return kVerdictNames;
}

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
  std::optional<data::Estimate> offset;  ///< Constant torque, estimated on this record.
  std::optional<data::Estimate>
      coulomb_friction;  ///< Where the model has it: estimated on this record again.
  diagnostics::ResidualTest residual_test;
  diagnostics::ResidualDependence dependence;  ///< On the excitation, else on the input.
  /// What looks like friction (over the velocity) or a dead zone (over the input); none where the output is
  /// not the model's own, in closed-loop prediction, and in records too short for it.
  std::vector<diagnostics::StaticMap> maps;
  response::PowerSpectrum output_spectrum, residual_spectrum;
  std::vector<ResidualBand> bands;            ///< Octaves down from half the sample rate.
  std::optional<double> fit_in_band_percent;  ///< 100 (1 - sqrt(residual/output power)) in fit_band_hz.
  std::optional<std::pair<double, double>> fit_band_hz;
  /// Where most of the residual lies below what excites the machine: the frequency from which correlations
  /// and fit are judged, and the fit there. Drift of an unexcited band says nothing of a model.
  std::optional<double> judged_from_hz, judged_fit_percent;
  std::optional<JudgedBand> judged;  ///< None where no line is known: everything is judged then.
  bool fitted_here = false;          ///< The record is the one that the model was fitted to.
  bool in_motion = false;            ///< Nothing but a motion profile and dry friction drives the record.
  bool in_loop =
      false;  ///< The input is more than the excitation: feedback puts this record's noise into it.
  std::optional<double> expected_fit_percent;  ///< If the model left here what it left of its own record.
  std::vector<double> simulated, residual;     ///< [sample] from first_sample on.
  std::size_t first_sample = 0;
  std::optional<data::FrequencyResponse> measured;  ///< The record's own response, where it has one.
  std::optional<data::FrequencyResponse> modelled;  ///< The model's at the same lines.
  std::optional<diagnostics::GapCurve> gap;         ///< Between these two.
  std::optional<double>
      response_error;  ///< Relative difference of the two (rms over lines) beyond the noise.
  std::optional<double> response_error_low;  ///< What it is at least, with 95 %.
  /// The line at which the two differ most in multiples of their noise, by how much of |G| beyond the noise,
  /// and how probable noise alone makes that at any line.
  std::optional<double> worst_line_hz, worst_line_error, response_probability;
  Verdict verdict = Verdict::accepted;
  bool trusted = false;  ///< Not rejected, and nothing wrong with the record.
  std::vector<diagnostics::Finding> findings;
};

/// Simulates a model on an independent record; constant torque and initial state are estimated, nothing else.
/// Residual tests (docs/methods/residual_tests.md), and the distance to the record's own response where there
/// is an excitation to measure it. That distance is the response from the input to the residual: its leakage
/// and smoothing are those of the difference, not of the whole response, so a true model has none.
///
/// Nothing counts against a model that chance, or its own uncertainty, explains: the residual must depend on
/// excitation or input (probability below 1 %, residual_dependence), or the response must differ at one line
/// (below 1e-4, all lines counted). Then a model is rejected when model and measured response differ by more
/// than 30 % (rms over the lines, at least), or when it reproduces less than half of the output and the rest
/// follows the input beyond the practical limit. It is doubtful beyond 10 %, beyond the practical limit,
/// where a single line differs by more than 10 %, where an inertia or a stiffness fitted to this record
/// differs by more than 2 % and 4 standard deviations, or where it fits 10 points less than the residual on
/// its own record lets expect. All of it is judged in the band in which the model was identified (as far as
/// this record excites it), by the correlation with the excitation where feedback puts noise into the input.
/// Where most of the residual lies below the lowest line of the record's
/// response, correlations and fit are those above it. A response that feedback biases is not compared; what
/// is wrong with the response alone is a warning then, since the verdict is that of the simulation.
///
/// On the record that it was fitted to, a model is not called better than its result: not accepted where that
/// is not trusted. What the record's response alone would say and the model explains (a spring to the ground;
/// the motion and friction that drive the record) is no finding, as in identify().
///
/// `common.approach` indirect: the closed-loop predictor, driven by the excitation (and reference) alone
/// through the known controller, so that no noise reaches the model's input.
[[nodiscard]] expected<ModelValidation, Error> validate(const data::Record& record,
                                                        const CandidateModel& candidate,
                                                        const ValidateOptions& options = {});
/// The model of a result. Refused: a result without one.
[[nodiscard]] expected<ModelValidation, Error> validate(const data::Record& record, const Result& result,
                                                        const ValidateOptions& options = {});

}  // namespace resonid::identification
