// SPDX-License-Identifier: MIT
#pragma once

#include <identification/measurement.hpp>

namespace resonid::identification::detail {

/// What was measured at the lines, and the response that it makes.
struct MeasuredResponse : Measured {
  data::FrequencyResponse response;
};

/// By the plan's method. Averages take for noise whatever does not repeat with the excitation, such as a
/// motion: where they leave next to nothing and the method is not asked for, local polynomials take its
/// smooth spectrum out, and plan and choice say so.
[[nodiscard]] expected<MeasuredResponse, Error> measure_response(const data::Record& record, Plan& plan,
                                                                 const Options& options,
                                                                 std::vector<Choice>& choices);

}  // namespace resonid::identification::detail
