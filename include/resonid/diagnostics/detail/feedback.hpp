// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <vector>

namespace resonid::diagnostics {

/// What a record of input and output alone says of feedback: of noise in the output that a controller returns
/// through the input. Both are described by one autoregression of order p,
///
///   y(k) = sum_{i=1}^p a_i y(k-i) + b_i u(k-i) + e(k),   u(k) = sum_{i=1}^p c_i u(k-i) + sum_{i=0}^p d_i
///   y(k-i) + w(k),
///
/// whose first line is right in closed loop too, e being new at sample k (Ljung 1999, 13.4; Forssell and
/// Ljung 1999).
struct Feedback {
  /// Probability of so much of e in u(k) ... u(k+20) by chance, e and u being independent without feedback
  /// (Sims 1972):
  /// the rate of false alarms of whoever calls smaller values feedback. Of u(k) only the part that opposes
  /// the output counts, since a measured input may look ahead of the hold.
  double probability = 1.0;
  double seen = 0.0;     ///< Share of e's variance that the later input explains, 0 ... 1.
  double samples = 0.0;  ///< Equations that it was estimated from.
  double sample_time_s = 0.0;
  std::vector<double> a, b, c, d;  ///< a, b, c from lag 1, d from lag 0.
  double output_variance = 0.0;    ///< Variance of e.
  double input_variance = 0.0;     ///< Variance of w.

  /// Feedback beyond a false alarm in 10 000, and of more than 1 % of e's variance.
  [[nodiscard]] bool present() const noexcept { return probability < 1e-4 && seen > 0.01; }
  /// G from the first line, known delays included.
  [[nodiscard]] std::complex<double> response(double frequency_hz) const;
  /// (Gd - G)/G: Gd is what averaged spectra of u and y tend to under this feedback, (G S_w - S_e / C)/(S_w +
  /// S_e) of the input's parts by w and by e.
  [[nodiscard]] std::complex<double> direct_bias(double frequency_hz) const;
  /// Share of the input's power that is e returned by the controller, the rest being w: of u = (A w + D
  /// e)/det with A and D from a and d, S_e |D|^2/(S_w |A|^2 + S_e |D|^2). 0 ... 1.
  [[nodiscard]] double noise_share(double frequency_hz) const;
};

/// Feedback in at most the first 100 000 samples, p = 40 plus the known delay. For records without noise (e
/// below 1e-6 of the output) the probability is 1: nothing is fed back. Errors: fewer than ten samples per
/// coefficient (1050 without delay), samples that are not finite, an input or output that does not move.
[[nodiscard]] expected<Feedback, Error> find_feedback(const data::Record& record, double known_delay_s);

}  // namespace resonid::diagnostics
