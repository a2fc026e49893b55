// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <span>
#include <string>
#include <string_view>

namespace resonid::io {

/// A record as CSV text with the columns `time_s, ru, u, y, r, position`, those that are present. A unit
/// other than the SI one of the motion is added to the name (`u_V`, `u [ticks]`). Samples are the shortest
/// numbers that read back to the same double, so that read_record() gives the same record.
[[nodiscard]] std::string record_csv(const data::Record& record);

/// A further number per line.
struct ResponseColumn {
  std::string_view name;
  std::span<const double> values;  ///< [line]
};

/// A frequency response as CSV text with the columns `frequency_hz,real,imag,std,coherence`; the last two are
/// left out when they are not known. After them the `further` ones. Numbers are the shortest that read back
/// to the same double.
[[nodiscard]] std::string response_csv(const data::FrequencyResponse& response,
                                       std::span<const ResponseColumn> further = {});

}  // namespace resonid::io
