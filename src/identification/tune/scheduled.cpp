// SPDX-License-Identifier: MIT
#include "identification/tune/scheduled.hpp"

#include <algorithm>
#include <cmath>

#include "design/schedule.hpp"
#include "identification/tune/designs.hpp"
#include "identification/tune/figure_values.hpp"

namespace resonid::identification {
namespace {

/// The posterior of the nearest result around the machine of the place.
design::PosteriorAt posterior_between(const std::vector<double>& positions,
                                      const std::vector<design::Posterior>& posteriors,
                                      design::MachineAt machine_at) {
  return [&positions, &posteriors, machine_at = std::move(machine_at)](double position) {
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < positions.size(); ++i)
      if (std::abs(positions[i] - position) < std::abs(positions[nearest] - position)) nearest = i;
    return posteriors[nearest].around(machine_at(position));
  };
}

}  // namespace

expected<void, Error> add_schedule(Tuning& tuning, const std::vector<design::Posterior>& posteriors) {
  const auto& positions = tuning.options.positions;
  for (const auto& machine : tuning.machines)
    if (machine.structure != tuning.machines.front().structure)
      return refuse("positions", "need results of one structure; identify all with the same .model");
  const auto machine_at = design::machine_between(positions, tuning.machines);
  const design::Stroke stroke{positions.front(), positions.back()};
  design::ScheduleOptions options;
  // Where one controller for all is far from that bound, so are those of a place.
  const auto& limits = tuning.proposed().limits;
  const bool by_band = std::ranges::find(limits, "beyond_band_peak") != limits.end();
  options.bounds = by_band ? design_bounds(tuning.options) : plain_bounds(tuning.options);
  options.posterior_at = posterior_between(positions, posteriors, machine_at);
  if (tuning.proposed().radius > 0.0) options.radius = tuning.proposed().radius;
  constexpr std::size_t kPositions = 41;  // at each of which the worst machine is looked for
  options.count = kPositions;
  auto found = design_schedule(machine_at, stroke, options);
  if (!found) return tl::unexpected(found.error());
  TunedSchedule schedule;
  for (const auto& node : found->schedule.nodes())
    schedule.nodes.push_back({node.position, node.kp, node.ki});
  double exceeded = 0.0;
  for (const auto& maximum : found->margins.maxima) {
    LoopFigure figure;
    figure.name = figure_name(static_cast<std::size_t>(maximum.peak.transfer));
    figure.value = maximum.peak.value;
    figure.worst = maximum.peak.value;
    figure.frequency_hz = maximum.peak.frequency_hz;
    figure.bound = maximum.peak.bound;
    if (maximum.exceeded() > exceeded || schedule.figures.empty()) schedule.worst_position = maximum.position;
    exceeded = std::max(exceeded, maximum.exceeded());
    schedule.figures.push_back(std::move(figure));
  }
  schedule.within = found->margins.stable && exceeded <= options.room;
  const double speed = stroke.to - stroke.from;  // through the stroke in a second
  schedule.scheduled_iae = run_through(machine_at, found->schedule, stroke, speed).iae;
  if (const auto& gains = tuning.proposed().gains) {
    const design::GainSchedule fixed({{stroke.from, gains->kp, gains->ki}}, gains->biquads);
    schedule.fixed_iae = run_through(machine_at, fixed, stroke, speed).iae;
  }
  tuning.schedule = std::move(schedule);
  return {};
}

}  // namespace resonid::identification
