// SPDX-License-Identifier: MIT
#include <identification/track_discrete_maker.hpp>
#include <resonid/online/models/instrumental_variables.hpp>

namespace resonid::identification::detail {
namespace {

template <std::size_t Order>
TrackerMade make_instrumental(const Known<Order>& k) {
  online::InstrumentalVariablesConfig<Order> config;
  config.start.b = k.b;
  config.start.a = k.a;
  config.controller_numerator = k.numerator;
  config.controller_denominator = k.denominator;
  config.delay_samples = k.delay_samples;
  config.terms.fixed_integrator = k.integrator;
  if (k.memory_given) config.memory_samples = k.memory_samples;
  return made(online::InstrumentalVariables<double, Order>::create(config), k, true);
}

}  // namespace

TrackerMade make_instrumental_tracker(const data::Record& record, const TrackOptions& options,
                                      const TrackPlan& plan) {
  if (is_rigid(plan)) return make_instrumental(known<1>(record, options, plan));
  return make_instrumental(known<3>(record, options, plan));
}

}  // namespace resonid::identification::detail
