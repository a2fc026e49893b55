// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/validate.hpp>

namespace resonid::identification::detail {

/// Findings, verdict and trust of a validation whose figures are there.
void judge(ModelValidation& validation);

/// Whether more than the recorded excitation drives the input.
[[nodiscard]] bool is_fed_back(const data::Record& record);

/// What was found of the record without a model, as identify() takes it where it has one: what the model
/// explains is no error, and what is wrong with response or controller alone is a warning. True where the
/// response is not one of the drive: then no model is to be held against it.
[[nodiscard]] bool speaks_of_response_alone(ModelValidation& validation);

}  // namespace resonid::identification::detail
