// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/prepare/excitation_source.hpp>
#include <optional>
#include <resonid/data/record.hpp>
#include <resonid/fit/detail/inverse_dynamics.hpp>
#include <resonid/identification/options.hpp>

namespace resonid::identification::detail {

/// Inverse dynamics of a record with a motion profile in the place of an excitation: inertia and friction
/// explain 90 % of the input, dry friction among them, and the input is no chirp and has more than two
/// levels. A repeated trajectory is no multisine: its few lines hold friction. Nothing where an excitation is
/// known or the options name one.
[[nodiscard]] std::optional<fit::InverseDynamics> motion_in(const data::Record& record,
                                                            ExcitationSource source, const Options& options);

}  // namespace resonid::identification::detail
