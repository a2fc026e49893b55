// SPDX-License-Identifier: MIT
#include <resonid/online/models/closed_loop_output_error.hpp>

#include "model.hpp"

namespace resonid::c {
namespace {

template <std::size_t Order>
using ClosedLoopOutputError = online::ClosedLoopOutputError<double, Order>;

template <std::size_t Order>
expected<ClosedLoopOutputError<Order>> make(const resonid_model_settings& s) noexcept {
  const auto common = common_config(s);
  if (!common) return unexpected<Error>(common.error());
  const auto input = enumerator("predictor_input", s.predictor_input, online::PredictorInput::measured);
  if (!input) return unexpected<Error>(input.error());
  online::ClosedLoopOutputErrorConfig config;
  config.common = *common;
  config.controller_numerator = array(s.controller_numerator, s.controller_numerator_count);
  config.controller_denominator = array(s.controller_denominator, s.controller_denominator_count);
  config.input = *input;
  config.gradient = s.head.kind == RESONID_CLOE     ? online::ClosedLoopGradient::regressor
                    : s.head.kind == RESONID_F_CLOE ? online::ClosedLoopGradient::fixed_filter
                                                    : online::ClosedLoopGradient::damped_filter;
  config.filter_contraction = s.filter_contraction;
  config.largest_pole_radius = s.largest_pole_radius;
  return ClosedLoopOutputError<Order>::create(config);
}

template <std::size_t Order>
constexpr ModelOperations kOperations = ModelOperationsOf<ClosedLoopOutputError<Order>, &make<Order>>::kTable;

constexpr ModelOperations kAll[] = {kOperations<1>, kOperations<2>, kOperations<3>,
                                    kOperations<4>, kOperations<5>, kOperations<6>};

}  // namespace

std::span<const ModelOperations> closed_loop_output_error_operations() noexcept { return kAll; }

}  // namespace resonid::c
