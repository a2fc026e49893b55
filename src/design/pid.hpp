// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/transfer_function.hpp>
#include <resonid/design/detail/bounds.hpp>

#include "design/global_search.hpp"
#include "design/largest_gain.hpp"

// PID with a filtered derivative, for the least integrated error of the load (docs/methods/tune.md 6.5).
namespace resonid::design {

/// C = kp + ki Ts z/(z-1) + kd (1-p)/Ts (z-1)/(z-p), p = exp(-Ts/filter_s).
struct Pid {
  double kp = 0.0;        ///< Nm/(rad/s)
  double ki = 0.0;        ///< Nm/rad
  double kd = 0.0;        ///< Nm/(rad/s2)
  double filter_s = 0.0;  ///< Time constant of the derivative's lag, s.

  [[nodiscard]] data::TransferFunction transfer_function(double sample_time_s) const;
};

struct PidDesign {
  Pid controller;
  double iae = 0.0;  ///< Of the load after a load step, the mean over the machines, rad.
};
/// By kd/kp and the lag, with the largest ki of the exact rows inside, as biquads are searched; at least one
/// bound must limit |CS|, or the derivative has no end. Nothing where no gain meets the bounds. `start`: what
/// suited other machines, from which alone is gone on.
[[nodiscard]] std::optional<PidDesign> search_pid(Machines& machines, const Bounds& bounds,
                                                  const GlobalSearch::Effort& effort = {16, 10, 1},
                                                  const std::optional<Pid>& start = {});

}  // namespace resonid::design
