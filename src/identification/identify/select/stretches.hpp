// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/record.hpp>
#include <vector>

namespace resonid::identification::detail {

/// Samples beyond which a model is chosen on stretches of a record and then fitted to all of it.
inline constexpr std::size_t kChosenOnStretches = 150'000;

/// Stretches evenly over a record, together some 65 000 samples. Of a slow sweep more and shorter ones, so
/// that it is met at many of its frequencies, each of two periods of the lowest at least.
[[nodiscard]] std::vector<data::Record> stretches_of(const data::Record& record, double low_hz, bool sweeps);

}  // namespace resonid::identification::detail
