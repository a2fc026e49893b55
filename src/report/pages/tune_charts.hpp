// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <resonid/report/detail/document.hpp>

// Pictures of the page of a tuning: the loop and its steps, the proposed controller before the running one.
namespace resonid::report {

/// |S| and |T_load| with their bounds; L over frequency and in the plane, |T|, |C S| and |S G|. Without
/// charts where there are no curves.
[[nodiscard]] Section sensitivity_section(const identification::Tuning& tuning);
[[nodiscard]] Section loop_section(const identification::Tuning& tuning);
/// Load after a torque step on it and after a step of the reference; torque after the latter.
[[nodiscard]] Section step_section(const identification::Tuning& tuning);
[[nodiscard]] Section torque_section(const identification::Tuning& tuning);
/// ki and the load's error over each bound.
[[nodiscard]] std::vector<Chart> trade_off_charts(const identification::Tuning& tuning);
[[nodiscard]] Section schedule_section(const identification::Tuning& tuning);
[[nodiscard]] Section simulated_section(const identification::Tuning& tuning);
/// L promised and measured.
[[nodiscard]] Section check_section(const identification::Tuning& tuning);

}  // namespace resonid::report
