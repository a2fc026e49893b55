// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <span>
#include <vector>

namespace resonid::design {

/// A response at its lines and, where it turns from one to the next, at places between them.
struct FilledLines {
  std::vector<double> frequencies_hz;
  std::vector<std::complex<double>> values;
  std::vector<double> radii;
  std::vector<bool> measured;  ///< False between the lines.
};

/// What a machine does between its lines (docs/methods/tune.md 7.7).
///
/// Where its phase falls, a mode passes: the response goes along the circle through 0 and both lines, which
/// bulges the farther the more the phase falls in between, and without a limit towards half a turn. What the
/// rest of the machine does beside the mode may hide half of that height, so that from 90 to 135 deg on it
/// counts up to twice as high. A delay that is known is taken off; what another one or a lag turns counts
/// as a fall too: nothing tells it from a mode's. Where the phase rises, an anti-resonance passes: a chord.
/// Beyond 120 deg a fall and a rise look the same: it is a peak where |G| per inertia is larger than at the
/// lines around. What noise (`radii`, each line's largest error) may have made of a fall is taken off it.
///
/// A mode that shows at neither line beside it, with its anti-resonance close by, is not seen.
[[nodiscard]] FilledLines between_lines(std::span<const double> frequencies_hz,
                                        std::span<const std::complex<double>> values,
                                        std::span<const double> radii, double known_delay_s);

}  // namespace resonid::design
