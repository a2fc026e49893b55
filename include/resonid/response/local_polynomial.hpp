// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/response/line_estimates.hpp>

namespace resonid::response {

struct LocalPolynomialConfig {
  std::size_t half_width_bins =
      0;           ///< n: bins on either side that a fit uses; 0 chooses by cross-validation.
  int degree = 2;  ///< Degree of response and transient polynomials, 0 ... 6.
  std::vector<double> frequencies_hz;  ///< Grid, need not fall on bins; empty: at most 400 bins of the band.
  double band_low_hz = 0.0;            ///< Lowest frequency of the automatic grid; both 0: the excited band.
  double band_high_hz = 0.0;           ///< Highest one.
};

/// Lines by the local polynomial method on one transform of the whole record (Schoukens et al.
/// 2009; Pintelon and Schoukens 2012, ch. 7). Around each frequency, over the bins k within
/// n of it,
///
///   X(k) = G_x(k) R(k) + T_x(k),   G_x, T_x: polynomials in frequency,   X in {U, Y},  R: Ru (U when direct)
///
/// by least squares: the transient T takes leakage out, the value of G_x in the centre is the estimate. At
/// the ends of the spectrum the window is one-sided. Covariance from the residuals, q - 2 (degree + 1)
/// degrees of freedom. At an end of the excited band the window grows on the other side by what it has of
/// unexcited bins. Automatic n: the widest of a geometric series whose leave-one-out error of Y - G U at the
/// centre bins, summed over the grid relative to the noise there, is within 1 % of the least. Limits: the
/// excitation must be dense (chirp, PRBS, noise; not a sparse multisine); n bins must be narrower than a
/// resonance is broad.
[[nodiscard]] expected<LineEstimates, Error> local_polynomial_lines(const data::Record& record,
                                                                    const LocalPolynomialConfig& config,
                                                                    Approach approach);

/// plant_response of local_polynomial_lines.
[[nodiscard]] expected<data::FrequencyResponse, Error> local_polynomial(const data::Record& record,
                                                                        const LocalPolynomialConfig& config,
                                                                        const ResponseOptions& options);

}  // namespace resonid::response
