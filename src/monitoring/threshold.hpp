// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/base/expected.hpp>
#include <span>

namespace resonid::monitoring {

// The threshold of an installation is a mean time between its false alarms. Each detector (one figure of one
// axis) gets that time multiplied by the number of detectors: then rates of false alarms add up to what was
// asked for. That holds for dependent detectors, too (union bound): figures of one machine that alarm
// together make as many alarms as stated, on fewer occasions.
//
// A detector's threshold is set when it learns. Axes that come or go while others run leave those as they
// are: with more axes the installation has more false alarms than stated, with fewer axes fewer, until the
// others learn anew. installation_interval_s() says what it is meanwhile.

/// Detectors with the same threshold: those of an axis, mostly.
struct Detectors {
  std::size_t count = 0;
  double false_alarm_interval_s = 0.0;  ///< Of each, > 0, as it learned with.
};

/// The mean time between false alarms that each of `detectors` (>= 1) must have, so that all together have
/// `installation_s` (> 0).
[[nodiscard]] expected<double, Error> detector_interval_s(double installation_s,
                                                          std::size_t detectors) noexcept;

/// The mean time between false alarms of all of them together, at least:  1 / sum(count/interval). Infinite
/// without any.
[[nodiscard]] double installation_interval_s(std::span<const Detectors> detectors) noexcept;

}  // namespace resonid::monitoring
