// SPDX-License-Identifier: MIT
#include <identification/track_discrete_maker.hpp>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/output_error.hpp>

namespace resonid::identification::detail {
namespace {

template <std::size_t Order>
TrackerMade make_arx(const Known<Order>& k) {
  online::ArxConfig config;
  config.common = k.common();
  config.load_torque = true;
  return made(online::Arx<double, Order>::create(config), k, false);
}

template <std::size_t Order>
TrackerMade make_output_error(const Known<Order>& k) {
  online::OutputErrorConfig config;
  config.common = k.common();
  config.load_torque = true;
  config.controller_numerator = k.numerator;
  config.controller_denominator = k.denominator;
  return made(online::OutputError<double, Order>::create(config), k, true);
}

}  // namespace

TrackerMade make_arx_tracker(const data::Record& record, const TrackOptions& options, const TrackPlan& plan) {
  if (is_rigid(plan)) return make_arx(known<1>(record, options, plan));
  return make_arx(known<3>(record, options, plan));
}

TrackerMade make_output_error_tracker(const data::Record& record, const TrackOptions& options,
                                      const TrackPlan& plan) {
  return make_output_error(known<3>(record, options, plan));
}

}  // namespace resonid::identification::detail
