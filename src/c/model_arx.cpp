// SPDX-License-Identifier: MIT
#include <resonid/online/models/arx.hpp>

#include "model.hpp"

namespace resonid::c {
namespace {

template <std::size_t Order>
using Arx = online::Arx<double, Order>;

template <std::size_t Order>
expected<Arx<Order>, Error> make(const resonid_model_config& c) {
  const auto common = common_config(c);
  if (!common) return unexpected<Error>(common.error());
  return Arx<Order>::create({*common, c.load_torque != 0, c.coulomb != 0});
}

template <std::size_t Order>
constexpr ModelOperations kOperations = OperationsOf<Arx<Order>, &make<Order>>::kTable;

constexpr ModelOperations kAll[] = {kOperations<1>, kOperations<2>, kOperations<3>,
                                    kOperations<4>, kOperations<5>, kOperations<6>};

}  // namespace

std::span<const ModelOperations> arx_operations() noexcept { return kAll; }

}  // namespace resonid::c
