// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <identification/track_discrete_maker.hpp>

namespace resonid::identification::detail {

TrackerMade make_discrete_tracker(const data::Record& record, const TrackOptions& options,
                                  const TrackPlan& plan) {
  const auto needs = [&](const char* what) {
    return tl::unexpected(
        Error{"method", fmt::format("{} needs {} to begin with, and the record shows none: give .start",
                                    name_of(plan.method), what)});
  };
  if (!plan.start) return needs("a model");
  if (plan.method == TrackMethod::arx) return make_arx_tracker(record, options, plan);
  if (plan.method == TrackMethod::instrumental_variables)
    return make_instrumental_tracker(record, options, plan);
  if (is_rigid(plan)) return needs("a two-mass model");
  if (plan.method == TrackMethod::output_error) return make_output_error_tracker(record, options, plan);
  return make_closed_loop_tracker(record, options, plan);
}

}  // namespace resonid::identification::detail
