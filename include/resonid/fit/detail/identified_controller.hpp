// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>

namespace resonid::fit {

/// The controller that a record shows, from velocity error to torque: u, ru, r and y are all recorded, and
///
///   u - ru = C (r - y)
///
/// holds without any noise, so that least squares find C exactly (order 1 ... 4, the lowest that does; a
/// constant for an unrecorded constant reference). Nothing when no linear controller explains u - ru to 1e-5:
/// it limits, or follows a reference that was not recorded. Needs an excitation.
[[nodiscard]] std::optional<data::TransferFunction> identified_controller(const data::Record& record);

}  // namespace resonid::fit
