// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "planning/experiment_layout.hpp"

namespace resonid::planning::detail {
namespace {

constexpr double kLeastSpread = 0.1;  // below it there is little to gain
constexpr double kFirstPart = 0.2;    // of the one run's time
constexpr double kClearly = 0.8;

/// Largest relative deviation of an inertia, stiffness or damping after an experiment, rms over the drives.
double worst_deviation(const std::vector<NominalDrive>& drives, std::span<const double> excitation) {
  std::array<double, fit::kParameterCount> square{};
  for (const auto& drive : drives) {
    const auto told = predicted(drive, excitation).model;
    for (int i = 0; i < fit::kParameterCount; ++i) {
      if (!told.estimated[static_cast<std::size_t>(i)] || !fit::has_parameter(told.structure, i)) continue;
      const auto e = told.estimate(static_cast<fit::Parameter>(i));
      square[static_cast<std::size_t>(i)] += std::pow(e.std / e.value, 2);
    }
  }
  return std::sqrt(*std::max_element(square.begin(), square.end()) / static_cast<double>(drives.size()));
}

/// Length of the run that meets the targets.
std::optional<double> time_of(const PlanConfig& config) {
  const auto plan = plan_once(config);
  if (!plan || !plan->reached) return {};
  return plan->planned().duration_s;
}

}  // namespace

std::optional<TwoStagePlan> two_stages(const PlanConfig& config, const Plan& plan) {
  const auto& x = plan.planned();
  if (config.spread < kLeastSpread || x.type != ExcitationType::multisine) return {};
  const auto one_s = plan.reached ? std::optional(x.duration_s) : x.needed_s;
  if (!one_s || !(kFirstPart * *one_s <= config.limits.time_s)) return {};
  PlanConfig c = config;
  c.type = ExcitationType::multisine;
  c.progress = {};
  TwoStagePlan two;
  two.one_s = *one_s;
  c.limits.time_s = kFirstPart * *one_s;
  const auto first = plan_once(c);
  if (!first) return {};
  two.first_s = first->planned().duration_s;
  const double deviation =
      worst_deviation(possible_drives(config.drive, config.spread), first->planned().excitation);
  two.spread = 0.01 * std::ceil(200.0 * deviation);
  if (!(two.spread <= 0.5 * config.spread)) return {};
  c.limits.time_s = config.limits.time_s;
  if (!c.period_s) c.period_s = static_cast<double>(x.period_samples) * config.drive.model.sample_time_s;
  c.spread = 0.0;
  const auto known_s = time_of(c);
  c.spread = two.spread;
  const auto second_s = time_of(c);
  if (!known_s || !second_s) return {};
  c.spread = 0.0;
  double sum_s = 0.0;
  const auto drives = possible_drives(config.drive, config.spread);
  for (const auto& drive : drives) {
    c.drive = drive;
    const auto own_s = time_of(c);
    if (!own_s) return {};
    sum_s += *own_s;
  }
  two.second_s = *second_s / *known_s * sum_s / static_cast<double>(drives.size());
  if (two.total_s() > kClearly * two.one_s) return {};
  return two;
}

}  // namespace resonid::planning::detail
