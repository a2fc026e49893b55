// SPDX-License-Identifier: MIT
#include "design/trade_off.hpp"

#include <array>

#include "design/closed_loop.hpp"
#include "design/robust.hpp"

namespace resonid::design {
namespace {

constexpr double kBoundStep = 0.1;

void add_trade_off(const Machine& machine, std::span<const Biquad> biquads, const Bounds& bounds,
                   std::vector<TradeOff>& curve) {
  Machines alone({machine});
  const auto gains = largest_integral_gain(alone, biquads, bounds);
  if (!gains) return;
  const FilteredPi controller{gains->kp, gains->ki, {biquads.begin(), biquads.end()}};
  const LoopFunctions loop(machine.response(), controller, machine.sample_time_s());
  const auto peaks =
      loop.largest_of({Transfer::sensitivity, Transfer::load_transfer}, alone.lines.front().frequencies_hz());
  curve.push_back({bounds.sensitivity.value_or(peaks[0].value), bounds.load_transfer.value_or(peaks[1].value),
                   gains->kp, gains->ki, load_step_iae(machine, controller)});
}

}  // namespace

std::vector<VarianceFactors> variances_of_experiments(bool delay_is_told) {
  std::vector<VarianceFactors> list;
  for (const double factor : {1.0, 0.25, 0.0}) list.push_back({factor, delay_is_told ? 1.0 : factor});
  list.push_back({1.0, 0.0});
  return list;
}

std::vector<ExperimentValue> value_of_experiment(const Posterior& posterior, std::span<const Biquad> biquads,
                                                 const Bounds& bounds, double radius) {
  const Machine nominal(posterior.nominal(), posterior.known_to_hz());
  std::vector<ExperimentValue> values;
  for (const auto& factors : variances_of_experiments(posterior.delay_is_told())) {
    const auto design = robust_gains(posterior.scaled(factors.all, factors.delay), biquads, bounds, radius);
    if (design)
      values.push_back(
          {factors.all, design->controller.ki, load_step_iae(nominal, design->controller), factors.delay});
  }
  return values;
}

TradeOffs trade_offs(const Machine& machine, std::span<const Biquad> biquads, const Bounds& bounds) {
  TradeOffs found;
  for (int i = 2; i <= 10; ++i) {
    Bounds other = bounds;
    other.sensitivity = 1.0 + kBoundStep * i;
    add_trade_off(machine, biquads, other, found.over_sensitivity);
  }
  for (int i = 1; i <= 10; ++i) {
    Bounds other = bounds;
    other.load_transfer = 1.0 + kBoundStep * i;
    add_trade_off(machine, biquads, other, found.over_load_transfer);
  }
  return found;
}

}  // namespace resonid::design
