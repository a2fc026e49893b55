// SPDX-License-Identifier: MIT
#pragma once

#include <complex>

namespace resonid::diagnostics {

/// Chordal distance of two responses at one frequency, 0 ... 1:
///
///   k(G1, G2) = |G1 - G2| / ( sqrt(1 + |G1|^2) sqrt(1 + |G2|^2) )
///
/// the distance of their images on the Riemann sphere of diameter 1. Its maximum over frequency is
/// Vinnicombe's gap only where the winding-number condition holds, which single lines cannot show. It depends
/// on the unit of G: two plants far below or far above 1 look alike, so scale them (by the controller)
/// before. Finite values only. Source: METHOD 10.1; Nevaranta 2016, Pub. IV, eq. 19 with |G|^2 in place of
/// |G^2|.
[[nodiscard]] double chordal_distance(std::complex<double> first, std::complex<double> second);

}  // namespace resonid::diagnostics
