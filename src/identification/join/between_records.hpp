// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/fit/drive_model.hpp>
#include <span>

namespace resonid::identification::detail {

/// The records' own models of one kind as the stretches of one record: the scatter of each parameter between
/// them, beyond their bars (DerSimonian and Laird 1986), widens the joint covariance where it is significant.
/// The finding tells the parameter that scatters most, as an error where one value does not describe the
/// machine.
[[nodiscard]] std::optional<diagnostics::Finding> include_scatter(std::span<const fit::DriveModel* const> own,
                                                                  fit::DriveModel& joint);

}  // namespace resonid::identification::detail
