// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/fit/drive_model.hpp>

namespace resonid::fit::detail {

/// Start for a drive that the spring `ground` (kMotorGroundStiffness, kLoadGroundStiffness) ties to the
/// ground: a scan over the modes that compares magnitudes only, rigid drives by one resonance, two masses by
/// a resonance on the ground, an anti-resonance and the resonance above it, which either side's spring gives
/// alike. Begun without its spring such a drive is hardly ever found. Nothing for three masses.
[[nodiscard]] std::optional<DriveModel> grounded_start(const data::FrequencyResponse& response,
                                                       Structure structure, Parameter ground,
                                                       double sample_time_s);

}  // namespace resonid::fit::detail
