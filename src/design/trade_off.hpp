// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <resonid/design/detail/bounds.hpp>
#include <resonid/design/detail/trade_off.hpp>
#include <span>
#include <vector>

#include "design/controller.hpp"
#include "design/machine.hpp"
#include "design/posterior.hpp"

// What a bound costs, and what is not known of the machine.
namespace resonid::design {

/// With the covariance as it is, a quarter of it (an experiment four times as long), and none: what a better
/// experiment would buy (docs/methods/tune.md 7.6); and with the covariance as it is but for a delay that is
/// known exactly. A delay's variance that is not of the fit stays what it is.
struct VarianceFactors {
  double all = 1.0, delay = 1.0;
};
using ValueAt = std::function<std::optional<ExperimentValue>(const VarianceFactors&)>;
/// `as_it_is`: a design that meets the bounds with the covariance as it is. One that suits all machines that
/// may be suits fewer of them too: a row of less uncertainty is the better of its own search and of what was
/// found for more. What has no solution is left out.
[[nodiscard]] std::vector<ExperimentValue> values_of_experiments(
    bool delay_is_told, const ValueAt& value_at, const std::optional<ExperimentValue>& as_it_is = {});
/// `proposed`: a PI behind these filters that meets the bounds at the radius.
[[nodiscard]] std::vector<ExperimentValue> value_of_experiment(const Posterior& posterior,
                                                               std::span<const Biquad> biquads,
                                                               const Bounds& bounds, double radius,
                                                               const FilteredPi* proposed = nullptr);

struct TradeOffs {
  std::vector<TradeOff> over_sensitivity;  ///< Bounds on |S| of 1.2 ... 2, all others as given.
  std::vector<TradeOff>
      over_load_transfer;  ///< Bounds on the load's transfer of 1.1 ... 2, all others as given.
};
/// What the next step of a bound costs or buys one controller for all machines, the error of the load being
/// their mean (docs/methods/tune.md 5.5). Bounds that no gain meets are left
/// out.
[[nodiscard]] TradeOffs trade_offs(const std::vector<Machine>& machines, std::span<const Biquad> biquads,
                                   const Bounds& bounds);

}  // namespace resonid::design
