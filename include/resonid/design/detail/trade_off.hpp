// SPDX-License-Identifier: MIT
#pragma once

namespace resonid::design {

/// The largest integral gain on an ellipsoid if the covariance were `factor` times as large, and the delay's
/// variance `delay_factor` times.
struct ExperimentValue {
  double factor = 1.0;
  double ki = 0.0;   ///< Nm/rad; 0: of a structure that is not designed again.
  double iae = 0.0;  ///< That of the nominal machine's load after a load step, rad.
  double delay_factor = 1.0;
};

/// The largest integral gain of one machine under bounds.
struct TradeOff {
  double sensitivity = 0.0, load_transfer = 0.0;
  double kp = 0.0, ki = 0.0;
  double iae = 0.0;  ///< That of the load after a load step, rad.
};

}  // namespace resonid::design
