// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <iterator>
#include <resonid/io/csv.hpp>

namespace resonid::io {

std::string response_csv(const data::FrequencyResponse& response, std::span<const ResponseColumn> further) {
  const bool with_std = !response.std.empty();
  const bool with_coherence = !response.coherence.empty();
  std::string text = "frequency_hz,real,imag";
  if (with_std) text += ",std";
  if (with_coherence) text += ",coherence";
  for (const auto& column : further) fmt::format_to(std::back_inserter(text), ",{}", column.name);
  text += '\n';
  auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < response.lines(); ++i) {
    fmt::format_to(out, "{},{},{}", response.frequency_hz[i], response.value[i].real(),
                   response.value[i].imag());
    if (with_std) fmt::format_to(out, ",{}", response.std[i]);
    if (with_coherence) fmt::format_to(out, ",{}", response.coherence[i]);
    for (const auto& column : further) fmt::format_to(out, ",{}", column.values[i]);
    text += '\n';
  }
  return text;
}

}  // namespace resonid::io
