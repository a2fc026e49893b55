// SPDX-License-Identifier: MIT
#include <resonid/online/models/instrumental_variables.hpp>

#include "model.hpp"

namespace resonid::c {
namespace {

template <std::size_t Order>
using InstrumentalVariables = online::InstrumentalVariables<double, Order>;

template <std::size_t Order>
expected<InstrumentalVariables<Order>, Error> make(const resonid_model_config& c) {
  if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
    return refuse("sample_rate_hz", "must be > 0", c.sample_rate_hz);
  if (c.start_b == nullptr) return refuse("start_b", "must be given for the instruments");
  if (c.start_a == nullptr) return refuse("start_a", "must be given for the instruments");
  online::InstrumentalVariablesConfig<Order> config;
  std::copy_n(c.start_b, Order, config.start.b.begin());
  std::copy_n(c.start_a, Order, config.start.a.begin());
  config.controller_numerator = array(c.controller_numerator, c.controller_numerator_count);
  config.controller_denominator = array(c.controller_denominator, c.controller_denominator_count);
  config.delay_samples = c.delay_samples;
  config.refined = c.refined != 0;
  config.terms.fixed_integrator = c.fixed_integrator != 0;
  config.terms.offsets = c.offsets != 0;
  config.terms.coulomb = c.coulomb != 0;
  config.memory_samples = c.memory_samples;
  config.extrapolate = c.extrapolate != 0;
  config.start_deviation = c.start_deviation;
  config.largest_deviation = c.largest_deviation;
  config.noise_rms = c.noise_rms;
  config.refresh_samples = c.refresh_samples;
  auto made = InstrumentalVariables<Order>::create(config);
  if (!made && made.error().field == "start") made.error().field = "start_a";
  return made;
}

template <std::size_t Order>
constexpr ModelOperations kOperations = OperationsOf<InstrumentalVariables<Order>, &make<Order>>::kTable;

constexpr ModelOperations kAll[] = {kOperations<2>, kOperations<3>, kOperations<4>, kOperations<5>};

}  // namespace

std::span<const ModelOperations> instrumental_operations() noexcept { return kAll; }

}  // namespace resonid::c
