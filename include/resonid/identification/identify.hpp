// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::identification {

/// The main job: record in; response, resonances, model, loop and trust out.
///
/// 1. the method that fits the excitation measures Ru, U and Y at its lines (periodic averaging for what
/// repeats,
///    local polynomials for what does not, trackers on request);
/// 2. the physical models, rigid and two-mass, are fitted to the response and, from there, to the record
/// itself by
///    maximum likelihood; the Bayesian information criterion chooses;
/// 3. margins of the real loop, delay included, from the model and the controller, or from L = Ru/U - 1;
/// 4. findings say what to know, and whether to trust it.
[[nodiscard]] expected<Result, Error> identify(const data::Record& record, const Options& options = {});

}  // namespace resonid::identification
