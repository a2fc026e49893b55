// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <resonid/data/mode.hpp>
#include <resonid/data/record.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <resonid/fit/black_box.hpp>
#include <resonid/fit/detail/second_output.hpp>
#include <resonid/fit/drive_model.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/response/detail/distortion_level.hpp>
#include <string>
#include <vector>

namespace resonid::identification {

/// What the result says about the record it came from.
struct RecordFacts {
  std::string file;
  std::size_t samples = 0;  ///< Used, after cutting.
  double sample_rate_hz = 0.0;
  std::string time, input, output, excitation, reference;  ///< Signal names; empty: not there.
  data::OutputQuantity output_quantity = data::OutputQuantity::velocity;
  std::vector<std::string> reading;  ///< What the reader assumed and converted, a sentence each.
};

/// Units of signals, response and parameters, as told by the record.
struct Units {
  std::string input;      ///< "Nm"
  std::string velocity;   ///< Unit of the velocity that responses refer to: "rad/s".
  std::string response;   ///< "(rad/s)/Nm"
  std::string inertia;    ///< "kgm2", or input unit times s2 over position unit when not SI.
  std::string stiffness;  ///< "Nm/rad"
  std::string damping;    ///< "Nms/rad"
  std::string torque;     ///< Unit of friction and offset: "Nm".
  bool physical = true;   ///< False: input or output is not torque and angle (volts ...).
};

struct ModelResult {
  fit::DriveModel drive;
  bool from_record = true;   ///< Fitted to the record (output error); otherwise to the measured response.
  double model_error = 0.0;  ///< Relative difference to the measured response that noise does not explain.
  std::optional<data::Estimate> coulomb_friction;
  std::optional<data::Estimate> offset;
  fit::FurtherFriction further_friction = {};

