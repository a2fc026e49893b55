// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/plant/experiment.hpp>

namespace resonid::cli {

/// What was true of a simulated experiment, with the names of `identify --json` (INTERFACES, "simulate
/// --truth"). The known delay is no model parameter there: it stands beside the model as `delay_s`.
[[nodiscard]] nlohmann::json truth_json(const plant::Truth& truth);

}  // namespace resonid::cli
