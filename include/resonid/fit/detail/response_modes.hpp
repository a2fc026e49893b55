// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <resonid/data/mode.hpp>
#include <vector>

namespace resonid::fit {

/// A resonance or anti-resonance that a measured response shows by itself.
struct ResponseMode {
  data::Mode mode;             ///< Undamped frequency and damping ratio; from_model is false.
  double prominence_db = 0.0;  ///< Height of the fitted extremum over the higher of the valleys beside it.
};

/// Resonances and anti-resonances of a response from torque to velocity without a model of the drive, in
/// ascending frequency: extrema of |G| that noise does not explain, each by a local rational fit
///
///   G = exp(P(ln f))/(j f) prod (1 - (f/fz)^2 + 2 j Dz f/fz) / prod (1 - (f/fp)^2 + 2 j Dp f/fp)
///
/// with a complex polynomial P for everything else, lines weighted by their standard deviations, in windows
/// of several widths (docs/methods/response_modes.md). The widest window that the model holds in gives the
/// values; what narrower ones differ from it beyond noise goes into the standard deviations. Extrema of less
/// than `least_db`, and those beyond the lines, are left out. Empty without standard deviations or with fewer
/// than 8 lines.
[[nodiscard]] std::vector<ResponseMode> response_modes(const data::FrequencyResponse& response,
                                                       double least_db = 3.0);

}  // namespace resonid::fit
