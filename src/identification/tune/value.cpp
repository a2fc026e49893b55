// SPDX-License-Identifier: MIT
#include "identification/tune/value.hpp"

#include <algorithm>

#include "design/shaper_choice.hpp"
#include "design/trade_off.hpp"

namespace resonid::identification {
namespace {

constexpr std::size_t kShaperDraws = 500;

}  // namespace

void add_value(Tuning& tuning, const design::Posterior& posterior, const design::Bounds& bounds) {
  const auto curves = design::trade_offs(design::Machine(posterior.nominal()), {}, bounds);
  tuning.over_sensitivity = curves.over_sensitivity;
  tuning.over_load_transfer = curves.over_load_transfer;
  const auto& proposed = tuning.proposed();
  if (!proposed.gains || proposed.position_gain || proposed.derivative_gain) return;
  tuning.experiment =
      design::value_of_experiment(posterior, proposed.gains->biquads, bounds, proposed.radius);
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
