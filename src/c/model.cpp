// SPDX-License-Identifier: MIT
#include "model.hpp"

#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/detail/instrumental_variables_config.hpp>
#include <resonid/online/models/output_error.hpp>

namespace resonid::c {
namespace {

constexpr std::uint32_t kOrders = 16;  // variant = method class * kOrders + place in its table

std::span<const ModelOperations> table(std::uint32_t method_class) noexcept {
  switch (method_class) {
    case 0:
      return arx_operations();
    case 1:
      return output_error_operations();
    case 2:
      return closed_loop_output_error_operations();
    case 3:
      return instrumental_operations();
    default:
      return {};
  }
}
std::uint32_t class_of(std::uint32_t method) noexcept {
  if (method <= RESONID_ARX) return 0;
  if (method <= RESONID_OE_FILTERED) return 1;
  return method <= RESONID_CLOE_DAMPED ? 2 : 3;
}
const ModelOperations* operations(std::uint32_t variant) noexcept {
  const auto all = table(variant / kOrders);
  const std::size_t place = variant % kOrders;
  return place < all.size() ? &all[place] : nullptr;
}

resonid_model_config model_defaults(std::uint32_t method) noexcept {
  const online::ClosedLoopOutputErrorConfig closed;
  const online::RecursiveLeastSquaresConfig& r = closed.common.adaptation;
  const online::InstrumentalVariablesConfig<3> iv;
  resonid_model_config c{};
  c.method = method;
  c.order = 3;
  c.fixed_integrator = method == RESONID_IV && iv.terms.fixed_integrator ? 1 : 0;
  c.forgetting = static_cast<std::uint32_t>(r.forgetting);
  c.hold_below = closed.common.hold_below;
  c.start_variance = r.start_variance;
  c.factor = r.factor;
  c.smallest_factor = r.smallest_factor;
  c.noise_variance = r.noise_variance;
  c.largest_variance = r.largest_variance;
  c.smallest_variance = r.smallest_variance;
  c.filter_contraction = closed.filter_contraction;
  c.largest_pole_radius = closed.largest_pole_radius;
  c.refined = iv.refined ? 1 : 0;
  c.offsets = iv.terms.offsets ? 1 : 0;
  c.start_deviation = iv.start_deviation;
  c.largest_deviation = iv.largest_deviation;
  return c;
}

struct Models {
  using Config = resonid_model_config;
  using Handle = resonid_model;

  static Config defaults_for(const Config* given) noexcept { return model_defaults(second_field(given)); }
  static expected<std::uint32_t, Error> variant(const Config& c) noexcept {
    if (c.method > RESONID_IV) return refuse("method", "must be one of its constants", c.method);
    const std::uint32_t method_class = class_of(c.method);
    const auto all = table(method_class);
    if (c.order < all.front().order || c.order > all.back().order)
      return refuse("order", "must be one that the method has", c.order);
    return method_class * kOrders + (c.order - all.front().order);
  }
  static std::size_t size(std::uint32_t variant) noexcept { return operations(variant)->size; }
  static expected<void, Error> build(void* memory, std::uint32_t variant, const Config& c) noexcept {
    return operations(variant)->build(memory, variant, c);
  }

  /// f(operations, handle) gives a status.
  template <class F>
  static resonid_status visit(const void* handle, F&& f) noexcept {
    if (const resonid_status status = check_handle(handle, RESONID_FAMILY_MODEL)) return status;
    const Header& h = *static_cast<const Header*>(handle);
    const ModelOperations* found = operations(h.variant);
    const bool known = found != nullptr && found->size == h.size;
    return known ? f(*found, const_cast<void*>(handle)) : RESONID_ERROR_HANDLE;
  }
};

resonid_status modes(const resonid_model* handle, bool anti, resonid_mode* mode, std::size_t room,
                     std::size_t* count) noexcept {
  if (count == nullptr || (mode == nullptr && room > 0)) return RESONID_ERROR_NULL;
  return Models::visit(handle, [&](const ModelOperations& o, void* h) {
    *count = o.modes(h, anti, mode, room);
    return RESONID_OK;
  });
}

}  // namespace
}  // namespace resonid::c

