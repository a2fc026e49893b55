// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <optional>
#include <resonid/design/detail/loop_figures.hpp>
#include <span>
#include <vector>

// Margins of a loop that is known on lines, each to a disk (docs/methods/tune.md 7.7).
namespace resonid::design {

/// At the lines as they are, and the least of every loop that goes through the disks at the lines.
struct LineMargin {
  double value = 0.0, worst = 0.0;
};
struct LineMargins {
  std::vector<Crossing> crossings;      ///< All of them, ascending, between the lines.
  std::vector<double> worst_deg;        ///< [crossing] Least phase margin there and at the lines beside it.
  std::optional<LineMargin> phase_deg;  ///< Least size over all crossings, as LoopFigures has it.
  std::optional<LineMargin> gain_db;    ///< Least factor > 1 at arg L = -180 deg.
  std::optional<LineMargin> delay_s;    ///< Least delay that takes a crossing to -1.
};

/// Of a loop at ascending frequencies with the radii of its disks. Between two lines L goes straight in size
/// (logarithmic) and angle, and its radius straight. Worst are 0 where a disk reaches -1; absent is what the
/// lines as they are do not have.
[[nodiscard]] LineMargins line_margins(std::span<const double> frequencies_hz,
                                       std::span<const std::complex<double>> loop,
                                       std::span<const double> radii);

}  // namespace resonid::design
