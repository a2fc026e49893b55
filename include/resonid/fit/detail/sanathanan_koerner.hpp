// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/mode.hpp>
#include <resonid/data/transfer_function.hpp>

namespace resonid::fit {

struct SanathananKoernerConfig {
  int order = 3;               ///< Order of A and B, 1 ... 20.
  bool direct_term = false;    ///< Estimate b0 too; a sampled drive has none.
  bool integrator = false;     ///< Fix one pole at z = 1 (a free drive); it counts in the order.
  int iterations = 12;         ///< 1 is Levy's method.
  double sample_time_s = 0.0;  ///< > 0.
};

struct RationalFit {
  data::TransferFunction transfer_function;
  Eigen::MatrixXd covariance;  ///< Covariance of [b..., a...] as estimated, a fixed integrator divided out.
  double misfit = 0.0;         ///< rms of |error|/std, or of |error| without standard deviations.
  bool stable = false;         ///< No pole outside the unit circle.
};

/// Rational discrete model `B/A` of a response by Sanathanan-Koerner iteration: the linear problem A G - B =
/// 0, weighted by 1/|A| of the step before and by the standard deviations if there are any (Levy 1959;
/// Sanathanan and Koerner 1963; Nevaranta 2016, eq. 3.19 with its second row mended). A fixed point is near
/// the least-squares fit, not on it. Needs at least as many lines as parameters.
[[nodiscard]] expected<RationalFit, Error> fit_sanathanan_koerner(const data::FrequencyResponse& response,
                                                                  const SanathananKoernerConfig& config);

/// Oscillating poles of a discrete model: z = exp(s Ts). In ascending frequency.
[[nodiscard]] std::vector<data::UndampedMode> pole_modes(const data::TransferFunction& g);
/// The same for zeros; meaningful well below the Nyquist frequency only.
[[nodiscard]] std::vector<data::UndampedMode> zero_modes(const data::TransferFunction& g);

}  // namespace resonid::fit
