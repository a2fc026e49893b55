// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/identification/result.hpp>
#include <string>
#include <vector>

namespace resonid::identification {

/// One scalar of a result: what tables of several results and intervals of the bootstrap are about.
struct Figure {
  std::string name;  ///< "resonance_hz", "stiffness", "phase_margin_deg"; the second of a kind "..._2".
  std::string unit;  ///< "Nm/rad"; empty for plain numbers.
  double value = 0.0;
  std::optional<double> std;  ///< Finite and > 0; absent: not known.
};

/// Resonances (frequency, damping ratio), estimated parameters and margins of a result, in this order. What
/// the result does not have is not in the list.
[[nodiscard]] std::vector<Figure> figures(const Result& result);

/// Unit of a parameter of the drive.
[[nodiscard]] std::string unit_of(fit::Parameter parameter, const Units& units);

/// The figure of that name.
[[nodiscard]] const Figure* find(const std::vector<Figure>& figures, const std::string& name);

}  // namespace resonid::identification
