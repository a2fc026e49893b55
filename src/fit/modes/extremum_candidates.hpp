// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <vector>

namespace resonid::fit {

/// Where |G| has an extremum that a local fit may look into.
struct ExtremumCandidate {
  bool minimum = false;
  double frequency_hz = 0.0;
  double strength = 0.0;  ///< Prominence over its standard deviation.
};

/// Extrema of ln |G|, averaged over several widths, whose prominence noise does not explain; the strongest
/// first. Each is found once, by the narrowest average that shows it. Standard deviations are needed.
[[nodiscard]] std::vector<ExtremumCandidate> extremum_candidates(const data::FrequencyResponse& response);

/// Height of the peak at `i` over the higher of the two valleys that part it from higher ground or the end.
[[nodiscard]] double prominence(const std::vector<double>& level, std::size_t i);

}  // namespace resonid::fit
