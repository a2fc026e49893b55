// SPDX-License-Identifier: MIT
#include <identification/track_discrete_maker.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>

namespace resonid::identification::detail {
namespace {

TrackerMade make_closed_loop(const Known<3>& k, bool filtered) {
  online::ClosedLoopOutputErrorConfig config;
  config.common = k.common();
  config.controller_numerator = k.numerator;
  config.controller_denominator = k.denominator;
  config.input = online::PredictorInput::measured;
  if (filtered) config.gradient = online::ClosedLoopGradient::fixed_filter;
  return made(online::ClosedLoopOutputError<double, 3>::create(config), k, true);
}

}  // namespace

TrackerMade make_closed_loop_tracker(const data::Record& record, const TrackOptions& options,
                                     const TrackPlan& plan) {
  const bool filtered = plan.method == TrackMethod::filtered_closed_loop_output_error;
  return make_closed_loop(known<3>(record, options, plan), filtered);
}

}  // namespace resonid::identification::detail
