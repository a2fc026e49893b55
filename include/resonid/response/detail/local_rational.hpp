// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/response/line_estimates.hpp>

namespace resonid::response {

struct LocalRationalConfig {
  std::size_t half_width_bins =
      0;                     ///< n: bins on either side that a fit uses; 0 chooses by cross-validation.
  int degree = 2;            ///< Degree of numerator and denominator, 1 ... 4.
  int transient_degree = 3;  ///< Degree of the transient's numerator, 0 ... 6.
  std::vector<double> frequencies_hz;  ///< Grid, need not fall on bins; empty: at most 400 bins of the band.
  double band_low_hz = 0.0;            ///< Lowest frequency of the automatic grid; both 0: the excited band.
  double band_high_hz = 0.0;           ///< Highest one.
};

/// Lines by the local rational method on one transform of the whole record (McKelvey and Guerin 2012;
/// Voorhoeve, van der Maas and Oomen 2018). Around each frequency, over the bins
/// k within n of it,
///
///   A(k) X(k) = B(k) R(k) + T(k),   A, B, T: polynomials in frequency, A = 1 in the centre
///
/// where a pole and a zero may lie in the window: it may be far wider than a local polynomial's. Solved by
/// refined instrumental variables: rows weighted by 1/A of the round before, instruments R and (B R + T)/A,
/// so that noise in X biases nothing. Joint: first U from Ru, then Y from U, whose noise-free part is the
/// instrument. Indirect: Y (and U) from Ru. Direct: Y from U.
/// Covariance from the residuals (A X - B R - T)/A, degrees of freedom: bins less parameters. Where a fit
/// does not come out, the line is left out. Automatic n: the widest of a geometric series whose leave-one-out
/// error, mean of the logarithm over up to 150 centres, is within 3 % of the least; at most a quarter of the
/// excited band. Limits: dense excitation; the denominator needs a signal well above the noise in the window,
/// else a local polynomial has less variance; one resonance and one anti-resonance per window (degree 2).
[[nodiscard]] expected<LineEstimates, Error> local_rational_lines(const data::Record& record,
                                                                  const LocalRationalConfig& config,
                                                                  Approach approach);

/// plant_response of local_rational_lines.
[[nodiscard]] expected<data::FrequencyResponse, Error> local_rational(const data::Record& record,
                                                                      const LocalRationalConfig& config,
                                                                      const ResponseOptions& options);

}  // namespace resonid::response
