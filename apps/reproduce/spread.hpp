// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/report/detail/document.hpp>
#include <string>
#include <vector>

namespace resonid::reproduction {

/// Mean and standard deviation (n - 1; 0 for a single value) of the finite ones among some values, and how
/// many were not finite: a run whose curve does not show a quantity. The mean of none is not a number.
struct Spread {
  double mean = 0.0;
  double deviation = 0.0;
  std::size_t values = 0;   ///< All that were given.
  std::size_t missing = 0;  ///< Those of them that were not finite, and are in neither figure.
};
[[nodiscard]] Spread spread(const std::vector<double>& values);

/// A line of a table: of a single run, or over seeds. What is missing is told in the note, never left out
/// silently.
[[nodiscard]] report::Comparison row(std::string quantity, std::string unit, double reproduced,
                                     std::optional<double> truth = {}, std::optional<double> published = {},
                                     std::string note = {});
[[nodiscard]] report::Comparison row(std::string quantity, std::string unit, const Spread& reproduced,
                                     std::optional<double> truth = {}, std::optional<double> published = {},
                                     std::string note = {});

}  // namespace resonid::reproduction