using resonid::c::ModelOperations;
using resonid::c::Models;

resonid_status resonid_model_defaults(resonid_model_config* config, size_t struct_size,
                                      uint32_t method) noexcept {
  if (method > RESONID_IV) return RESONID_ERROR_RANGE;
  return resonid::c::give_defaults(resonid::c::model_defaults(method), config, struct_size);
}
size_t resonid_model_size(const resonid_model_config* config) noexcept {
  return resonid::c::size_of<Models>(config);
}
resonid_status resonid_model_init(void* memory, size_t size, const resonid_model_config* config,
                                  resonid_model** handle, resonid_error* error) noexcept {
  return resonid::c::init<Models>(memory, size, config, handle, error);
}
resonid_status resonid_model_create(const resonid_model_config* config, resonid_model** handle,
                                    resonid_error* error) noexcept {
  return resonid::c::create<Models>(config, handle, error);
}
resonid_status resonid_model_step(resonid_model* handle, double ru, double u, double y) noexcept {
  return Models::visit(handle, [&](const ModelOperations& o, void* h) {
    o.step(h, ru, u, y);
    return RESONID_OK;
  });
}
resonid_status resonid_model_run(resonid_model* handle, const double* ru, const double* u, const double* y,
                                 size_t count) noexcept {
  if (count > 0 && (u == nullptr || y == nullptr)) return RESONID_ERROR_NULL;
  return Models::visit(handle, [&](const ModelOperations& o, void* h) {
    for (std::size_t k = 0; k < count; ++k) o.step(h, ru != nullptr ? ru[k] : 0.0, u[k], y[k]);
    return RESONID_OK;
  });
}
resonid_status resonid_model_miss(resonid_model* handle, uint64_t count) noexcept {
  return Models::visit(handle, [&](const ModelOperations& o, void* h) {
    o.miss(h, count);
    return RESONID_OK;
  });
}
resonid_status resonid_model_reset(resonid_model* handle) noexcept {
  return Models::visit(handle, [](const ModelOperations& o, void* h) {
    o.reset(h);
    return RESONID_OK;
  });
}
resonid_status resonid_model_coefficients(const resonid_model* handle, double* b, double* a,
                                          size_t order) noexcept {
  if (b == nullptr || a == nullptr) return RESONID_ERROR_NULL;
  return Models::visit(handle, [&](const ModelOperations& o, void* h) -> resonid_status {
    if (order != o.order) return RESONID_ERROR_RANGE;
    o.coefficients(h, b, a);
    return RESONID_OK;
  });
}
resonid_status resonid_model_covariance(const resonid_model* handle, double* covariance,
                                        size_t count) noexcept {
  return Models::visit(handle, [&](const ModelOperations& o, void* h) -> resonid_status {
    const std::size_t n = 2 * std::size_t{o.order};
    if (const resonid_status status = resonid::c::check_array(covariance, count, n * n)) return status;
    o.covariance(h, covariance);
    return RESONID_OK;
  });
}
resonid_status resonid_model_lag_samples(const resonid_model* handle, double* lag_samples) noexcept {
  if (lag_samples == nullptr) return RESONID_ERROR_NULL;
  return Models::visit(handle, [&](const ModelOperations& o, void* h) {
    *lag_samples = o.lag_samples(h);
    return RESONID_OK;
  });
}
resonid_status resonid_model_resonances(const resonid_model* handle, resonid_mode* mode, size_t room,
                                        size_t* count) noexcept {
  return resonid::c::modes(handle, false, mode, room, count);
}
resonid_status resonid_model_antiresonances(const resonid_model* handle, resonid_mode* mode, size_t room,
                                            size_t* count) noexcept {
  return resonid::c::modes(handle, true, mode, room, count);
}
resonid_status resonid_model_get_info(const resonid_model* handle, resonid_model_info* info,
                                      size_t struct_size) noexcept {
  resonid_model_info found{};
  const resonid_status status = Models::visit(handle, [&](const ModelOperations& o, void* h) {
    o.describe(h, found);
    return RESONID_OK;
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
