// SPDX-License-Identifier: MIT
#include "design/schedule.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "design/largest_gain.hpp"
#include "design/robust.hpp"
#include "linalg/parallel.hpp"

namespace resonid::design {
namespace {

/// Where a position stands between ascending ones: the one before, and the share of the way to the next.
struct Place {
  std::size_t before;
  double share;
};
template <class Positions, class PositionOf>
Place place_of(const Positions& all, double position, const PositionOf& position_of) {
  std::size_t i = 0;
  while (i + 2 < all.size() && position_of(all[i + 1]) <= position) ++i;
  if (all.size() < 2) return {0, 0.0};
  const double from = position_of(all[i]), to = position_of(all[i + 1]);
  return {i, std::clamp((position - from) / (to - from), 0.0, 1.0)};
}

expected<void> check(const Stroke& stroke, const ScheduleOptions& options) {
  if (auto valid =
          check_nodes(stroke, options.bounds, options.first_nodes, options.most_nodes, options.count);
      !valid)
    return valid;
  if (options.largest_speed && !(*options.largest_speed > 0.0))
    return refuse("largest_speed", "must be > 0", *options.largest_speed);
  return {};
}

expected<ScheduleNode> node_at(double position, const MachineAt& machine_at, const ScheduleOptions& options) {
  const auto refused = refuse("bounds", "must be met by some gain at every position", position);
  if (options.posterior_at) {
    const auto design =
        robust_gains(options.posterior_at(position), options.biquads, options.bounds, options.radius);
    if (!design) return refused;
    return ScheduleNode{position, design->controller.kp, design->controller.ki};
  }
  Machines machines({Machine(machine_at(position))});
  const auto gains = largest_integral_gain(machines, options.biquads, options.bounds);
  if (!gains) return refused;
  return ScheduleNode{position, gains->kp, gains->ki};
}

/// What is largest over the stroke; `all`: [position][bounded transfer].
std::vector<FrozenMaximum> largest_of(const std::vector<std::vector<FrozenMaximum>>& all,
                                      const Bounds& bounds) {
  std::vector<FrozenMaximum> largest = all.front();
  for (const auto& here : all)
    for (std::size_t t = 0; t < largest.size(); ++t)
      if (here[t].peak.value > largest[t].peak.value) largest[t] = here[t];
  for (FrozenMaximum& maximum : largest) maximum.peak.bound = *bound_of(bounds, maximum.peak.transfer);
  return largest;
}

FrozenMargins margins_of(const GainSchedule& schedule, const MachineAt& machine_at, const Stroke& stroke,
                         const ScheduleOptions& options) {
  if (options.posterior_at)
    return frozen_worst_cases(options.posterior_at, options.radius, schedule, stroke, options.bounds,
                              options.count);
  return frozen_margins(machine_at, schedule, stroke, options.bounds, options.count);
}

/// Frequencies by which the sampled states multiply the twists (data::continuous_system): a twist stays as it
/// is when the stiffness changes, its state does not.
std::vector<double> twist_scales(const fit::DriveModel& model) {
  const auto& p = model.parameters;
  const auto scale = [](double stiffness, double a, double b) {
    return std::sqrt(stiffness * (1.0 / a + 1.0 / b));
  };
  if (model.structure == fit::Structure::rigid) return {};
  if (model.structure == fit::Structure::two_mass)
    return {scale(p.stiffness, p.driven_inertia, p.load_inertia)};
  return {scale(p.stiffness, p.driven_inertia, p.middle_inertia),
          scale(p.stiffness_2, p.middle_inertia, p.load_inertia)};
}

std::size_t samples_through(const Stroke& stroke, double speed, double step) {
  return static_cast<std::size_t>(std::max(1LL, std::llround((stroke.to - stroke.from) / speed / step)));
}
/// How often the torque of a run has changed its sign, and what it then is, Nm.
std::size_t stretch_of(std::size_t sample, std::size_t samples, int changes) {
  return static_cast<std::size_t>(static_cast<double>(sample) / static_cast<double>(samples) * changes +
                                  1e-9);
}
double torque_in(std::size_t stretch) { return stretch % 2 == 0 ? -1.0 : 1.0; }

/// With the check of the rate where there is one to make.
expected<ScheduleDesign> checked(ScheduleDesign design, const MachineAt& machine_at, const Stroke& stroke,
                                 const ScheduleOptions& options) {
  if (!options.largest_speed) return design;
  const double fast = *options.largest_speed;
  design.rate = check_rate(machine_at, design.schedule, stroke, fast);
  if (!design.rate->is_met())
    return refuse("largest_speed", "must be lower: a run at it disturbs the load more than a slow one", fast);
  return design;
}

}  // namespace

expected<void> check_nodes(const Stroke& stroke, const Bounds& bounds, std::size_t first_nodes,
                           std::size_t most_nodes, std::size_t count) {
  if (!(stroke.to > stroke.from)) return refuse("stroke", "must end above its beginning", stroke.to);
  if (first_nodes < 2 || first_nodes > most_nodes)
    return refuse("first_nodes", "must be at least 2 and at most most_nodes",
                  static_cast<double>(first_nodes));
  if (count < 2) return refuse("count", "must be at least 2", static_cast<double>(count));
  if (bounded_transfers(bounds).empty()) return refuse("bounds", "must limit something");
  return {};
}

FilteredPi GainSchedule::at(double position) const {
  const auto [i, share] = place_of(nodes_, position, [](const ScheduleNode& node) { return node.position; });
  const ScheduleNode &a = nodes_[i], &b = nodes_[std::min(i + 1, nodes_.size() - 1)];
  return {a.kp + share * (b.kp - a.kp), a.ki + share * (b.ki - a.ki), biquads_};
}

MachineAt machine_between(std::vector<double> positions, std::vector<fit::DriveModel> machines) {
  return [positions = std::move(positions), machines = std::move(machines)](double position) {
    const auto [i, share] = place_of(positions, position, [](double p) { return p; });
    fit::DriveModel model = machines[i];
    const fit::DriveModel& next = machines[std::min(i + 1, machines.size() - 1)];
    for (int p = 0; p < fit::kParameterCount; ++p) {
      const auto parameter = static_cast<fit::Parameter>(p);
      const double a = model.value(parameter), b = next.value(parameter);
      const bool logarithm = fit::has_parameter(model.structure, p) && a > 0.0 && b > 0.0;
      if (a != b) model.set(parameter, logarithm ? a * std::pow(b / a, share) : a + share * (b - a));
    }
    return model;
  };
}

const FrozenMaximum& FrozenMargins::worst() const {
  return *std::max_element(maxima.begin(), maxima.end(),
                           [](const auto& a, const auto& b) { return a.exceeded() < b.exceeded(); });
}

FrozenMargins frozen_margins(const MachineAt& machine_at, const GainSchedule& schedule, const Stroke& stroke,
                             const Bounds& bounds, std::size_t count) {
  const auto transfers = bounded_transfers(bounds);
  std::vector<std::vector<FrozenMaximum>> all(count);
  std::vector<char> unstable(count, 0);
  linalg::for_each_index(count, 0, [&](std::size_t i) {
    const double position = stroke.even(i, count);
    const Machine machine(machine_at(position));
    const FilteredPi controller = schedule.at(position);
    const LoopFunctions loop(machine.response(), controller, machine.sample_time_s());
    for (const Peak& peak : loop.largest_of(transfers, first_lines_hz(machine.model(), 0.5)))
      all[i].push_back({peak, position, machine.model()});
    unstable[i] = !closed_loop(machine.states(), states_of(controller, machine.sample_time_s())).is_stable();
  });
  return {largest_of(all, bounds), std::count(unstable.begin(), unstable.end(), 1) == 0};
}

FrozenMargins frozen_worst_cases(const PosteriorAt& posterior_at, double radius, const GainSchedule& schedule,
                                 const Stroke& stroke, const Bounds& bounds, std::size_t count) {
  std::vector<std::vector<FrozenMaximum>> all(count);
  bool stable = true;
  for (std::size_t i = 0; i < count; ++i) {
    const double position = stroke.even(i, count);
    const Posterior posterior = posterior_at(position);
    const FilteredPi controller = schedule.at(position);
    // Where the nominal loop is stable and bounded on the ellipsoid, so is every loop in it
    // (docs/methods/tune.md 7.3).
    const ClosedLoop nominal = closed_loop(fit::sampled_states(posterior.nominal()),
                                           states_of(controller, posterior.nominal().sample_time_s));
    stable = stable && nominal.is_stable();
    for (const Transfer transfer : bounded_transfers(bounds)) {
      const WorstCase worst = worst_case(posterior, controller, transfer, radius);
      all[i].push_back({worst.peak, position, posterior.at(worst.u)});
    }
  }
  return {largest_of(all, bounds), stable};
}

ScheduleRun run_through(const MachineAt& machine_at, const GainSchedule& schedule, const Stroke& stroke,
                        double speed, int changes) {
  const double step = machine_at(stroke.from).sample_time_s, length = stroke.to - stroke.from;
  const auto samples = samples_through(stroke, speed, step);
  ScheduleRun run;
  Eigen::VectorXd state;
  std::vector<double> scales_before;
  for (std::size_t k = 0; k <= samples; ++k) {
    const double way = static_cast<double>(k) / static_cast<double>(samples);
    const double position = stroke.from + way * length;
    const fit::DriveModel machine = machine_at(position);
    // The sum of the controller counts in torque, so that other gains make no jump; it stays a state where ki
    // is 0 at some position.
    auto gains = schedule.at(position);
    gains.ki = std::max(gains.ki, std::numeric_limits<double>::min());
    const ClosedLoop loop = closed_loop(fit::sampled_states(machine), states_of(gains, step));
    if (k == 0) state.setZero(loop.a.rows());
    const auto scales = twist_scales(machine);
    for (std::size_t i = 0; i < scales_before.size(); ++i)
      state(static_cast<Eigen::Index>(scales.size() + 1 + i)) *= scales[i] / scales_before[i];
    scales_before = scales;
    const double v = loop.load * state;
    run.iae += step * std::abs(v);
    run.peak = std::max(run.peak, std::abs(v));
    state = (loop.a * state + torque_in(stretch_of(k, samples, changes)) * loop.load_torque).eval();
  }
  return run;
}

RateCheck check_rate(const MachineAt& machine_at, const GainSchedule& schedule, const Stroke& stroke,
                     double speed) {
  return {run_through(machine_at, schedule, stroke, speed),
          run_through(machine_at, schedule, stroke, 0.1 * speed)};
}

ScheduleRun run_at_rest(const MachineAt& machine_at, const GainSchedule& schedule, const Stroke& stroke,
                        double speed, int changes) {
  const double step = machine_at(stroke.from).sample_time_s;
  const auto samples = samples_through(stroke, speed, step);
  const auto ends = static_cast<std::size_t>(changes) + 1;
  // [stretch] What it does between two changes of the torque, at the worse of the positions at its ends.
  std::vector<ScheduleRun> worst(ends - 1);
  for (std::size_t end = 0; end < ends; ++end) {
    const double position = stroke.even(end, ends);
    const ClosedLoop loop =
        closed_loop(fit::sampled_states(machine_at(position)), states_of(schedule.at(position), step));
    std::vector<ScheduleRun> here(ends - 1);
    Eigen::VectorXd state = Eigen::VectorXd::Zero(loop.a.rows());
    for (std::size_t k = 0; k <= samples; ++k) {
      const std::size_t stretch = std::min(stretch_of(k, samples, changes), ends - 2);
      const double v = loop.load * state;
      here[stretch].iae += step * std::abs(v);
      here[stretch].peak = std::max(here[stretch].peak, std::abs(v));
      state = (loop.a * state + torque_in(stretch_of(k, samples, changes)) * loop.load_torque).eval();
    }
    for (std::size_t j = end == 0 ? 0 : end - 1; j <= std::min(end, ends - 2); ++j) {
      worst[j].iae = std::max(worst[j].iae, here[j].iae);
      worst[j].peak = std::max(worst[j].peak, here[j].peak);
    }
  }
  ScheduleRun run;
  for (const ScheduleRun& stretch : worst) {
    run.iae += stretch.iae;
    run.peak = std::max(run.peak, stretch.peak);
  }
  return run;
}

double largest_speed_of(const MachineAt& machine_at, const GainSchedule& schedule, const Stroke& stroke,
                        double most) {
  const auto is_met = [&](double speed) {
    return RateCheck{run_through(machine_at, schedule, stroke, speed),
                     run_at_rest(machine_at, schedule, stroke, speed)}
        .is_met();
  };
  // From slow ones on: what is so fast that no torque has time to act disturbs nothing, and proves nothing.
  constexpr double kSlowest = 0.25, kFaster = 1.5;  // strokes per second; from one to the next
  double low = 0.0, high = std::min(most, kSlowest * (stroke.to - stroke.from));
  while (is_met(high)) {
    low = high;
    if (high >= most) return most;
    high = std::min(most, kFaster * high);
  }
  constexpr int kHalvings = 5;
  for (int i = 0; i < kHalvings && low > 0.0; ++i) {
    const double middle = 0.5 * (low + high);
    (is_met(middle) ? low : high) = middle;
  }
  return low;
}

expected<ScheduleDesign> design_schedule(const MachineAt& machine_at, const Stroke& stroke,
                                         const ScheduleOptions& options) {
  if (const auto valid = check(stroke, options); !valid) return tl::unexpected(valid.error());
  std::vector<ScheduleNode> nodes;
  for (std::size_t i = 0; i < options.first_nodes; ++i) {
    const auto node = node_at(stroke.even(i, options.first_nodes), machine_at, options);
    if (!node) return tl::unexpected(node.error());
    nodes.push_back(*node);
  }
  for (;;) {
    const GainSchedule schedule(nodes, options.biquads);
    FrozenMargins margins = margins_of(schedule, machine_at, stroke, options);
    const FrozenMaximum worst = margins.worst();
    if (margins.stable && worst.exceeded() <= options.room)
      return checked({schedule, std::move(margins), std::nullopt}, machine_at, stroke, options);
    if (nodes.size() >= options.most_nodes)
      return refuse("most_nodes", "must be larger for the bounds to be met between nodes",
                    static_cast<double>(options.most_nodes));
    const auto at = place_of(nodes, worst.position, [](const ScheduleNode& node) { return node.position; });
    const double middle = 0.5 * (nodes[at.before].position + nodes[at.before + 1].position);
    const auto node = node_at(middle, machine_at, options);
    if (!node) return tl::unexpected(node.error());
    nodes.insert(nodes.begin() + static_cast<std::ptrdiff_t>(at.before) + 1, *node);
  }
}

expected<ScheduleDesign> one_for_all(const MachineAt& machine_at, const Stroke& stroke,
                                     const ScheduleOptions& options) {
  if (const auto valid = check(stroke, options); !valid) return tl::unexpected(valid.error());
  std::vector<Machine> machines;
  for (const double position : {stroke.from, 0.5 * (stroke.from + stroke.to), stroke.to})
    machines.emplace_back(machine_at(position));
  constexpr int kRounds = 10;
  const double met = options.posterior_at ? 1e-3 : 1e-6;  // a worst case is searched for
  for (int round = 0; round < kRounds; ++round) {
    Machines all(machines);
    const auto gains = largest_integral_gain(all, options.biquads, options.bounds);
    if (!gains) break;
    const GainSchedule schedule({{stroke.from, gains->kp, gains->ki}}, options.biquads);
    FrozenMargins margins = margins_of(schedule, machine_at, stroke, options);
    if (margins.stable && margins.worst().exceeded() <= met)
      return checked({schedule, std::move(margins), std::nullopt}, machine_at, stroke, options);
    for (const FrozenMaximum& maximum : margins.maxima)
      if (maximum.exceeded() > met) machines.emplace_back(maximum.machine);
  }
  return refuse("bounds", "must be met by one controller at every position");
}

}  // namespace resonid::design
