// SPDX-License-Identifier: MIT
#include <resonid/online/models/output_error.hpp>

#include "model.hpp"

namespace resonid::c {
namespace {

template <std::size_t Order>
using OutputError = online::OutputError<double, Order>;

template <std::size_t Order>
expected<OutputError<Order>> make(const resonid_model_settings& s) noexcept {
  constexpr std::uint32_t kMost = online::ControllerCoefficients::kMaxOrder + 1;
  if (s.controller_numerator_count > kMost)
    return refuse("controller_numerator_count", "must be at most 5", s.controller_numerator_count);
  if (s.controller_denominator_count > kMost)
    return refuse("controller_denominator_count", "must be at most 5", s.controller_denominator_count);
  const auto common = common_config(s);
  if (!common) return unexpected<Error>(common.error());
  online::OutputErrorConfig config;
  config.common = *common;
  config.gradient = s.head.kind == RESONID_OE_FILTERED ? online::OutputErrorGradient::filtered
                                                       : online::OutputErrorGradient::regressor;
  config.filter_contraction = s.filter_contraction;
  config.largest_pole_radius = s.largest_pole_radius;
  config.load_torque = s.load_torque != 0;
  config.controller_numerator = array(s.controller_numerator, s.controller_numerator_count);
  config.controller_denominator = array(s.controller_denominator, s.controller_denominator_count);
  return OutputError<Order>::create(config);
}

template <std::size_t Order>
constexpr ModelOperations kOperations = ModelOperationsOf<OutputError<Order>, &make<Order>>::kTable;

constexpr ModelOperations kAll[] = {kOperations<1>, kOperations<2>, kOperations<3>, kOperations<4>,
                                    kOperations<5>};

}  // namespace

std::span<const ModelOperations> output_error_operations() noexcept { return kAll; }

}  // namespace resonid::c
