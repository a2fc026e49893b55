// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>

namespace resonid::identification {

/// Whether a result can be designed for by its response alone: it holds no drive model, and what is asked for
/// needs none.
[[nodiscard]] bool is_response_only(const Result& result, const TuneOptions& options);

/// A PI for every response within the error bars of all lines at once (docs/methods/tune.md 7.7): no steps,
/// no noise, nothing of the load but by its anti-resonance.
[[nodiscard]] expected<Tuning, Error> tune_by_response(const Result& result, const TuneOptions& options);

}  // namespace resonid::identification
