// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::identification {

/// Holds a result against a record that it was not fitted to: validate() with the result's model, and every
/// kept structure simulated there, so that structures can be compared where none of them has been fitted.
/// Fills `independent` and `independent_fit_percent`. A model that is rejected there makes the result
/// untrusted (finding `fails-elsewhere`, an error); a doubtful one is a warning. Refused: a result without
/// model, and what validate() refuses.
[[nodiscard]] expected<void, Error> validate_on(const data::Record& record, const Options& options,
                                                Result& result);

}  // namespace resonid::identification
