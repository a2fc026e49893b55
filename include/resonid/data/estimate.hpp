// SPDX-License-Identifier: MIT
#pragma once

namespace resonid::data {

/// A value with its standard deviation; not a number where either is not known.
struct Estimate {
  double value = 0.0;
  double std = 0.0;
};

}  // namespace resonid::data
