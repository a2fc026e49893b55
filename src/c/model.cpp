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
std::uint32_t class_of(std::uint32_t kind) noexcept {
  if (kind == RESONID_ARX) return 0;
  if (kind <= RESONID_OE_FILTERED) return 1;
  return kind <= RESONID_CLOE_DAMPED ? 2 : 3;
}
const ModelOperations* model_operations(std::uint32_t variant) noexcept {
  const auto all = table(variant / kOrders);
  const std::size_t place = variant % kOrders;
  return place < all.size() ? &all[place] : nullptr;
}

struct Models : ModelDescription {
  using Settings = resonid_model_settings;
  static constexpr std::uint32_t kId = family_of(RESONID_ARX), kTypes = 7;

  static Settings defaults(std::uint32_t kind) noexcept {
    const online::ClosedLoopOutputErrorConfig closed;
    const online::RecursiveLeastSquaresConfig& r = closed.common.adaptation;
    const online::InstrumentalVariablesConfig<3> iv;
    Settings s{};
    s.order = 3;
    s.fixed_integrator = kind == RESONID_IV && iv.terms.fixed_integrator ? 1 : 0;
    s.forgetting = static_cast<std::uint32_t>(r.forgetting);
    s.freeze_below = closed.common.freeze_below;
    s.start_variance = r.start_variance;
    s.factor = r.factor;
    s.smallest_factor = r.smallest_factor;
    s.noise_variance = r.noise_variance;
    s.largest_variance = r.largest_variance;
    s.smallest_variance = r.smallest_variance;
    s.filter_contraction = closed.filter_contraction;
    s.largest_pole_radius = closed.largest_pole_radius;
    s.refined = iv.refined ? 1 : 0;
    s.offsets = iv.terms.offsets ? 1 : 0;
    s.start_deviation = iv.start_deviation;
    s.largest_deviation = iv.largest_deviation;
    return s;
  }
  static expected<std::uint32_t> variant(const Settings& s) noexcept {
    const std::uint32_t method_class = class_of(s.head.kind);
    const auto all = table(method_class);
    if (s.order < all.front().order || s.order > all.back().order)
      return refuse("order", "must be one that the method has", s.order);
    return method_class * kOrders + (s.order - all.front().order);
  }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    return model_operations(variant)->build(memory, variant, s);
  }
  static const Operations* operations(std::uint32_t variant) noexcept {
    const ModelOperations* found = model_operations(variant);
    return found != nullptr ? &found->common : nullptr;
  }
};

}  // namespace

const Family kModel = FamilyOf<Models>::kFamily;

}  // namespace resonid::c

resonid_status resonid_modes(const resonid_handle* model, uint32_t which, resonid_mode* mode, size_t room,
                             size_t* count) noexcept {
  using resonid::c::Header;
  if (count == nullptr || (mode == nullptr && room > 0)) return RESONID_ERROR_NULL;
  if (which > RESONID_ANTIRESONANCES) return RESONID_ERROR_RANGE;
  return resonid::c::with(model, [&](const auto&) -> resonid_status {
    const Header& h = *reinterpret_cast<const Header*>(model);
    if (resonid::c::family_of(h.kind) != resonid::c::Models::kId) return RESONID_ERROR_UNSUPPORTED;
    *count =
        resonid::c::model_operations(h.variant)->modes(model, which == RESONID_ANTIRESONANCES, mode, room);
    return RESONID_OK;
  });
}
