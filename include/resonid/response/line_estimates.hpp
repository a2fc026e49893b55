// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>
#include <limits>
#include <optional>
#include <resonid/base/approach.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <vector>

namespace resonid::response {

/// What one method measured at one frequency: the mean phasors of the three signals and how uncertain they
/// are. All three have one scale and one phase reference that only this line needs to share, since nothing
/// but their ratios is used. A signal that is not there is 0.
struct LineEstimate {
  double frequency_hz = 0.0;
  std::complex<double> excitation;  ///< Ru
  std::complex<double> input;       ///< U
  std::complex<double> output;      ///< Y of the recorded quantity, delay included.
  /// E{e e^H} of the errors of (excitation, input, output).
  Eigen::Matrix3cd covariance = Eigen::Matrix3cd::Zero();
  /// Complex degrees of freedom from which the covariance was estimated; infinite when it is known.
  double degrees_of_freedom = std::numeric_limits<double>::infinity();
  /// Between the reference signal (input for direct, else excitation) and the output; not a number when the
  /// method has none, then 1/(1 + (std/|G|)^2) is reported.
  double coherence = std::numeric_limits<double>::quiet_NaN();
};

/// The lines of one record, in ascending frequency. Every method of this stage ends here, and plant, loop and
/// controller all start from here.
struct LineEstimates {
  std::vector<LineEstimate> lines;
  std::vector<double> unsettled_hz;  ///< Lines left out since their tracker had not settled.
  data::OutputQuantity output_quantity = data::OutputQuantity::velocity;
  double sample_time_s = 0.0;
  bool has_excitation = false;
  bool has_input = false;
  data::LineCorrelation correlation;  ///< Correlation of the errors of different lines.
  double smoothing_hz = 0.0;          ///< Width of the smoothing over frequency; 0: none (data::Smoothing).
};

/// How a response is formed and what is known about the loop.
struct ResponseOptions {
  Approach approach = Approach::joint;
  std::optional<data::TransferFunction> controller;  ///< C from velocity error to torque; indirect needs it.
  double delay_s = 0.0;  ///< Known delay Td in the measured output, >= 0: taken out, times exp(+j w Td).
};

/// The plant's response to velocity, known delay removed:
///
///   direct, joint  G = Y/U e^{jwTd}        indirect  Gcl = Y/Ru,  G = Gcl/(1 - C Gcl) e^{jwTd}
///
/// (joint: Y and U were both referred to the excitation, so the ratio is (Y/Ru)/(U/Ru)). Standard deviation
/// by first-order propagation of the covariance. With nu degrees of freedom |error|^2/s^2 follows F(2, 2 nu),
/// whose tail is (1 + x/nu)^-nu; s is widened by sqrt(nu (p^(-1/nu) - 1)/(-ln p)) at p = 0.05, so that the
/// circle std sqrt(-ln p) keeps its 95 % coverage also after few averages. Lines that are not finite are left
/// out. Of smoothed lines w is the sensitivity, U/Ru or 1 - C Gcl (direct: the input's power), its slope
/// taken over seven lines.
[[nodiscard]] expected<data::FrequencyResponse, Error> plant_response(const LineEstimates& lines,
                                                                      const ResponseOptions& options);

/// The loop L = Ru/U - 1 = C Gd, delay included, without knowing controller or plant; the reference must
/// rest. Needs excitation and input.
[[nodiscard]] expected<data::FrequencyResponse, Error> loop_response(const LineEstimates& lines);

/// The controller as it ran, C = (Ru - U)/Y for the recorded output. Needs excitation and input.
[[nodiscard]] expected<data::FrequencyResponse, Error> controller_response(const LineEstimates& lines);

/// Factor that turns the phasor of a recorded output into that of the velocity:
///   position      j (2/Ts) tan(w Ts/2): bilinear; exact for the zero-order-hold response of a rigid inertia
///   (where
///                 j w is wrong by x/tan x, x = w Ts/2), and within that factor for the modes
///   acceleration  Ts/(1 - e^{-jwTs}): the sample a(k) reflects the torque of the interval before it
[[nodiscard]] std::complex<double> velocity_factor(data::OutputQuantity quantity, double frequency_hz,
                                                   double sample_time_s);

/// A response of the recorded quantity as response to velocity.
[[nodiscard]] data::FrequencyResponse to_velocity(data::FrequencyResponse response,
                                                  data::OutputQuantity quantity, double sample_time_s);

}  // namespace resonid::response
