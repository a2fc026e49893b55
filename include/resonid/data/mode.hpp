// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <resonid/data/estimate.hpp>
#include <string_view>

namespace resonid::data {

/// A resonance or anti-resonance as it was estimated.
struct Mode {
  bool anti = false;
  Estimate frequency_hz;  ///< Undamped where a model tells it, else the extremum of the measured response.
  Estimate damping_ratio = {std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::quiet_NaN()};
  bool from_model = true;

  [[nodiscard]] std::string_view name() const noexcept { return anti ? "anti-resonance" : "resonance"; }
};

/// An eigenfrequency of known parameters, undamped, with its share of critical damping (negative: unstable).
struct UndampedMode {
  double frequency_hz = 0.0;
  double damping_ratio = 0.0;
};

}  // namespace resonid::data
