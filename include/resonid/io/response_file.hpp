// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <string>

namespace resonid::io {

/// A frequency response as CSV text with the columns `frequency_hz,real,imag,std,coherence`; the last two are
/// left out when they are not known. Numbers are the shortest that read back to the same double.
[[nodiscard]] std::string response_csv(const data::FrequencyResponse& response);

}  // namespace resonid::io
