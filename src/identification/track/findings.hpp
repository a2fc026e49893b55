// SPDX-License-Identifier: MIT
#pragma once

#include <identification/track/axis_setup.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <vector>

namespace resonid::identification::detail {

/// What the learning stretch has to say.
[[nodiscard]] std::vector<diagnostics::Finding> learning_findings(const TrackOptions& options,
                                                                  const TrackPlan& plan,
                                                                  const AxisSetup& setup);

/// What the rows that are counted have to say as a whole. `start_time_s` is the time of the first sample.
[[nodiscard]] std::vector<diagnostics::Finding> run_findings(const online::Axis& axis,
                                                             const online::AxisCounts& counts,
                                                             const TrackPlan& plan, const AxisSetup& setup,
                                                             double start_time_s);

/// Samples that are missing shift every later row.
[[nodiscard]] std::vector<diagnostics::Finding> gap_findings(const data::Record& record);

/// Rows since then.
[[nodiscard]] online::AxisCounts since(const online::AxisCounts& now, const online::AxisCounts& then);
[[nodiscard]] TrustShares shares_of(const online::AxisCounts& counts);

}  // namespace resonid::identification::detail
