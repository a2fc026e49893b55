// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "design/posterior.hpp"
#include "identification/tune/figure_values.hpp"

namespace resonid::identification {

/// How bad every figure of one machine is, by severity_of(), in the order of figure_name(), others behind
/// them; NaN: not known. Nothing where its loop is unstable.
using SeveritiesOf = std::function<std::optional<std::vector<double>>(const design::Machine&)>;

/// How bad each is at the worst over an ellipsoid. Maxima over frequency are not looked for: worst_case()
/// does. Along the gradient at the nominal machine to the edge, and along that of the edge where the figure
/// is not as foreseen; the worst of all machines that were looked at counts (docs/methods/tune.md 7.2).
/// Absent: not known of every machine that was looked at; nothing at all where one of them is unstable.
[[nodiscard]] std::vector<std::optional<double>> worst_figures(const design::Posterior& posterior,
                                                               double radius,
                                                               const SeveritiesOf& severities_of);

/// The least bandwidth of the load over an ellipsoid; 0 where a machine has none, or its loop is unstable.
[[nodiscard]] double least_bandwidth_hz(const design::Posterior& posterior, double radius, const Law& law);

}  // namespace resonid::identification
