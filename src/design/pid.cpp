// SPDX-License-Identifier: MIT
#include "design/pid.hpp"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "design/closed_loop.hpp"
#include "design/figures.hpp"
#include "design/filter_search.hpp"

namespace resonid::design {
namespace {

/// Natural logarithms of kd/kp and of the lag.
using PidPoint = GlobalSearch::Point;

class PidSearch {
 public:
  PidSearch(Machines& machines, const Bounds& bounds)
      : machines_(machines), coarse_(machines.all, kCoarse), bounds_(bounds) {}

  std::optional<PidDesign> run(const GlobalSearch::Effort& effort, const std::optional<Pid>& start) {
    const double step = machines_.all.front().sample_time_s();
    const auto range = [step](double low, double high) {
      return GlobalSearch::Range{std::log(low * step), std::log(high * step)};
    };
    // From a derivative that does next to nothing to one of a hundred samples.
    GlobalSearch search(
        {range(0.02, 100.0), range(0.2, 100.0)}, [this](const PidPoint& x) { return cost(x); }, effort);
    if (start && start->kp > 0.0 && start->kd > 0.0 && start->filter_s > 0.0)
      return polished(search,
                      search.descend({std::log(start->kd / start->kp), std::log(start->filter_s)}, 0.2));
    return polished(search, search.run({{std::log(0.3 * step), std::log(3.0 * step)},
                                        {std::log(3.0 * step), std::log(3.0 * step)},
                                        {std::log(0.3 * step), std::log(0.3 * step)}}));
  }

 private:
  static PidShape shape_of(const PidPoint& x) { return {std::exp(x[0]), std::exp(x[1])}; }
  static Pid pid_of(const LargestGain& gains, const PidShape& shape) {
    return {gains.kp, gains.ki, gains.kp * shape.time_s, shape.filter_s};
  }

  /// The exact gains add the lines between which a bound was exceeded; then the search goes on with them.
  std::optional<PidDesign> polished(const GlobalSearch& search, PidPoint from) {
    std::optional<PidDesign> best;
    on_all_lines_ = true;
    for (const double size : {0.1, 0.03, 0.0}) {
      const auto shape = shape_of(from);
      if (const auto gains = largest_pid_gain(machines_, shape, bounds_)) {
        PidDesign now{pid_of(*gains, shape), 0.0};
        now.iae = mean_iae(now.controller);
        if (std::isfinite(now.iae) && (!best || now.iae < best->iae)) best = now;
      }
      if (size > 0.0) from = search.descend(from, size);
    }
    return best;
  }

  [[nodiscard]] double mean_iae(const Pid& pid) const {
    double sum = 0.0;
    for (const Machine& machine : machines_.all) {
      const auto loop =
          closed_loop(machine.states(), states_of(pid.transfer_function(machine.sample_time_s())));
      const double radius = loop.spectral_radius();
      if (!(radius < kStableRadius)) return std::numeric_limits<double>::infinity();
      sum += load_step_of(loop, radius).iae;
    }
    return sum / static_cast<double>(machines_.all.size());
  }

  [[nodiscard]] double cost(const PidPoint& x) const {
    const auto shape = shape_of(x);
    const auto gains = rough_pid_gain(on_all_lines_ ? machines_ : coarse_, shape, bounds_);
    if (!gains) return std::numeric_limits<double>::infinity();
    const Pid pid = pid_of(*gains, shape);
    double sum = 0.0;
    for (const Machine& machine : machines_.all) {
      const double step = machine.sample_time_s();
      sum += rough_load_step_iae(machine, states_of(pid.transfer_function(step)),
                                 pid.kp * (1.0 + shape.time_s / (shape.filter_s + step)));
    }
    return sum / static_cast<double>(machines_.all.size());
  }

  static constexpr double kCoarse = 0.5;
  Machines& machines_;
  Machines coarse_;
  bool on_all_lines_ = false;
  const Bounds& bounds_;
};

}  // namespace

data::TransferFunction Pid::transfer_function(double sample_time_s) const {
  const double p = filter_s > 0.0 ? std::exp(-sample_time_s / filter_s) : 0.0;
  const double d = kd * (1.0 - p) / sample_time_s, i = ki * sample_time_s;
  return {{kp + i + d, -kp * (1.0 + p) - i * p - 2.0 * d, kp * p + d}, {1.0, -1.0 - p, p}, sample_time_s};
}

std::optional<PidDesign> search_pid(Machines& machines, const Bounds& bounds,
                                    const GlobalSearch::Effort& effort, const std::optional<Pid>& start) {
  return PidSearch(machines, bounds).run(effort, start);
}

}  // namespace resonid::design
