// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <vector>

namespace resonid::diagnostics {

/// A local extremum of |G|.
struct ResponseExtremum {
  double frequency_hz =
      0.0;               ///< Vertex of the parabola through the line and its neighbours, in dB over log f.
  bool minimum = false;  ///< Anti-resonance; otherwise resonance.
  double prominence_db = 0.0;
};

/// Resonances and anti-resonances where only a response is known: the extrema of |G| that stand out by at
/// least `least_db` and by three times the uncertainty of their line. In ascending frequency.
[[nodiscard]] std::vector<ResponseExtremum> response_extrema(const data::FrequencyResponse& response,
                                                             double least_db = 3.0);

}  // namespace resonid::diagnostics
