// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <span>
#include <string_view>

namespace resonid::online {

/// Which multiples of its base frequency a multisine leaves out, so that the drive's answer there shows
/// non-linear distortion (docs/methods/detection_lines.md).
enum class DetectionLines { nothing, even, odd_random };
inline constexpr EnumName<DetectionLines> kDetectionLinesNames[] = {
    {DetectionLines::nothing, "nothing"},
    {DetectionLines::even, "even"},
    {DetectionLines::odd_random, "odd-random"}};
[[nodiscard]] constexpr std::span<const EnumName<DetectionLines>> enum_names(DetectionLines) noexcept {
  return kDetectionLinesNames;
}

struct DetectionLinesConfig {
  double sample_rate_hz = 0.0;             ///< > 0.
  std::span<const double> frequency_hz{};  ///< [line], ascending, > 0 and below half the sample rate.
  DetectionLines detection_lines = DetectionLines::nothing;
  std::uint64_t group = 4;  ///< Odd lines of which one is left out, >= 2.
  std::uint64_t seed = 1;   ///< Seed of that choice; its draws are not those of the phases.
};

/// Marks the lines that stay. The base frequency is that of the common period, fs/N. odd_random leaves out
/// one of every `group` odd lines in ascending order; a last group that is not whole keeps all. Refused:
/// lines without common period, or with no odd multiple among them. `kept`: [line]. Source: Pintelon and
/// Schoukens 2012, 4.3.2.
[[nodiscard]] expected<void, Error> mark_kept_lines(const DetectionLinesConfig& config,
                                                    std::span<bool> kept) noexcept;

}  // namespace resonid::online
