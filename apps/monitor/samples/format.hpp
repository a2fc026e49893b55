// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::monitor {

enum class SampleFormat : std::uint8_t { csv, json, line_protocol, frame };
inline constexpr EnumName<SampleFormat> kSampleFormatNames[] = {
    {SampleFormat::csv, "csv"},
    {SampleFormat::json, "json"},
    {SampleFormat::line_protocol, "line-protocol"},
    {SampleFormat::frame, "frame"}};
[[nodiscard]] constexpr std::span<const EnumName<SampleFormat>> enum_names(SampleFormat) noexcept {
  return kSampleFormatNames;
}

/// A column of LinuxCNC's sampler: how many samples found its FIFO full, and are not among those it numbers.
inline constexpr std::string_view kOverrunsColumn = "overruns";

/// How samples are written: as frames or as lines.
struct Format {
  SampleFormat kind = SampleFormat::csv;
  std::vector<std::string> columns = {};  ///< Of CSV lines; empty: a line with their names comes first.
  std::string axis = {};                  ///< Where neither a topic nor a line names one.
  /// CSV: the sample has 32 bits, with or without sign; given modulo 2^32, with kOverrunsColumn, where there
  /// is one, added.
  bool sample_wraps = false;
};

}  // namespace resonid::monitor
