// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <resonid/report/document.hpp>
#include <string>
#include <vector>

// Curves that the pages of several verbs draw.
namespace resonid::report {

/// Lowest and highest value per bin, drawn one after the other: every peak shows, whatever the length.
[[nodiscard]] Curve thinned(const std::string& name, const std::vector<double>& x, double start_s,
                            double rate_hz, Curve::Mark mark = Curve::Mark::line);

[[nodiscard]] Curve level_db(const std::string& name, const data::FrequencyResponse& g,
                             Curve::Mark mark = Curve::Mark::line);

}  // namespace resonid::report
