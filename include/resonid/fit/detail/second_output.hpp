// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <resonid/base/expected.hpp>
#include <resonid/data/estimate.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/fit/drive_model.hpp>
#include <span>
#include <vector>

namespace resonid::fit {

/// Torque to the velocity of the load (the last mass; of a rigid drive the only one) as a second output of
/// that kind shows it: data::load_velocity_factor() times the zero-order-hold response of what it measures,
/// fitted delay included, known delay taken out; without the output filter, which is the driven side's.
[[nodiscard]] std::vector<std::complex<double>> load_values(const DriveModel& model, data::SecondOutput kind,
                                                            std::span<const double> frequencies_hz);

struct SecondOutputConfig {
  data::SecondOutput kind = data::SecondOutput::load_encoder;  ///< Not none.
  /// Estimate a factor of the second output, and a delay of it on top of the output's; otherwise 1 and 0.
  bool gain = false, delay = false;
};

/// A drive model of both outputs.
struct SecondOutputFit {
  DriveModel model;
  bool converged = false;
  data::Estimate gain{1.0, 0.0};     ///< Measured over expected.
  data::Estimate delay_s{0.0, 0.0};  ///< By which the second output is later than the output.
  double model_error = 0.0;          ///< As ResponseFit::model_error, over the second output's lines.
  /// How far the parameters went from what the output alone says, over the part of its covariance that the
  /// second output takes away: chi-square of `directions` degrees of freedom when both are of one drive.
  double contradiction = 0.0;
  std::size_t directions = 0;  ///< How many combinations of parameters the second output tells something of.
};

/// Fits the model of the output to a second one too (docs/methods/second_output.md): the least of
///
///   (x - x1)' P1^-1 (x - x1) + sum over the lines of |G2 - g e^{-jwd} G2(x)|^2/(std^2 + (e |G2|)^2)
///
/// over the estimated parameters x of `first`, x1 and P1 being what the output says of them. The noises of
/// the two outputs are taken for independent. Covariance by the Jacobian of both parts. `second` is the
/// response of the load's velocity by load_velocity_factor(), known delay taken out. Errors: a response
/// without standard deviations or with fewer than 4 lines; a model without covariance.
[[nodiscard]] expected<SecondOutputFit, Error> fit_second_output(const DriveModel& first,
                                                                 const data::FrequencyResponse& second,
                                                                 const SecondOutputConfig& config);

}  // namespace resonid::fit
