// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/select/select.hpp>

namespace resonid::identification::detail {

/// How well the model reproduces what it was fitted to: the record, with its residual, else the lines.
/// Nothing without a model, or where a corrected response left lines out.
void put_validation(const data::Record& record, const response::LineEstimates& lines, Fitted fitted,
                    Result& result);

}  // namespace resonid::identification::detail
