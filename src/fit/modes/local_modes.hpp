// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <resonid/data/frequency_response.hpp>
#include <vector>

namespace resonid::fit {

/// A pair of poles or zeros, 1 - (f/f0)^2 + 2 j D f/f0.
struct LocalRoot {
  bool zero = false;
  double frequency_hz = 0.0;
  double damping_ratio = 0.0;
};

/// The lines of a window, [line] each, and what is known of the response there.
struct LocalLines {
  std::vector<std::size_t> line;             ///< Of the response, ascending.
  double centre_hz = 0.0, half_width = 0.0;  ///< Of ln f.
  std::vector<LocalRoot> known;              ///< Roots that are not fitted, in or beside the window.
};

struct LocalFit {
  std::vector<LocalRoot> roots;
  Eigen::MatrixXd covariance;   ///< Of (ln f0, D) of every root in turn; correlated lines counted as such.
  double chi_square = 0.0;      ///< Sum of |error|^2/std^2.
  double degrees = 0.0;         ///< Complex ones: expected of it.
  Eigen::VectorXcd background;  ///< Of the polynomial ln B over (ln f - ln centre)/half width.
  bool usable = false;
};

/// Least squares (Levenberg-Marquardt) over (f0, D) of the roots and the coefficients of ln B, beginning at
/// `roots` and `background`, or with the best constant with a slope of the phase.
[[nodiscard]] LocalFit fit_local(const data::FrequencyResponse& response, const LocalLines& lines,
                                 std::vector<LocalRoot> roots, int degree,
                                 const Eigen::VectorXcd& background = {});

/// |G| of a fit at a frequency within its window, smoothing left out.
[[nodiscard]] double magnitude(const LocalFit& fit, const LocalLines& lines, double frequency_hz);

}  // namespace resonid::fit
