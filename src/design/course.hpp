// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace resonid::design {

/// How many samples it takes until nothing is left, within reason.
[[nodiscard]] std::size_t most_samples(double spectral_radius);

/// What an output does after a constant 1 has set in at rest.
struct Course {
  double absolute = 0.0, sum = 0.0;  ///< Of the samples.
  double highest = 0.0, lowest = 0.0;
};

/// x' = a x + input, y = output x, of that spectral radius, until |y| stays below `settled` of its largest
/// for `quiet` samples and 1, 2, 4, ... samples later. What a slow loop still does after many samples is
/// summed up over strides of them, exactly but for the one in which y changes its sign; extremes there are
/// those at their ends.
[[nodiscard]] Course course_of(const Eigen::MatrixXd& a, const Eigen::VectorXd& input,
                               const Eigen::RowVectorXd& output, double spectral_radius, double settled,
                               std::size_t quiet);

/// Sum over k >= 0 of (output a^k start)^2 of a stable a, by doubling.
[[nodiscard]] double impulse_energy(Eigen::MatrixXd a, const Eigen::VectorXd& start,
                                    const Eigen::RowVectorXd& output);

}  // namespace resonid::design
