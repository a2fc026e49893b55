// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/join.hpp>
#include <span>

namespace resonid::identification::detail {

/// One best linear approximation of several records, each one realisation or several.
struct PooledResponse {
  data::FrequencyResponse response;
  Distortion distortion;
};

/// Refused: records whose excitation has no period, another period than the first's, fewer than three of
/// them, or phases or lines that make no realisations (response::no_realisations()).
[[nodiscard]] expected<PooledResponse, Error> pooled_response(std::span<const data::Record> records,
                                                              const Options& options);

}  // namespace resonid::identification::detail
