// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <span>

namespace resonid::response {

struct SideNoise {
  /// Of (excitation, input, output), scaled such that white noise of variance s^2 gives s^2 on the diagonal.
  Eigen::Matrix3cd density = Eigen::Matrix3cd::Zero();
  double averages = 0.0;  ///< How many independent values went in.
};

/// A line's phase at each sample (a sweep's, or 2 pi f t).
struct Carrier {
  std::span<const double> cosine, sine;
};

/// Spectral density of residuals [sample, signal] beside a line, where the estimate of the line has not taken
/// it up: at four offsets of `nearest_hz` ... `farthest_hz` on either side, as far as they lie between 0 and
/// half the sample rate. `frequency_hz` is the line's mean frequency. When no offset fits, the whole residual
/// counts as white.
[[nodiscard]] SideNoise noise_beside(const Carrier& line, double sample_time_s, double frequency_hz,
                                     const Eigen::MatrixX3d& residual, const Eigen::VectorXd& weights,
                                     double nearest_hz, double farthest_hz);

}  // namespace resonid::response
