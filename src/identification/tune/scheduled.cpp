// SPDX-License-Identifier: MIT
#include "identification/tune/scheduled.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "design/confident_schedule.hpp"
#include "design/figures.hpp"
#include "identification/tune/checks.hpp"
#include "identification/tune/designs.hpp"
#include "identification/tune/figure_values.hpp"
#include "identification/tune/reach.hpp"
#include "identification/tune/worst_figures.hpp"

namespace resonid::identification {
namespace {

/// Rms torque per rms of the velocity's noise that is allowed; nothing without a wish, or without noise.
std::optional<double> most_noise_gain(std::span<const Result> results, const TuneOptions& options) {
  if (!options.largest_noise_torque) return std::nullopt;
  double noise = 0.0;
  for (const Result& r : results)
    if (r.validation && r.validation->residual_rms) noise = std::max(noise, *r.validation->residual_rms);
  if (!(noise > 0.0)) return std::nullopt;
  return *options.largest_noise_torque / noise;
}

/// What lies between two results is interpolated: nobody has looked there (docs/methods/tune.md 12).
expected<void, Error> check_gap(const fit::DriveModel& a, double from, const fit::DriveModel& b, double to) {
  constexpr double kMuch = 0.2;  // as between rows of a track
  for (const fit::Parameter p :
       {fit::kDrivenInertia, fit::kMiddleInertia, fit::kLoadInertia, fit::kStiffness, fit::kStiffness2}) {
    if (!fit::has_parameter(a.structure, p)) continue;
    const auto before = a.estimate(p), after = b.estimate(p);
    const double change = std::log(after.value / before.value);
    if (std::abs(change) <=
        std::max(kMuch, 2.0 * std::hypot(before.std / before.value, after.std / after.value)))
      continue;
    return refuse(
        "positions",
        fmt::format(
            "must have enough positions between {:.4g} and {:.4g}, over which {} changes by {:.0f} %; record "
            "one between them",
            from, to, fit::kParameterNames[p], 100.0 * std::abs(std::expm1(change))));
  }
  return {};
}
expected<void, Error> check_gaps(const std::vector<double>& positions,
                                 const std::vector<fit::DriveModel>& machines) {
  for (std::size_t i = 0; i + 1 < positions.size(); ++i)
    if (auto gap = check_gap(machines[i], positions[i], machines[i + 1], positions[i + 1]); !gap) return gap;
  return {};
}

double length_of(const design::Stroke& stroke) { return stroke.to - stroke.from; }

class Scheduler {
 public:
  Scheduler(Tuning& tuning, std::span<const Result> results, const std::vector<design::Posterior>& posteriors)
      : t_(tuning),
        results_(results),
        posteriors_(posteriors),
        stroke_{tuning.options.positions.front(), tuning.options.positions.back()},
        machine_at_(machine_over(tuning)),
        posterior_at_(posterior_over(tuning, posteriors)) {}

  expected<RobustLaw, Error> run() {
    for (const auto& machine : t_.machines)
      if (machine.structure != t_.machines.front().structure)
        return refuse("positions", "need results of one structure; identify all with the same .model");
    if (auto near = check_gaps(t_.options.positions, t_.machines); !near) return tl::unexpected(near.error());
    const auto& o = t_.options;
    design::ConfidentScheduleOptions options;
    options.bounds = design_bounds(o);
    options.confidence = {o.confidence, o.guarantee, o.draws, o.seed};
    options.further = o.positions;
    options.most_noise_gain = most_noise_gain(results_, o);
    auto found = confident_schedule(posterior_at_, stroke_, options);
    if (!found) {
      const auto& error = found.error();
      if (error.field == "confidence" && std::isfinite(error.value))
        return tl::unexpected(not_met_at(o.positions, error.value, o.confidence));
      if (error.field == "bounds" && std::isfinite(error.value))
        return refuse(
            "positions",
            fmt::format("must have a gain at each that meets the bounds on the machines that may be: "
                        "at {:.4g} there is none; allow larger bounds or less confidence",
                        error.value));
      return tl::unexpected(error);
    }
    describe(*found);
    if (auto checked = check_places(*found); !checked) return tl::unexpected(checked.error());
    if (auto checked = check_speed(found->schedule); !checked) return tl::unexpected(checked.error());
    return at_first(*found);
  }

