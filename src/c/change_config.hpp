// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/c/detail/supervision.h>

#include <resonid/online/supervision/change_detection.hpp>

#include "handle.hpp"

namespace resonid::c {

static_assert(static_cast<std::uint32_t>(online::ChangeStatistic::likelihood_ratio) ==
              type_of(RESONID_LIKELIHOOD_RATIO));

struct ChangeDefaults {
  using Settings = resonid_change_settings;
  static Settings defaults(std::uint32_t) noexcept {
    const online::ChangeDetectorConfig d;
    Settings s{};
    s.reference = d.reference;
    s.window_blocks = static_cast<std::uint32_t>(d.window_blocks);
    return s;
  }
};

/// `kind` of the settings: a kind of this family.
[[nodiscard]] inline online::ChangeDetectorConfig change_config(const resonid_change_settings& s) noexcept {
  const auto statistic = type_of(s.head.kind) == type_of(RESONID_CUSUM)
                             ? online::ChangeStatistic::cusum
                             : online::ChangeStatistic::likelihood_ratio;
  return {s.sample_rate_hz, s.block_s,   s.baseline_s,   s.false_alarm_interval_s,
          statistic,        s.reference, s.window_blocks};
}

}  // namespace resonid::c
