// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <span>
#include <string>
#include <string_view>

namespace resonid::io {

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