 private:
  void describe(const design::ConfidentSchedule& found) {
    TunedSchedule schedule;
    const auto& nodes = found.schedule.nodes();
    for (std::size_t i = 0; i < nodes.size(); ++i)
      schedule.nodes.push_back({nodes[i].position, nodes[i].kp, nodes[i].ki, found.radii[i]});
    for (const auto& here : found.checks)
      schedule.places.push_back({here.position, here.check.probability()});
    schedule.worst_position = found.worst().position;
    schedule.within = true;  // or it would have been refused
    put_figures(found, schedule);
    const double speed = length_of(stroke_);  // through the stroke in a second
    schedule.scheduled_iae = run_through(machine_at_, found.schedule, stroke_, speed).iae;
    t_.schedule = std::move(schedule);
  }

  /// Largest over the stroke of the identified machines, and of the ellipsoids' worst ones.
  void put_figures(const design::ConfidentSchedule& found, TunedSchedule& schedule) const {
    const auto& first = found.checks.front();
    for (std::size_t i = 0; i < first.worst.size(); ++i) {
      const auto transfer = first.worst[i].peak.transfer;
      LoopFigure figure;
      figure.name = figure_name(static_cast<std::size_t>(transfer));
      figure.bound = bound_of(design_bounds(t_.options), transfer);
      figure.worst = 0.0;
      figure.probability = 0.0;
      for (const auto& here : found.checks) {
        const auto posterior = posterior_at_(here.position);
        const design::Machine machine(posterior.nominal(), posterior.known_to_hz());
        const auto peak = design::figures_of(machine, found.schedule.at(here.position)).peak(transfer);
        if (peak.value > figure.value) {
          figure.value = peak.value;
          figure.frequency_hz = peak.frequency_hz;
        }
        figure.worst = std::max(*figure.worst, here.worst[i].peak.value);
        const auto exceeding =
            static_cast<double>(here.check.exceeding_each[static_cast<std::size_t>(transfer)]);
        figure.probability = std::max(*figure.probability, exceeding / static_cast<double>(here.check.draws));
      }
      schedule.figures.push_back(std::move(figure));
    }
  }

  /// Where the machines were identified: that the loop crosses in the band that was measured there, and is as
  /// fast as is wanted on every machine of the ellipsoid there.
  [[nodiscard]] expected<void, Error> check_places(const design::ConfidentSchedule& found) const {
    for (std::size_t i = 0; i < results_.size(); ++i) {
      const std::vector<design::Machine> here = {design::Machine(posteriors_[i].nominal())};
      const double position = t_.options.positions[i];
      const Law law = law_of(found.schedule.at(position), t_.sample_time_s);
      if (auto crossing = check_crossover(law.what, here, results_.subspan(i, 1)); !crossing) {
        if (auto bound = crossing_out_of_reach(t_.options, here, results_.subspan(i, 1), {}))
          return tl::unexpected(*bound);
        return crossing;
      }
      if (!t_.options.least_bandwidth_hz) continue;
      const double reached = least_bandwidth_hz(posteriors_[i], radius_at(found, position), law);
      if (reached < *t_.options.least_bandwidth_hz)
        return tl::unexpected(bandwidth_out_of_reach(t_.options, here, reached, {}));
    }
    return {};
  }

  /// As far as the ellipsoid of the nearest place that was judged goes.
  [[nodiscard]] static double radius_at(const design::ConfidentSchedule& found, double position) {
    return std::ranges::min_element(found.checks, {},
                                    [&](const auto& here) { return std::abs(here.position - position); })
        ->radius;
  }

  /// The frozen figures are no proof while the position moves.
  expected<void, Error> check_speed(const design::GainSchedule& schedule) {
    constexpr double kLooked = 2.0;  // strokes per second
    const double slow = slow_speed_of(machine_at_, schedule, stroke_);
    const double most = t_.options.largest_speed.value_or(std::min(slow, kLooked * length_of(stroke_)));
    if (most > slow)
      return refuse(
          "largest_speed",
          fmt::format(
              "must be at most {:.3g} units of the position per s: beyond it the loops that were judged at "
              "rest tell nothing, since the stroke takes less than five of their settling times, or "
              "they change by more than a tenth within one",
              slow),
          most);
    const double reached = largest_speed_of(machine_at_, schedule, stroke_, most);
    t_.schedule->largest_speed = reached;
    t_.schedule->looked_speed = most;
    if (!t_.options.largest_speed || reached >= most) return {};
    return refuse(
        "largest_speed",
        fmt::format("must be at most {:.3g} units of the position per s: beyond it the gains change so "
                    "quickly that a run through "
                    "the stroke disturbs the load by a tenth more than a slow one",
                    reached),
        most);
  }

