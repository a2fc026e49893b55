// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <identification/track_discrete.hpp>
#include <identification/track_plan.hpp>

namespace resonid::identification::detail {

TrackerMade make_discrete_tracker(const data::Record&, const TrackOptions&, const TrackPlan& plan) {
  return tl::unexpected(Refusal{"method", fmt::format("{} is not built in", name_of(plan.method))});
}

}  // namespace resonid::identification::detail
