// SPDX-License-Identifier: MIT
#pragma once

namespace resonid::fit {

/// A value with its standard deviation.
struct Estimate {
  double value = 0.0;
  double standard_deviation = 0.0;
};

}  // namespace resonid::fit
