// SPDX-License-Identifier: MIT
#include "design/pid.hpp"

#include <cmath>

#include "design/structure_search.hpp"

namespace resonid::design {

data::TransferFunction Pid::transfer_function(double sample_time_s) const {
  const double p = filter_s > 0.0 ? std::exp(-sample_time_s / filter_s) : 0.0;
  const double d = kd * (1.0 - p) / sample_time_s, i = ki * sample_time_s;
  return {{kp + i + d, -kp * (1.0 + p) - i * p - 2.0 * d, kp * p + d}, {1.0, -1.0 - p, p}, sample_time_s};
}

std::optional<PidDesign> search_pid(Machines& machines, const Bounds& bounds,
                                    const GlobalSearch::Effort& effort) {
  const auto pi = largest_integral_gain(machines, {}, bounds);
  if (!pi || !(pi->kp > 0.0 && pi->ki > 0.0)) return std::nullopt;
  const double step = machines.all.front().sample_time_s();
  const auto pid_of = [](const GlobalSearch::Point& x) {
    return Pid{std::exp(x[0]), std::exp(x[1]), std::exp(x[2]), std::exp(x[3])};
  };
  const MakeController make = [&](const GlobalSearch::Point& x) -> std::optional<LinearController> {
    return LinearController(pid_of(x).transfer_function(step));
  };
  const double kp = std::log(pi->kp), ki = std::log(pi->ki), derivative = kp + std::log(step);
  // From a derivative that does next to nothing to one of thirty samples, its lag up to as long.
  const std::vector<GlobalSearch::Range> ranges = {{kp - 1.5, kp + 2.0},
                                                   {ki - 1.5, ki + 2.5},
                                                   {derivative - 4.0, derivative + 3.4},
                                                   {std::log(0.3 * step), std::log(30.0 * step)}};
  const auto found = search_structure(machines, bounds, make, ranges, effort,
                                      {{kp, ki, derivative - 2.0, std::log(3.0 * step)}});
  if (!found) return std::nullopt;
  return PidDesign{pid_of(found->point), found->iae, found->exceeded};
}

}  // namespace resonid::design