  /// On either side.
  [[nodiscard]] bool has_dry_friction() const noexcept { return coulomb_friction || further_friction.any(); }
};

/// |L| = 1, falling with the frequency or rising.
struct LoopCrossing : diagnostics::Crossover {
  bool falling = true;
  std::optional<double> phase_margin_std_deg = {};
};

struct LoopResult {
  diagnostics::LoopMargins margins;
  data::FrequencyResponse curve;  ///< L, delay included.
  std::string source;             ///< "model" or "response".
  std::optional<double> crossover_std_hz, phase_margin_std_deg, modulus_margin_std,
      gain_margin_std_db;                    ///< From the model's covariance.
  std::vector<LoopCrossing> crossings = {};  ///< All, ascending, of a planned loop only; not in JSON.
};

/// Non-linear distortion beside noise, from realisations of a random-phase excitation or from lines that it
/// leaves out (docs/methods/best_linear_approximation.md, detection_lines.md).
struct Distortion {
  std::size_t realisations = 0;        ///< 0: only detection lines tell.
  std::vector<double> noise_std;       ///< [line of the response] of the mean, by noise alone
  std::vector<double> distortion_std;  ///< [line] of the response of one realisation, by distortion
  /// Scatter of the realisations over their noise; no lines without them.
  response::DistortionLevel scatter;
  response::DistortionLevel even, odd;  ///< At detection lines of each kind; no lines: there are none.
};

/// How well the model reproduces what it was fitted to.
struct Validation {
  double fit_percent = 0.0;  ///< 100 (1 - |y - yh|/|y - mean y|): of the simulated record, or of its lines.
  bool of_record = true;     ///< False: over the excited lines (a model that was fitted to the response).
  std::optional<double> cross_correlation_max;  ///< Residual with simulated output; of the record only.
  std::optional<double> limit;
  std::optional<double> residual_rms = {};  ///< In the output's unit; of the record only.
};

/// One decision that was left to the program.
struct Choice {
  std::string what;     ///< "method", "approach", "structure", "noise model" ...
  std::string chosen;   ///< "local-cubic"
  std::string because;  ///< A sentence: what of the record decided.
};

/// One structure that was tried, for the comparison side by side.
struct StructureTrial {
  std::string name;            ///< "two-mass with friction and delay", "black-box of order 5"
  std::size_t parameters = 0;  ///< Estimated ones, initial state and offset not counted.
  double bic = 0.0;            ///< Bayesian information criterion of the record (response: of its lines).
  std::optional<double> holdout_fit_percent;  ///< Simulated on the hold-out data.
  std::optional<double> holdout_score;        ///< N ln(mean square) there, smaller is better.
  bool chosen = false;
  std::string remark;                                  ///< Why not: "no third mode in the band".
  std::optional<ModelResult> model = {};               ///< What was fitted, where it was kept.
  std::optional<fit::BlackBoxModel> black_box = {};    ///< The same without drive structure.
  std::optional<double> independent_fit_percent = {};  ///< Simulated on another record, see validate_on().
};

/// A pole or zero in the s-plane (1/s), of sampled models by s = ln(z)/Ts.
struct Root {
  std::complex<double> value;
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< Covariance of (real, imaginary).
  std::string kind;                                      ///< "pole" or "zero".
};

/// Rational model of the record, without drive structure.
struct BlackBoxResult {
  fit::BlackBoxModel model;
  double fit_percent = 0.0;  ///< Fit of the simulation.
  bool converged = true;
  bool stable = true;  ///< No pole outside the unit circle but for an integrator within its error bar.
  std::optional<data::Estimate> further_delay = {};  ///< In s, on top of the known one, where one was found.
};

/// What a figure would be in repetitions of the experiment on the fitted model.
struct BootstrapInterval {
  std::string name;  ///< As in JSON: "stiffness", "resonance_hz", "phase_margin_deg".
  std::string unit;
  double low = 0.0, high = 0.0;  ///< Interval at the result's confidence.
  double std = 0.0;              ///< Over the replicas.
  /// Values of the replicas that have all figures with an interval, in one order.
  std::vector<double> values;
};
struct Bootstrap {
  std::size_t replicas = 0;
  std::size_t failed = 0;  ///< Replicas whose fit did not converge; left out.
  std::vector<BootstrapInterval> intervals;
};

/// How the model holds on a record that it was not fitted to.
struct IndependentValidation {
  std::string file;
  std::string approach;                 ///< "direct" or "indirect", as in validate().
  double simulation_fit_percent = 0.0;  ///< 100 (1 - |y - yh|/|y - mean y|), not one step ahead.
  double prediction_fit_percent = 0.0;
  std::optional<double>
      response_error;   ///< Relative distance to that record's own response beyond the noise.
  std::string verdict;  ///< "accepted", "doubtful", "rejected".
};

/// What was measured at the load, and how it agrees with the drive model.
struct SecondOutputResult {
  data::SecondOutput kind = data::SecondOutput::load_encoder;
  std::string signal;                  ///< Name of the column.
  std::string unit;                    ///< Unit of the response, "(rad/s)/Nm".
  data::FrequencyResponse response;    ///< Input to velocity of the load, known delay removed.
  bool fitted = false;                 ///< The drive model is that of both outputs; otherwise of the output.
  std::optional<double> model_error;   ///< Relative difference to the model that noise does not explain.
  std::optional<data::Estimate> gain;  ///< Measured over expected, where it is not 1.
  std::optional<data::Estimate> delay_s = {};  ///< By which it is later than the output, where it is not 0.
};

/// What holds of a result by itself, where the whole need not be trusted.
struct Reliability {
  bool response = false;    ///< The lines that are known to 30 %.
  bool resonances = false;  ///< All that are given.
  bool parameters = false;  ///< Those of the drive model.
  bool margins = false;
};

/// An option of the command line as it was given, by its name without dashes: {"output-scale", "-1"}.
struct GivenOption {
  std::string name, value;
};

struct Result {
  RecordFacts record;
  Units units;
  std::string method;    ///< As on the command line: "local-polynomial".
  std::string approach;  ///< "direct", "indirect", "joint".
  double confidence = 0.95;
  double known_delay_s = 0.0;
  std::optional<double> radius_m;
  data::FrequencyResponse response;
  std::optional<Distortion> distortion;
  std::optional<SecondOutputResult> second_output;
  std::vector<data::Mode> modes;  ///< Ascending.
  std::optional<ModelResult> model;
  std::optional<BlackBoxResult> black_box;  ///< In place of `model` when no drive structure was asked for.
  std::vector<Root> roots;                  ///< Poles and then zeros of the model.
  std::vector<Choice> choices;              ///< What was chosen by the record, in the order of the work.
  std::vector<StructureTrial> structures;   ///< All that were fitted.
  std::optional<Bootstrap> bootstrap;
  std::optional<LoopResult> loop;
  std::optional<LoopResult> planned_loop;                ///< The same with Options::planned_controller.
  std::optional<data::FrequencyResponse> measured_loop;  ///< L = Ru/U - 1 at the lines.
  std::optional<Validation> validation;
  std::optional<IndependentValidation> independent;
  std::vector<double> residual;    ///< [sample] of the model's simulation; empty without a model.
  std::size_t residual_start = 0;  ///< Sample of the record at which it begins.
  bool trusted = false;
  Reliability reliable;
  std::vector<diagnostics::Finding> findings;
  /// What identification was told, where the caller notes it: for later work on the same machine.
  std::vector<GivenOption> options;
};

}  // namespace resonid::identification
