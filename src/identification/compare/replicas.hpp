// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <resonid/identification/compare.hpp>

namespace resonid::identification::detail {

/// Interval of a change from the replicas of both results, taken in pairs; nothing where one has none.
[[nodiscard]] std::optional<std::pair<double, double>> interval_of(const Difference& difference,
                                                                   const Result& first, const Result& second,
                                                                   double confidence);

/// Distance of two models; nothing where it is not defined.
using ModelGap = std::function<std::optional<double>(const fit::DriveModel&, const fit::DriveModel&)>;

/// `gap` in repetitions of both experiments. On one machine: the second experiment's deviations from its
/// model, relative for the positive parameters, are put onto the first model. Both results have a model of
/// one structure; nothing unless both have been bootstrapped with the same parameters.
[[nodiscard]] std::optional<GapBootstrap> bootstrapped(const ModelGap& gap, const Result& first,
                                                       const Result& second, double confidence);

}  // namespace resonid::identification::detail
