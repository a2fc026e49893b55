// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <resonid/data/frequency_response.hpp>

namespace resonid::identification::detail {

/// How input and output are to one another, by the lowest frequencies that are known.
enum class Orientation : std::uint8_t {
  unknown,   ///< Too few lines.
  drive,     ///< The velocity does not lead: nothing is wrong.
  mirrored,  ///< It leads by 90 degrees and falls: one of both has the wrong sign.
  inverse,   ///< It leads and grows, at all frequencies: input and output are exchanged.
  grounded,  ///< It leads and grows below a resonance and lags above: a spring to ground.
};

struct OrientationFound {
  Orientation orientation = Orientation::unknown;
  double low_hz = 0.0;   ///< Up to where it is as said.
  double high_hz = 0.0;  ///< grounded: from where on it falls.
};

/// Of a velocity's response with its standard deviations, known delay taken out.
[[nodiscard]] OrientationFound orientation_of(const data::FrequencyResponse& response);

}  // namespace resonid::identification::detail
