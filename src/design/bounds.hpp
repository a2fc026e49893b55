// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

namespace resonid::design {

/// Upper bounds on maxima over frequency (docs/methods/tune.md 1); what is absent is free.
struct Bounds {
  std::optional<double> sensitivity;             ///< |S| = |1/(1 + C Gd)|: the inverse of the modulus margin.
  std::optional<double> complementary;           ///< |T| = |C Gd S|
  std::optional<double> load_transfer;           ///< |C GL S|, from the reference to the load's velocity.
  std::optional<double> controller_sensitivity;  ///< |C S|, Nm/(rad/s)
  std::optional<double> disk;                    ///< |S - T|: 2/alpha of a symmetric disk margin.
};

}  // namespace resonid::design
