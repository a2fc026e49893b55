// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>

namespace resonid::cli {

/// In what the drive of a result takes torque and tells velocity: by its columns, and by the scales, units
/// and constants that the result stores. Where no unit is told, the column stands for it: "[iq]".
void put_own_units(const identification::Result& result, identification::Tuning& tuning);

}  // namespace resonid::cli
