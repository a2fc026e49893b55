// SPDX-License-Identifier: MIT
#include <resonid/online/models/instrumental_variables.hpp>

#include "model.hpp"

namespace resonid::c {
namespace {

template <std::size_t Order>
using InstrumentalVariables = online::InstrumentalVariables<double, Order>;

template <std::size_t Order>
expected<InstrumentalVariables<Order>> make(const resonid_model_settings& s) noexcept {
  if (!(s.sample_rate_hz > 0.0) || !std::isfinite(s.sample_rate_hz))
    return refuse("sample_rate_hz", "must be > 0", s.sample_rate_hz);
  if (s.start_b == nullptr) return refuse("start_b", "must be given for the instruments");
  if (s.start_a == nullptr) return refuse("start_a", "must be given for the instruments");
  online::InstrumentalVariablesConfig<Order> config;
  std::copy_n(s.start_b, Order, config.start.b.begin());
  std::copy_n(s.start_a, Order, config.start.a.begin());
  config.controller_numerator = array(s.controller_numerator, s.controller_numerator_count);
  config.controller_denominator = array(s.controller_denominator, s.controller_denominator_count);
  config.delay_samples = s.delay_samples;
  config.refined = s.refined != 0;
  config.terms.fixed_integrator = s.fixed_integrator != 0;
  config.terms.offsets = s.offsets != 0;
  config.terms.coulomb = s.coulomb != 0;
  config.memory_samples = s.memory_samples;
  config.extrapolate = s.extrapolate != 0;
  config.start_deviation = s.start_deviation;
  config.largest_deviation = s.largest_deviation;
  config.noise_rms = s.noise_rms;
  config.refresh_samples = s.refresh_samples;
  auto made = InstrumentalVariables<Order>::create(config);
  if (!made && made.error().field == "start") made.error().field = "start_a";
  return made;
}

template <std::size_t Order>
constexpr ModelOperations kOperations = ModelOperationsOf<InstrumentalVariables<Order>, &make<Order>>::kTable;

constexpr ModelOperations kAll[] = {kOperations<2>, kOperations<3>, kOperations<4>, kOperations<5>};

}  // namespace

std::span<const ModelOperations> instrumental_operations() noexcept { return kAll; }

}  // namespace resonid::c
