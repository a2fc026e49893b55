// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "monitoring/response_curve.hpp"

namespace resonid::monitor {

/// Response and standard deviation of a curve as they stand in BaselineRecord::bytes, for whatever version
/// comes later; nothing for a curve without points. The loop is left out: its controller may be another one
/// by then.
[[nodiscard]] std::vector<std::byte> curve_bytes(const monitoring::ResponseCurve& curve);

/// Nothing where the bytes are not those of a curve.
[[nodiscard]] std::optional<monitoring::ResponseCurve> curve_of(std::span<const std::byte> bytes);

}  // namespace resonid::monitor
