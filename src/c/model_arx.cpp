// SPDX-License-Identifier: MIT
#include <resonid/online/models/arx.hpp>

#include "model.hpp"

namespace resonid::c {
namespace {

template <std::size_t Order>
using Arx = online::Arx<double, Order>;

template <std::size_t Order>
expected<Arx<Order>> make(const resonid_model_settings& s) noexcept {
  const auto common = common_config(s);
  if (!common) return unexpected<Error>(common.error());
  return Arx<Order>::create({*common, s.load_torque != 0, s.coulomb != 0});
}

template <std::size_t Order>
constexpr ModelOperations kOperations = ModelOperationsOf<Arx<Order>, &make<Order>>::kTable;

constexpr ModelOperations kAll[] = {kOperations<1>, kOperations<2>, kOperations<3>,
                                    kOperations<4>, kOperations<5>, kOperations<6>};

}  // namespace

std::span<const ModelOperations> arx_operations() noexcept { return kAll; }

}  // namespace resonid::c
