// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <identification/track/axis_setup.hpp>
#include <optional>
#include <resonid/diagnostics/finding.hpp>
#include <vector>

namespace resonid::identification::detail {

/// What the learning stretch has to say.
[[nodiscard]] std::vector<diagnostics::Finding> learning_findings(const TrackOptions& options,
                                                                  const TrackPlan& plan,
                                                                  const AxisSetup& setup);

/// Rows in which it was seen whether the controller given is the one that runs.
struct ControllerRows {
  std::uint64_t seen = 0, differing = 0;
  std::optional<double> difference;  ///< Of the newest differing row that knows how large it is.

  void add(const online::AxisRow& row);
};

/// What the rows that are counted have to say as a whole. `start_time_s` is the time of the first sample.
[[nodiscard]] std::vector<diagnostics::Finding> run_findings(const online::Axis& axis,
                                                             const online::AxisCounts& counts,
                                                             const ControllerRows& controller,
                                                             const TrackPlan& plan, const AxisSetup& setup,
                                                             double start_time_s);

/// Samples that are missing shift every later row.
[[nodiscard]] std::vector<diagnostics::Finding> gap_findings(const data::Record& record);

/// Rows since then.
[[nodiscard]] online::AxisCounts since(const online::AxisCounts& now, const online::AxisCounts& then);
[[nodiscard]] TrustShares shares_of(const online::AxisCounts& counts);

}  // namespace resonid::identification::detail
