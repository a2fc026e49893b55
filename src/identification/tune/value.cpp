// SPDX-License-Identifier: MIT
#include "identification/tune/value.hpp"

#include <cmath>

#include "design/figures.hpp"
#include "design/filter_search.hpp"
#include "design/robust.hpp"
#include "design/shaper_choice.hpp"

namespace resonid::identification {
namespace {

constexpr std::size_t kShaperDraws = 500;

std::vector<TradeOff> trade_offs(const design::Machine& machine, const std::vector<design::Bounds>& list) {
  std::vector<TradeOff> curve;
  design::Machines machines({machine});
  for (const auto& bounds : list) {
    const auto gains = largest_integral_gain(machines, {}, bounds);
    if (!gains) continue;
    const double iae = load_step_iae(machine, {gains->kp, gains->ki, {}});
    curve.push_back(
        {*bounds.sensitivity, bounds.load_transfer.value_or(HUGE_VAL), gains->kp, gains->ki, iae});
  }
  return curve;
}

}  // namespace

void add_value(Tuning& tuning, const design::Posterior& posterior, const design::Bounds& bounds) {
  const design::Machine machine(posterior.nominal());
  std::vector<design::Bounds> list;
  for (const double ms : {1.1, 1.15, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.5}) {
    list.push_back(bounds);
    list.back().sensitivity = ms;
  }
  tuning.over_sensitivity = trade_offs(machine, list);
  list.clear();
  for (const double load : {1.02, 1.05, 1.1, 1.2, 1.3, 1.4, 1.5, 1.7, 2.0, 2.5}) {
    list.push_back(bounds);
    list.back().load_transfer = load;
  }
  tuning.over_load_transfer = trade_offs(machine, list);
  const auto& proposed = tuning.proposed();
  if (!proposed.gains || proposed.position_gain || proposed.derivative_gain) return;
  const auto& biquads = proposed.gains->biquads;
  const double radius = proposed.radius > 0.0 ? proposed.radius : 2.0;
  for (const double factor : {1.0, 0.25, 0.0}) {
    std::optional<design::FilteredPi> found;
    if (factor > 0.0) {
      if (auto robust = robust_gains(posterior.scaled(factor), biquads, bounds, radius))
        found = std::move(robust->controller);
    } else {
      design::Machines machines({machine});
      if (const auto gains = largest_integral_gain(machines, biquads, bounds))
        found = design::FilteredPi{gains->kp, gains->ki, biquads};
    }
    if (found) tuning.experiment.push_back({factor, found->ki, load_step_iae(machine, *found)});
  }
}

void add_shapers(Tuning& tuning, const std::vector<design::Posterior>& posteriors) {
  const auto& proposed = tuning.proposed();
  if (!proposed.gains || proposed.position_gain || proposed.derivative_gain) return;
  std::vector<design::ModesOfDraw> draws;
  for (const auto& posterior : posteriors) {
    const auto modes = shaped_modes(posterior, *proposed.gains, kShaperDraws, tuning.options.seed);
    draws.resize(std::max(draws.size(), modes.size()));
    for (std::size_t i = 0; i < modes.size(); ++i)
      draws[i].insert(draws[i].end(), modes[i].begin(), modes[i].end());
  }
  const auto middle = middle_mode(draws);
  if (!middle) return;
  const auto choice =
      choose_shaper({*middle}, draws, {tuning.options.shaper_limit, 0.95, tuning.sample_time_s});
  if (!choice) return;
  for (std::size_t i = 0; i < choice->candidates.size(); ++i) {
    const auto& c = choice->candidates[i];
    tuning.shapers.push_back({std::string(name_of(c.kinds.front())), c.shaper.duration_s(), c.quantile,
                              choice->chosen == i, c.shaper.amplitudes, c.shaper.times_s});
  }
  tuning.shaped_mode = design::ClosedLoopMode{middle->frequency_hz, middle->damping_ratio};
}

}  // namespace resonid::identification