  /// With the set-point weight that keeps overshoot and torque of a step at every position.
  [[nodiscard]] RobustLaw at_first(design::ConfidentSchedule& found) {
    double weight = 1.0;
    for (const auto& here : found.checks) {
      const design::Machine machine(machine_at_(here.position));
      weight = largest_weight(machine, law_of(found.schedule.at(here.position), t_.sample_time_s), t_.options,
                              weight);
    }
    t_.schedule->set_point_weight = weight;
    auto& first = found.checks.front();
    RobustLaw robust{law_of(found.schedule.at(stroke_.from), t_.sample_time_s), first.radius,
                     std::move(first.worst), std::move(first.check)};
    robust.law.what.name = fmt::format("Scheduled PI at {:.4g}", stroke_.from);
    robust.law.what.remark = fmt::format("the schedule's gains at position {:.4g}", stroke_.from);
    set_weight(robust.law, weight);
    return robust;
  }

  Tuning& t_;
  std::span<const Result> results_;
  const std::vector<design::Posterior>& posteriors_;
  design::Stroke stroke_;
  design::MachineAt machine_at_;
  design::PosteriorAt posterior_at_;
};

}  // namespace

Error not_met_at(const std::vector<double>& positions, double place, double confidence) {
  constexpr double kSame = 1e-9;
  const auto after = std::ranges::upper_bound(positions, place);
  const bool between = after != positions.begin() && after != positions.end() &&
                       place - *(after - 1) > kSame * (positions.back() - positions.front());
  if (!between)
    return {"confidence",
            fmt::format("must be lower for the bounds to be met at {:.4g} by gains that go straight through "
                        "there; or allow larger bounds",
                        place),
            confidence};
  return {
      "positions",
      fmt::format("must have enough positions between {:.4g} and {:.4g}: near {:.4g} what the machine may "
                  "be between two results exceeds a bound with more than {:.3g} % probability, whatever "
                  "the gains; record there, or allow larger bounds or less confidence",
                  *(after - 1), *after, place, 100.0 * (1.0 - confidence))};
}

double TunedSchedule::probability() const {
  double most = 0.0;
  for (const Place& place : places) most = std::max(most, place.probability);
  return most;
}

design::MachineAt machine_over(const Tuning& tuning) {
  return design::machine_between(tuning.options.positions, tuning.machines);
}

design::PosteriorAt posterior_over(const Tuning& tuning, const std::vector<design::Posterior>& posteriors) {
  return [machine_at = machine_over(tuning), positions = tuning.options.positions,
          &posteriors](double position) {
    std::size_t i = 0;
    while (i + 2 < positions.size() && positions[i + 1] <= position) ++i;
    const double share = std::clamp((position - positions[i]) / (positions[i + 1] - positions[i]), 0.0, 1.0);
    if (share == 0.0) return posteriors[i].around(machine_at(position));
    if (share == 1.0) return posteriors[i + 1].around(machine_at(position));
    return posteriors[i].between(posteriors[i + 1], share).around(machine_at(position));
  };
}

design::GainSchedule gains_over(const TunedSchedule& schedule) {
  std::vector<design::ScheduleNode> nodes;
  for (const auto& node : schedule.nodes) nodes.push_back({node.position, node.kp, node.ki});
  return design::GainSchedule(std::move(nodes));
}

expected<RobustLaw, Error> schedule_gains(Tuning& tuning, std::span<const Result> results,
                                          const std::vector<design::Posterior>& posteriors) {
  return Scheduler(tuning, results, posteriors).run();
}

void add_one_for_all(Tuning& tuning, const design::FilteredPi& gains) {
  const design::Stroke stroke{tuning.options.positions.front(), tuning.options.positions.back()};
  const design::GainSchedule fixed({{stroke.from, gains.kp, gains.ki}}, gains.biquads);
  tuning.schedule->fixed_iae = run_through(machine_over(tuning), fixed, stroke, stroke.to - stroke.from).iae;
}

}  // namespace resonid::identification
