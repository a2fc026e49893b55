// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/design/detail/loop_figures.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "identification/tune/law.hpp"

namespace resonid::identification {

/// A figure of one machine; of an unstable loop some mean nothing and are absent.
struct FigureValue {
  std::optional<double> value = {};
  std::optional<double> frequency_hz = {};
};

/// Every figure of docs/methods/tune.md 2.1 in the order of figure_name(): maxima over frequency in that of
/// design::kTransfers first. `figures`: those of the machine's velocity loop.
[[nodiscard]] std::vector<FigureValue> figure_values(const design::LoopFigures& figures,
                                                     const design::Machine& machine, const Law& law,
                                                     const StepResponses& steps, double reference_step);

/// "rad/s" -> "rad"
[[nodiscard]] std::string place_unit(const std::string& velocity);

/// "sensitivity_peak", "phase_margin_deg" ...
[[nodiscard]] std::string_view figure_name(std::size_t index);
[[nodiscard]] std::size_t figure_count();
[[nodiscard]] std::size_t figure_index(std::string_view name);
/// Larger where a figure is worse: its value; of a margin, crossover or bandwidth the opposite; of a phase
/// margin, which is the nearest on either side, that of its size.
[[nodiscard]] double severity_of(std::size_t index, double value);
/// The figure of that severity; a phase margin on the side of another one.
[[nodiscard]] double value_of_severity(std::size_t index, double severity, double beside);
/// What a figure is where a machine has none: margins without a crossing are infinite, others not known.
[[nodiscard]] double absent_value(std::size_t index);
/// As sentences name it: "settling of the load", "|T_load|"; of one that sentences do not name its own, with
/// spaces.
[[nodiscard]] std::string figure_words(std::string_view name);
[[nodiscard]] std::string figure_unit(std::size_t index, const TunedController& controller,
                                      const Units& units);

}  // namespace resonid::identification
