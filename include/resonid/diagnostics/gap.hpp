// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <functional>
#include <resonid/base/expected.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/fit/drive_model.hpp>
#include <vector>

namespace resonid::diagnostics {

/// Chordal distance of two responses at one frequency, 0 ... 1:
///
///   k(G1, G2) = |G1 - G2| / ( sqrt(1 + |G1|^2) sqrt(1 + |G2|^2) )
///
/// the distance of their images on the Riemann sphere of diameter 1. Its maximum over frequency is
/// Vinnicombe's gap only where the winding-number condition holds, which single lines cannot show. It depends
/// on the unit of G: two plants far below or far above 1 look alike, so scale them (by the controller)
/// before. Finite values only. Source: Vinnicombe 1993; Nevaranta 2016, Pub. IV, eq. 19 with |G|^2 in place
/// of |G^2|.
[[nodiscard]] double chordal_distance(std::complex<double> first, std::complex<double> second);

/// The same of values with independent circular errors of total standard deviation `first_std`, `second_std`,
/// to first order: the standard deviation holds where the distance is well above what noise alone makes.
[[nodiscard]] data::Estimate chordal_distance(std::complex<double> first, double first_std,
                                              std::complex<double> second, double second_std);

/// W_out W_in of a single-input single-output plant at a frequency; the controller makes L = C G of it.
using Weight = std::function<std::complex<double>(double frequency_hz)>;

/// Pointwise distances of two measured responses over the band that both know. No gap: lines cannot tell the
/// winding number.
struct GapCurve {
  std::vector<double> frequency_hz;  ///< [line]: the lines of the response that has fewer there
  std::vector<double> distance;      ///< [line], 0 ... 1
  std::vector<double> std;           ///< [line], first order; empty when a response has none
  std::vector<double> noise;  ///< [line], rms distance that noise alone makes of equal plants; empty likewise

  /// The line with the largest distance; 0 when there is none.
  [[nodiscard]] std::size_t largest() const;
  /// Distance over what noise alone makes there, in rms. Standard deviations that were measured from few
  /// periods are uncertain themselves: a line's noise counts as no less than the median of 9 lines around it.
  [[nodiscard]] double excess(std::size_t line) const;
  /// The line with the largest excess.
  [[nodiscard]] std::size_t most_excessive() const;
  /// Probability that equal plants show so large an excess at any line by noise alone (Sidak); 1 without
  /// standard deviations. Lines that share noise make it larger than it is.
  [[nodiscard]] double chance() const;
};
/// The denser response is interpolated (linear in real and imaginary part) at the lines of the other.
[[nodiscard]] GapCurve gap_curve(const data::FrequencyResponse& first, const data::FrequencyResponse& second,
                                 const Weight& weight = {});

/// Vinnicombe's gap of two models.
struct NuGap {
  double gap = 1.0;               ///< `largest_distance`, or 1 where the winding-number condition fails.
  double largest_distance = 1.0;  ///< Over all frequencies.
  double frequency_hz = 0.0;      ///< Where that is.
  bool condition_holds = false;   ///< Winding-number condition.
};

/// v-gap of two discrete plants G = b/a, 0 ... 1: what one controller can hide of their difference. A loop
/// with stability margin b(G1, C) > v-gap stays stable when G2 takes the place of G1.
///
///   gap = max k(G1, G2)   if wno(1 + G2~ G1) + eta(G1) - eta0(G2) = 0 and 1 + G2~ G1 has no zero there
///         1               otherwise
///
/// with the contour indented around poles on the unit circle. It is evaluated without poles: the condition is
/// the same as wno F = 0 for F = b2* b1 + a2* a1 on the unit circle, a and b in powers of z^-1, because the
/// factors that turn F into the normalised coprime form N2* N1 + M2* M1 do not wind. F is finite where G has
/// a pole, so integrators need no indentation. Numerator and denominator must have no common factor outside
/// the unit circle. Errors: different sample times, a denominator that is empty or begins with 0. Source:
/// Vinnicombe 2001.
[[nodiscard]] expected<NuGap, Error> nu_gap(const data::TransferFunction& first,
                                            const data::TransferFunction& second);

/// W G as one transfer function.
[[nodiscard]] data::TransferFunction weighted(const data::TransferFunction& weight,
                                              const data::TransferFunction& plant);

}  // namespace resonid::diagnostics
