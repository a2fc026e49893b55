// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/fit/drive_model.hpp>

namespace resonid::fit {

/// How lines count in a fit to a response.
enum class Weighting {
  none,         ///< Every line alike, in absolute terms.
  deviations,   ///< By the response's own standard deviations: maximum likelihood when the model is
                ///< true.
  model_error,  ///< By std^2 + (e |G|)^2, e just large enough to explain the misfit: a model that is only
                ///< nearly true is not torn towards its best-measured lines.
};

struct ResponseFitConfig {
  Structure structure = Structure::two_mass;
  double sample_time_s = 0.0;  ///< Sample time of the record that the response comes from, > 0.
  double known_delay_s =
      0.0;  ///< What was taken out of the response, >= 0; its fraction of a sample matters.
  bool viscous_friction = false;  ///< Estimate friction on the driven side.
  bool delay = false;  ///< Estimate a delay of -1 ... 50 samples on top of what was taken out already.
  /// More to estimate: kLoadViscousFriction, kTorqueLag, kOutputFilter, kMotorGroundStiffness,
  /// kLoadGroundStiffness. What is
  /// not estimated of these keeps the value of `initial`.
  std::vector<Parameter> further = {};
  Velocity velocity = Velocity::sampled;  ///< As `initial` has it where that is given.
  /// Known time constants of torque loop and output filter, where they are not estimated.
  double torque_lag_s = 0.0, output_filter_s = 0.0;
  Weighting weighting = Weighting::model_error;
  double initial_error = 0.3;  ///< e that Weighting::model_error begins with; less from a start that is near.
  double low_hz = 0.0;         ///< Lines outside the band are not used.
  double high_hz = std::numeric_limits<double>::infinity();
  std::optional<DriveModel> initial;  ///< Start; found by initial_model() when absent.
};

struct ResponseFit {
  DriveModel model;
  bool converged = false;
  double misfit = 0.0;  ///< rms of |error|/std over the lines: near 1 when noise explains the difference.
  double model_error = 0.0;  ///< e of Weighting::model_error, relative.
  double cost = 0.0;         ///< Half the weighted sum of squares.
  double bic = 0.0;  ///< Bayesian information criterion, smaller is better; comparable on the same lines.
  double likelihood = 0.0;  ///< -2 ln of it, all lines taken for independent.
  /// How many neighbouring lines say the same: by smoothing, or since the model is wrong in a smooth way.
  double repetition = 1.0;
  std::size_t lines = 0, parameters = 0;  ///< Fitted lines, estimated parameters.
  std::vector<Lacking> lacking = {};      ///< Score tests of the like, lines taken for independent.

  /// The criterion when so many neighbouring lines are worth one.
  [[nodiscard]] double bic_for(double lines_per_independent_line) const;
};

/// Levenberg-Marquardt fit of the physical drive, sampled by zero-order hold, to a measured response
/// (Nevaranta 2016, Pub. VI, eq. 28 uses the continuous model, which is biased on sampled data).
/// The response is that of the velocity, with its known delay taken out. Needs at least 4 lines (rigid: 2,
/// three masses: 6) in the band, and standard deviations for every weighting but none.
[[nodiscard]] expected<ResponseFit, Error> fit_response(const data::FrequencyResponse& response,
                                                        const ResponseFitConfig& config);

/// Start for a two-mass fit: a scan over anti-resonance, resonance and damping that compares magnitudes only.
/// `with_friction` scans viscous friction too. Rigid: the inertia from the median of |G| w.
[[nodiscard]] DriveModel initial_model(const data::FrequencyResponse& response, Structure structure,
                                       double sample_time_s, bool with_friction = false);

}  // namespace resonid::fit
