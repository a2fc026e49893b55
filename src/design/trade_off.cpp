// SPDX-License-Identifier: MIT
#include "design/trade_off.hpp"

#include <algorithm>

#include "design/closed_loop.hpp"
#include "design/robust.hpp"

namespace resonid::design {
namespace {

constexpr double kBoundStep = 0.1;

void add_trade_off(const std::vector<Machine>& machines, std::span<const Biquad> biquads,
                   const Bounds& bounds, std::vector<TradeOff>& curve) {
  Machines all(machines);
  const auto gains = largest_integral_gain(all, biquads, bounds);
  if (!gains) return;
  const FilteredPi controller{gains->kp, gains->ki, {biquads.begin(), biquads.end()}};
  TradeOff point{0.0, 0.0, gains->kp, gains->ki, 0.0};
  for (std::size_t i = 0; i < machines.size(); ++i) {
    const LoopFunctions loop(machines[i].response(), controller, machines[i].sample_time_s());
    const auto peaks =
        loop.largest_of({Transfer::sensitivity, Transfer::load_transfer}, all.lines[i].frequencies_hz());
    point.sensitivity = std::max(point.sensitivity, peaks[0].value);
    point.load_transfer = std::max(point.load_transfer, peaks[1].value);
    point.iae += load_step_iae(machines[i], controller) / static_cast<double>(machines.size());
  }
  point.sensitivity = bounds.sensitivity.value_or(point.sensitivity);
  point.load_transfer = bounds.load_transfer.value_or(point.load_transfer);
  curve.push_back(point);
}

}  // namespace

std::vector<ExperimentValue> values_of_experiments(bool delay_is_told, const ValueAt& value_at,
                                                   const std::optional<ExperimentValue>& as_it_is) {
  std::vector<VarianceFactors> list;
  for (const double factor : {1.0, 0.25, 0.0}) list.push_back({factor, delay_is_told ? 1.0 : factor});
  list.push_back({1.0, 0.0});
  std::vector<std::optional<ExperimentValue>> own;
  for (const auto& factors : list) own.push_back(value_at(factors));
  if (as_it_is && (!own.front() || as_it_is->iae < own.front()->iae)) own.front() = as_it_is;
  std::vector<ExperimentValue> values;
  for (std::size_t row = 0; row < list.size(); ++row) {
    auto best = own[row];
    for (std::size_t other = 0; other < list.size(); ++other) {
      const bool knows_less = list[other].all >= list[row].all && list[other].delay >= list[row].delay;
      if (knows_less && own[other] && (!best || own[other]->iae < best->iae)) best = own[other];
    }
    if (best) values.push_back({list[row].all, best->ki, best->iae, list[row].delay});
  }
  return values;
}

std::vector<ExperimentValue> value_of_experiment(const Posterior& posterior, std::span<const Biquad> biquads,
                                                 const Bounds& bounds, double radius,
                                                 const FilteredPi* proposed) {
  const Machine nominal(posterior.nominal(), posterior.known_to_hz());
  const auto value_of = [&](const FilteredPi& controller) {
    return ExperimentValue{1.0, controller.ki, load_step_iae(nominal, controller), 1.0};
  };
  const ValueAt value_at = [&](const VarianceFactors& factors) -> std::optional<ExperimentValue> {
    const auto design = robust_gains(posterior.scaled(factors.all, factors.delay), biquads, bounds, radius);
    if (!design) return std::nullopt;
    return value_of(design->controller);
  };
  std::optional<ExperimentValue> as_it_is;
  if (proposed != nullptr) as_it_is = value_of(*proposed);
  return values_of_experiments(posterior.delay_is_told(), value_at, as_it_is);
}

TradeOffs trade_offs(const std::vector<Machine>& machines, std::span<const Biquad> biquads,
                     const Bounds& bounds) {
  TradeOffs found;
  for (int i = 2; i <= 10; ++i) {
    Bounds other = bounds;
    other.sensitivity = 1.0 + kBoundStep * i;
    add_trade_off(machines, biquads, other, found.over_sensitivity);
  }
  for (int i = 1; i <= 10; ++i) {
    Bounds other = bounds;
    other.load_transfer = 1.0 + kBoundStep * i;
    add_trade_off(machines, biquads, other, found.over_load_transfer);
  }
  return found;
}

}  // namespace resonid::design
