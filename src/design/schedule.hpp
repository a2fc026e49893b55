// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/design/detail/bounds.hpp>
#include <resonid/fit/drive_model.hpp>
#include <vector>

#include "design/closed_loop.hpp"
#include "design/controller.hpp"
#include "design/posterior.hpp"

// Gains over position, or over load: exact PI at nodes, linear between them (docs/methods/tune.md 12).
namespace resonid::design {

struct ScheduleNode {
  double position = 0.0;
  double kp = 0.0, ki = 0.0;
};

/// Linear between nodes, constant beyond the ends.
class GainSchedule {
 public:
  /// At least one node, ascending in position; the biquads are the same everywhere.
  explicit GainSchedule(std::vector<ScheduleNode> nodes, std::vector<Biquad> biquads = {})
      : nodes_(std::move(nodes)), biquads_(std::move(biquads)) {}

  [[nodiscard]] FilteredPi at(double position) const;
  [[nodiscard]] const std::vector<ScheduleNode>& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<Biquad>& biquads() const { return biquads_; }

 private:
  std::vector<ScheduleNode> nodes_;
  std::vector<Biquad> biquads_;
};

/// The machine at a position.
using MachineAt = std::function<fit::DriveModel(double position)>;

/// Machines identified at some positions, ascending, of one structure: parameters that are positive by nature
/// go linearly in their logarithms between them, the others linearly; constant beyond the ends.
[[nodiscard]] MachineAt machine_between(std::vector<double> positions, std::vector<fit::DriveModel> machines);

/// A stroke of positions.
struct Stroke {
  double from = 0.0, to = 0.0;

  /// The i-th of `count` even positions.
  [[nodiscard]] double even(std::size_t i, std::size_t count) const {
    return from + (to - from) * static_cast<double>(i) / static_cast<double>(count - 1);
  }
};

/// Largest over the stroke, with the position fixed.
struct FrozenMaximum {
  Peak peak;
  double position = 0.0;
  fit::DriveModel machine;  ///< At which it is that large.

  [[nodiscard]] double exceeded() const { return peak.value / peak.bound - 1.0; }
};
struct FrozenMargins {
  std::vector<FrozenMaximum> maxima;  ///< [bounded transfer]
  bool stable = true;                 ///< At every position.

  [[nodiscard]] const FrozenMaximum& worst() const;
};
/// On `count` positions over the stroke. They are no proof while the position moves: see run_through().
[[nodiscard]] FrozenMargins frozen_margins(const MachineAt& machine_at, const GainSchedule& schedule,
                                           const Stroke& stroke, const Bounds& bounds,
                                           std::size_t count = 121);

/// What identification leaves open of the machine at a position.
using PosteriorAt = std::function<Posterior(double position)>;
/// The same for the worst machine of the ellipsoid at each position.
[[nodiscard]] FrozenMargins frozen_worst_cases(const PosteriorAt& posterior_at, double radius,
                                               const GainSchedule& schedule, const Stroke& stroke,
                                               const Bounds& bounds, std::size_t count = 121);

/// What the load does on a run through the stroke while a torque on it alternates.
struct ScheduleRun {
  double iae = 0.0;   ///< Ts sum |v|, rad
  double peak = 0.0;  ///< rad/s
};
/// At a speed in positions per second, under +-1 Nm that changes its sign `changes` - 1 times.
[[nodiscard]] ScheduleRun run_through(const MachineAt& machine_at, const GainSchedule& schedule,
                                      const Stroke& stroke, double speed, int changes = 8);

/// What every way to nodes over a stroke needs.
[[nodiscard]] expected<void> check_nodes(const Stroke& stroke, const Bounds& bounds, std::size_t first_nodes,
                                         std::size_t most_nodes, std::size_t count);

struct ScheduleOptions {
  Bounds bounds;
  std::vector<Biquad> biquads;
  std::size_t first_nodes = 2, most_nodes = 17;
  std::size_t count = 121;  ///< Positions at which the margins are looked at.
  double room = 0.005;      ///< By what a bound may be exceeded between nodes, relative.
  /// Where it is given, the bounds are met on the whole ellipsoid of this radius around each machine.
  PosteriorAt posterior_at;
  double radius = 2.0;
  /// Largest rate of change: a run at it must do no more harm than one at a tenth of it.
  std::optional<double> largest_speed;
};

/// A run at the largest speed beside one so slow that the position hardly moves meanwhile.
struct RateCheck {
  ScheduleRun fast, slow;
  [[nodiscard]] bool is_met() const { return fast.iae <= 1.1 * slow.iae && fast.peak <= 1.1 * slow.peak; }
};

[[nodiscard]] RateCheck check_rate(const MachineAt& machine_at, const GainSchedule& schedule,
                                   const Stroke& stroke, double speed);
/// The same run by the clock of that speed with the position at rest: between two changes of the torque at
/// the worse of the positions at which they come.
[[nodiscard]] ScheduleRun run_at_rest(const MachineAt& machine_at, const GainSchedule& schedule,
                                      const Stroke& stroke, double speed, int changes = 8);
/// The largest speed, up to `most`, up to which a run's IAE and peak exceed those of the position at rest by
/// no more than a tenth; 0 where they do at the slowest that is looked at, a quarter of the stroke in a
/// second.
[[nodiscard]] double largest_speed_of(const MachineAt& machine_at, const GainSchedule& schedule,
                                      const Stroke& stroke, double most);

/// Up to which speed loops that were judged with the position at rest say what they do while it moves, as of
/// systems that vary slowly: the stroke takes five settling times of the slowest of them, and within one
/// settling time no gain, inertia or stiffness changes by more than a tenth. Settled: down to 2 % by the
/// slowest pole. 0 where a loop is unstable.
[[nodiscard]] double slow_speed_of(const MachineAt& machine_at, const GainSchedule& schedule,
                                   const Stroke& stroke, std::size_t count = 41);

struct ScheduleDesign {
  GainSchedule schedule;
  FrozenMargins margins;
  std::optional<RateCheck> rate;
};

/// Nodes are added halfway between those around the worst position until no bound is exceeded by more than
/// `room`.
[[nodiscard]] expected<ScheduleDesign> design_schedule(const MachineAt& machine_at, const Stroke& stroke,
                                                       const ScheduleOptions& options);

/// One controller for all positions, where the position is not known to the drive.
[[nodiscard]] expected<ScheduleDesign> one_for_all(const MachineAt& machine_at, const Stroke& stroke,
                                                   const ScheduleOptions& options);

}  // namespace resonid::design
