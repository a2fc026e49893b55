// SPDX-License-Identifier: MIT
#include <resonid/online/models/closed_loop_output_error.hpp>

#include "model.hpp"

namespace resonid::c {
namespace {

template <std::size_t Order>
using ClosedLoopOutputError = online::ClosedLoopOutputError<double, Order>;

template <std::size_t Order>
expected<ClosedLoopOutputError<Order>, Error> make(const resonid_model_config& c) {
  const auto common = common_config(c);
  if (!common) return unexpected<Error>(common.error());
  const auto input = enumerator("predictor_input", c.predictor_input, online::PredictorInput::measured);
  if (!input) return unexpected<Error>(input.error());
  online::ClosedLoopOutputErrorConfig config;
  config.common = *common;
  config.controller_numerator = array(c.controller_numerator, c.controller_numerator_count);
  config.controller_denominator = array(c.controller_denominator, c.controller_denominator_count);
  config.input = *input;
  config.gradient = c.method == RESONID_CLOE     ? online::ClosedLoopGradient::regressor
                    : c.method == RESONID_F_CLOE ? online::ClosedLoopGradient::fixed_filter
                                                 : online::ClosedLoopGradient::damped_filter;
  config.filter_contraction = c.filter_contraction;
  config.largest_pole_radius = c.largest_pole_radius;
  return ClosedLoopOutputError<Order>::create(config);
}

template <std::size_t Order>
constexpr ModelOperations kOperations = OperationsOf<ClosedLoopOutputError<Order>, &make<Order>>::kTable;

constexpr ModelOperations kAll[] = {kOperations<1>, kOperations<2>, kOperations<3>,
                                    kOperations<4>, kOperations<5>, kOperations<6>};

}  // namespace

std::span<const ModelOperations> closed_loop_output_error_operations() noexcept { return kAll; }

}  // namespace resonid::c
