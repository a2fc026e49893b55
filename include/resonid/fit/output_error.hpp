// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/fit/detail/noise_model.hpp>
#include <resonid/fit/detail/predictor.hpp>
#include <resonid/fit/drive_model.hpp>
#include <span>
#include <utility>
#include <vector>

namespace resonid::fit {

/// Dry friction beside Coulomb's on the driven side, each where it is given or found. Another size in the
/// negative direction is none of it: no record tells it from the mean of both and a constant torque.
struct FurtherFriction {
  std::optional<data::Estimate> load_coulomb;  ///< On the load.
  std::optional<data::Estimate> breakaway;     ///< Torque that it takes to start the driven side.
  /// Velocity over which that falls to Coulomb's, as exp(-(v/vs)^2) (Stribeck).
  std::optional<data::Estimate> stribeck_velocity;

  [[nodiscard]] bool any() const noexcept { return load_coulomb || breakaway || stribeck_velocity; }
};

struct OutputErrorConfig {
  DriveModel initial;             ///< Structure and start; a fit to the response is a good one.
  bool viscous_friction = false;  ///< Estimate friction on the driven side.
  bool coulomb_friction =
      false;  ///< Estimate dry friction there, with the direction of the simulated motion.
  /// Dry friction of a start that is near: its course is the start's own, else that of the measured velocity.
  std::optional<double> coulomb_start;
  /// More of dry friction to estimate, each from the value given, which must be near (LackingFriction); with
  /// `coulomb_friction` left out it may be the load's alone.
  FurtherFriction further_friction = {};
  bool score_friction = true;  ///< Fill lacking_friction, which takes as long as some steps of the fit.
  bool delay = false;          ///< Estimate a delay of -1 ... 50 samples on top of the known one.
  /// More to estimate: kLoadViscousFriction, kTorqueLag, kOutputFilter, kMotorGroundStiffness,
  /// kLoadGroundStiffness. What is
  /// not estimated of these keeps the value of `initial`.
  std::vector<Parameter> further = {};
  double known_delay_s = 0.0;  ///< In the measured output, >= 0.
  bool initial_state = true;   ///< Estimate the state at the record's start; otherwise it is rest.
  bool offset = true;  ///< Estimate a constant torque at the input (load, friction at an operating point).
  bool noise_model = true;  ///< Weight by an autoregressive model of the residual (order 0 if it is white).
  std::size_t max_noise_order = kHighestNoiseOrder;
  /// [record] Noise models (OutputErrorFit::noise of a fit that is near) to begin with, not with those of the
  /// start's residual; empty: none.
  std::vector<NoiseModel> noise_start;
  /// [from, to) of samples whose output is not used: a validation part. The simulation runs through them.
  std::vector<std::pair<std::size_t, std::size_t>> holdout;
  /// [record] Dry friction that is known, as OutputErrorFit::friction_torque: nothing of it is estimated.
  std::vector<std::vector<double>> friction_torque;
  std::vector<std::vector<double>> load_friction_torque;  ///< [record] The same of the load.
  bool fixed_model =
      false;             ///< Estimate initial state and offset only: simulate a given model on the record.
  bool at_load = false;  ///< The output is the motion of the load; without dry friction.
  bool disturbances = false;  ///< With `fixed_model`: test for torques that a linear machine does not have.
  bool consistency = true;    ///< Several records: fit each alone too, and test whether they agree.
  Predictor predictor = Predictor::open_loop;
  std::optional<data::TransferFunction> controller;  ///< From velocity error to torque; closed_loop needs it.
  /// Covariance of the controller's [b0, b1, ..., a1, a2, ...], which goes into the model's to first order;
  /// empty: exact.
  Eigen::MatrixXd controller_covariance;
};

/// What the hold-out samples say of a fit to the others.
struct HoldoutFit {
  std::size_t samples = 0;
  double fit_percent = 0.0;  ///< Fit of the simulation there.
  double score = 0.0;        ///< N ln(mean square) of what the noise model leaves there, smaller is better.
};

/// Whether a parameter comes out the same from every part of the record, at the common estimate of the
/// others.
struct Constancy {
  int parameter = 0;            ///< Parameter of the model.
  bool over_frequency = false;  ///< Parts are bands of the whitened spectrum, not stretches of time.
  double probability = 1.0;     ///< Chance of as much scatter where it is the same throughout.
  double scatter = 0.0;         ///< Standard deviation between eighths of the information, beyond chance.
};

/// A torque that no linear machine has, as it would be seen beside the model.
enum class BendingTorque {
  stiffening,    ///< With the cube of a coupling's twist.
  backlash,      ///< Even, with the sign of the twist.
  dry_friction,  ///< Against the driven side; `load_dry_friction` against the load.
  load_dry_friction,
  stribeck_friction,       ///< More of it where the driven side hardly moves.
  load_stribeck_friction,  ///< The same of the load.
  stiffness_drift,         ///< With a coupling's twist and the time.
  inertia_drift,           ///< With the driven side's acceleration and the time.
  load_inertia_drift,      ///< The same of the load.
  torque_gain              ///< With the square of the torque, signed: a gain that depends on its size.
};

/// Lagrange multiplier test of such a torque, and what it would do to the estimates.
struct Bending {
  BendingTorque torque = BendingTorque::dry_friction;
  int coupling = 0;  ///< Place of a coupling, from the driven side on.
  /// To first order. Friction: its torque. Backlash: the play in all; < 0: yielding. Stiffening: part of the
  /// stiffness, at a twist of its standard deviation. Drift: part of the value, from the record's start to
  /// its end.
  double amplitude = 0.0;
  double deviations = 0.0;                          ///< Amplitude over its standard deviation.
  double share = 0.0;                               ///< Part of the whitened residual's power.
  ParameterVector shift = ParameterVector::Zero();  ///< Move of the parameters with it estimated along.
};

/// More of dry friction that the fit leaves out, and what estimating it would gain (score test, as Lacking).
struct LackingFriction {
  double gain = 0.0;
  double coulomb_start = 0.0;  ///< OutputErrorConfig::coulomb_start
  FurtherFriction start;       ///< With what is estimated already; values to begin a fit from.
};

struct OutputErrorFit {
  DriveModel model;
  bool converged = false;
  std::size_t samples = 0;  ///< Residuals used.
  std::optional<data::Estimate>
      offset;  ///< Torque added to the input; an integrating controller in the loop hides it.
  std::optional<data::Estimate> coulomb_friction;
  FurtherFriction further_friction;          ///< What was asked for.
  std::vector<double> friction_torque;       ///< [4 sample + quarter of it] Of dry friction; empty without.
  std::vector<double> load_friction_torque;  ///< The same on the load.
  bool one_direction =
      false;  ///< The motion never reverses: dry friction, if asked for, is part of the offset.
  std::vector<double> residual;  ///< [sample] output minus simulated output, from first_sample on.
  std::size_t first_sample = 0;
  double fit_percent = 0.0;  ///< 100 (1 - |y - yh| / |y - mean y|), of the simulation, not one step ahead.
  NoiseModel noise;          ///< Model of the residual.
  std::optional<HoldoutFit> holdout;
  std::vector<Constancy> constancy;  ///< [estimated parameter] Empty with hold-out samples or a given model.
  std::vector<Lacking> lacking;      ///< Score tests of what the structure may have beside; as `constancy`.
  std::vector<Bending> bending;      ///< Where asked for.
  double bic = 0.0;                  ///< Bayesian information criterion; comparable on the same record.
};

/// Maximum-likelihood fit of the sampled physical drive to the record itself: the output simulated from the
/// input (Ljung 1999, ch. 7). With white output noise it reaches the Cramer-Rao bound, in closed loop too;
/// coloured noise is whitened by an autoregressive model found from the residual. Initial state and load
/// torque are estimated with it, so an operating point does no harm. Errors: fewer than 50 samples, a start
/// that is not finite and positive, a known delay of more than a quarter of the record or, with the start's,
/// half of it, dry friction from an acceleration, a closed loop without its controller or of anything but
/// velocity.
[[nodiscard]] expected<OutputErrorFit, Error> fit_output_error(const data::Record& record,
                                                               const OutputErrorConfig& config);

/// Two-mass starts for fit_output_error from the record alone, best first, at most three: anti-resonance,
/// resonance and damping are scanned, and what enters linearly (inertia, load torque, state at the start) is
/// solved on at most 3000 samples. For records too short for a response; velocity only, else none.
[[nodiscard]] std::vector<DriveModel> initial_models(const data::Record& record, double known_delay_s);

/// Whether records agree on the parameters: the squared distances of their own fits to the common one, each
/// in its own covariance, are chi-square distributed when they do.
struct Consistency {
  double chi_square = 0.0;
  int degrees = 0;  ///< Degrees of freedom; of all records: (records - 1) times estimated parameters.
  double probability = 1.0;  ///< Probability of so large a value among records of one drive.
};

struct JointOutputErrorFit {
  DriveModel model;
  bool converged = false;
  std::optional<data::Estimate> coulomb_friction;
  FurtherFriction further_friction;
  std::vector<LackingFriction> lacking_friction;  ///< Where there is dry friction, and no hold-out samples.
  std::vector<OutputErrorFit> records;  ///< [record] The common model, with each one's offset and residual.
  std::vector<DriveModel> own;  ///< [record] What each says alone; empty if not asked for or one cannot be
                                ///< fitted.
  std::optional<Consistency> consistency;  ///< With all of `own`.
  /// [record] Each against all others, to first order about the common model (score test): right for records
  /// that say little alone too. Degrees are the directions in which it holds 0.1 ... 99.9 % of the
  /// information, 0 where it says nothing. Empty for a single record, a given model, and parameters that are
  /// not determined.
  std::vector<Consistency> against_others;
  double bic = 0.0;
};

/// One drive from several records: one likelihood over all of them, with each one's own initial state, offset
/// and noise. Lengths may differ; sample rates and output quantities must be equal. Errors: as above, and
/// records that differ in these.
[[nodiscard]] expected<JointOutputErrorFit, Error> fit_output_error(std::span<const data::Record> records,
                                                                    const OutputErrorConfig& config);

}  // namespace resonid::fit
