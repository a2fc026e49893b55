// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/planning/plan.hpp>

#include "planning/experiment_layout.hpp"

namespace resonid::planning {
namespace {

using detail::Task;

expected<void, Error> check(const PlanConfig& c) {
  if (const auto ok = check(c.drive); !ok) return ok;
  const auto& l = c.limits;
  if (!(l.torque > 0.0)) return refuse("max_torque", "must be > 0", l.torque);
  if (!(l.excitation > 0.0)) return refuse("max_excitation", "must be > 0", l.excitation);
  if (!std::isfinite(std::min({l.torque, l.excitation, l.velocity, l.stroke, l.torque_rms})))
    return refuse("max_torque", "must be given, or another limit that an amplitude follows from");
  if (!(l.torque_rms > 0.0)) return refuse("max_torque_rms", "must be > 0", l.torque_rms);
  if (!(l.velocity > 0.0)) return refuse("max_velocity", "must be > 0", l.velocity);
  if (!(l.stroke > 0.0)) return refuse("max_stroke", "must be > 0", l.stroke);
  if (!(l.time_s > 0.0)) return refuse("max_time_s", "must be > 0", l.time_s);
  constexpr double kFewestSamples = 64.0;
  if (l.time_s < kFewestSamples * c.drive.model.sample_time_s)
    return refuse("max_time_s", "must be at least 64 samples", l.time_s);
  if (std::isfinite(l.time_s) && l.time_s > kMostSamples * c.drive.model.sample_time_s)
    return refuse("max_time_s", "must be at most 2 000 000 samples", l.time_s);
  if (!(c.accuracy_of_all > 0.0)) return refuse("accuracy", "must be > 0", c.accuracy_of_all);
  if (!(c.spread >= 0.0 && c.spread <= 0.5)) return refuse("spread", "must be 0 ... 0.5", c.spread);
  const double rate = 1.0 / c.drive.model.sample_time_s;
  if (c.band_hz &&
      !(c.band_hz->first > 0.0 && c.band_hz->second > c.band_hz->first && c.band_hz->second < 0.5 * rate))
    return refuse("band", "must rise from > 0 to below half the sample rate", c.band_hz->second);
  if (c.period_s && !(*c.period_s * rate >= 16.0 && *c.period_s <= l.time_s))
    return refuse("period_s", "must be at least 16 samples and at most the time", *c.period_s);
  const auto known = figure_names(c.drive);
  for (const auto& target : c.targets) {
    if (std::find(known.begin(), known.end(), target.figure) == known.end())
      return refuse("accuracy", "must name figures of this drive");
    if (!(target.accuracy > 0.0)) return refuse("accuracy", "must be > 0", target.accuracy);
  }
  return {};
}

/// The least time of a kind whose length is free, or the longest time allowed. Information grows about with
/// time, so a short run tells how long is needed; what needs far more than `rival_s` is left at that.
template <class LayOut>
Experiment least_time(const Task& task, double rival_s, LayOut&& lay_out) {
  const auto at_most = [&](double samples) {
    return static_cast<std::size_t>(std::clamp(samples, 64.0, static_cast<double>(task.most_samples)));
  };
  constexpr double kHopeless = 3.0, kMostGrowth = 8.0;
  constexpr int kRounds = 12;
  std::size_t samples = at_most(4.0 * task.sample_rate_hz / task.low_hz);
  Experiment best = lay_out(samples);
  std::size_t too_short = 63, enough = 0;
  (best.ratio > 1.0 ? too_short : enough) = samples;
  Experiment last = best;
  for (int round = 0; round < kRounds; ++round) {
    if (last.ratio > 1.0 && round > 0 && last.needed_s.value_or(HUGE_VAL) > kHopeless * rival_s) break;
    if (last.ratio <= 1.0 && last.ratio > 0.99) break;
    const double longer = std::min(last.ratio * last.ratio * 1.002, kMostGrowth);
    std::size_t next = at_most(std::ceil(static_cast<double>(samples) * longer));
    if (enough > 0 && (next <= too_short || next >= enough)) next = (too_short + enough) / 2;
    if (next == samples || next == too_short || next == enough) break;
    samples = next;
    last = lay_out(samples);
    if (last.ratio > 1.0)
      too_short = std::max(too_short, samples);
    else
      enough = samples;
    if (enough == 0 || enough == samples) best = last;
  }
  return best;
}

expected<Experiment, Error> planned(const Task& task, ExcitationType type, double rival_s, Plan& plan) {
  switch (type) {
    case ExcitationType::chirp:
      return least_time(task, rival_s, [&](std::size_t n) { return detail::lay_out_chirp(task, n); });
    case ExcitationType::prbs:
      return least_time(task, rival_s, [&](std::size_t n) { return detail::lay_out_prbs(task, n); });
    case ExcitationType::multisine:
      break;
  }
  return detail::plan_multisine(task, plan);
}

bool better(const Experiment& a, const Experiment& b) {
  if ((a.ratio > 1.0) != (b.ratio > 1.0)) return a.ratio <= 1.0;
  return a.ratio > 1.0 ? a.ratio < b.ratio : a.duration_s < b.duration_s;
}

}  // namespace

expected<Plan, Error> make_plan(const PlanConfig& config) {
  auto plan = detail::plan_once(config);
  if (!plan) return plan;
  if (config.progress) config.progress("looking at two steps");
  plan->two_stages = detail::two_stages(config, *plan);
  return plan;
}

expected<Plan, Error> detail::plan_once(const PlanConfig& config) {
  Plan plan;
  plan.config = config;
  auto& c = plan.config;
  if (c.targets.empty())
    for (const int i : estimated_of(c.drive.model))
      if (fit::has_parameter(c.drive.model.structure, i))
        c.targets.push_back(
            {std::string(fit::kParameterNames[static_cast<std::size_t>(i)]), c.accuracy_of_all, true});
  if (const auto ok = check(c); !ok) return unexpected(ok.error());
  const auto tell = [&](std::string_view stage) {
    if (c.progress) c.progress(stage);
  };
  const Task task(c);
  c.band_hz = {task.low_hz, task.high_hz};
  plan.band_given = task.band_given;
  plan.drives = task.drives.size();
  using enum ExcitationType;
  if (const auto reason = detail::prbs_outside_band(task)) {
    if (c.type == prbs)
      return refuse("band", "must reach lower or higher for a PRBS, whose power spreads from 0 Hz on",
                    task.low_hz);
    plan.skipped.push_back({prbs, *reason});
  }
  std::optional<Experiment> best;
  std::array<std::optional<double>, 3> least_s;
  for (const ExcitationType type : {multisine, chirp, prbs}) {
    if (c.type && *c.type != type) continue;
    if (type == prbs && !plan.skipped.empty()) continue;
    tell(std::string("planning a ").append(name_of(type)));
    const double rival_s = !best                ? HUGE_VAL
                           : best->ratio <= 1.0 ? best->duration_s
                                                : best->needed_s.value_or(HUGE_VAL);
    auto x = planned(task, type, rival_s, plan);
    // Free in its kind and period, a plan goes without the multisine where the time is too short for one.
    if (!x && (c.type || c.period_s || type != multisine)) return unexpected(x.error());
    if (x && x->ratio <= 1.0) least_s[static_cast<std::size_t>(type)] = x->duration_s;
    if (x && (!best || better(*x, *best))) best = std::move(*x);
  }
  tell("comparing");
  plan.reached = best->ratio <= 1.0;
  detail::evaluate_amplitude(task, *best);
  const std::size_t samples = best->excitation.size();
  const ExcitationType chosen = best->type;
  plan.experiments.push_back(std::move(*best));
  if (chosen != chirp) plan.experiments.push_back(detail::lay_out_chirp(task, samples));
  if (chosen != prbs && plan.skipped.empty()) plan.experiments.push_back(detail::lay_out_prbs(task, samples));
  for (auto& x : plan.experiments) x.least_s = least_s[static_cast<std::size_t>(x.type)];
  plan.noise_torque = torque_of_noise(c.drive);
  return plan;
}

}  // namespace resonid::planning
