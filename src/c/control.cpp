// SPDX-License-Identifier: MIT
#include <resonid/c/detail/control.h>

#include <array>
#include <resonid/online/control.hpp>

#include "handle.hpp"

namespace resonid::c {
namespace {

template <class Real>
using Control = online::DriveControl<Real, RESONID_CONTROL_MAX_BIQUADS, RESONID_CONTROL_MAX_NODES>;

/// The caller's structs as those of C++, as many as there is room for.
template <class To, std::size_t Most>
struct Copied {
  std::array<To, Most> values{};
  std::size_t count = 0;
  [[nodiscard]] std::span<const To> span() const noexcept { return std::span(values).first(count); }
};
using Biquads = Copied<online::Biquad, RESONID_CONTROL_MAX_BIQUADS>;
using Nodes = Copied<online::GainNode, RESONID_CONTROL_MAX_NODES>;

/// To{three numbers} of each; more than there is room for, and NULL, are refused.
template <class Copy, class From, class Convert>
expected<Copy> copied(const char* field, const From* given, std::size_t count, Convert&& convert) noexcept {
  Copy copy;
  if (count > copy.values.size())
    return refuse(field, "must be no more than there is room for", static_cast<double>(count));
  if (given == nullptr && count > 0) return refuse(field, "must not be NULL");
  copy.count = count;
  for (std::size_t i = 0; i < count; ++i) copy.values[i] = convert(given[i]);
  return copy;
}
expected<Biquads> biquads_of(const resonid_biquad* given, std::size_t count) noexcept {
  return copied<Biquads>("biquads", given, count, [](const resonid_biquad& b) {
    return online::Biquad{b.frequency_hz, b.numerator_damping, b.denominator_damping};
  });
}
expected<Nodes> nodes_of(const resonid_gain_node* given, std::size_t count) noexcept {
  return copied<Nodes>("schedule", given, count, [](const resonid_gain_node& n) {
    return online::GainNode{n.position, n.kp, n.ki};
  });
}

struct Controls : Variants<Controls, Control<double>, Control<float>> {
  using Settings = resonid_control_settings;
  using Results = resonid_control_results;
  static constexpr std::uint32_t kId = family_of(RESONID_CONTROL), kTypes = 1;
  static_assert(handle_size<Control<double>>() <= RESONID_CONTROL_SIZE);

  static Settings defaults(std::uint32_t) noexcept {
    const online::DriveControlConfig c;
    Settings s{};
    s.set_point_weight = c.set_point_weight;
    s.torque_limit = c.torque_limit;
    s.longest_gap_samples = c.longest_gap_samples;
    return s;
  }
  static expected<std::uint32_t> variant(const Settings& s) noexcept {
    if (s.precision > RESONID_FLOAT) return refuse("precision", "must be one of its constants", s.precision);
    return s.precision;
  }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    const auto biquads = biquads_of(s.biquads, s.biquad_count);
    if (!biquads) return unexpected<Error>(biquads.error());
    const auto nodes = nodes_of(s.schedule, s.node_count);
    if (!nodes) return unexpected<Error>(nodes.error());
    online::DriveControlConfig c;
    c.sample_rate_hz = s.sample_rate_hz;
    c.kp = s.kp;
    c.ki = s.ki;
    c.set_point_weight = s.set_point_weight;
    c.torque_limit = s.torque_limit;
    c.biquads = biquads->span();
    c.schedule = nodes->span();
    c.kv = s.kv;
    c.sums_velocity = s.sums_velocity != 0;
    c.longest_gap_samples = s.longest_gap_samples;
    const std::uint32_t kind = s.head.kind;
    return variant == RESONID_DOUBLE ? place(memory, kind, variant, Control<double>::create(c))
                                     : place(memory, kind, variant, Control<float>::create(c));
  }
  template <class T>
  static void results(const T& control, Results& r) noexcept {
    r.samples = control.samples();
    r.skipped_samples = control.skipped_samples();
    r.torque = static_cast<double>(control.torque());
    r.integral = static_cast<double>(control.integral());
    r.kp = static_cast<double>(control.kp());
    r.ki = static_cast<double>(control.ki());
    r.position = static_cast<double>(control.position());
    r.velocity_reference = static_cast<double>(control.velocity_reference());
    r.limited = control.limited() ? 1 : 0;
    r.exchanging = control.exchanging() ? 1 : 0;
    r.in_gap = control.in_gap() ? 1 : 0;
    r.position_certain = control.position_certain() ? 1 : 0;
  }
};

/// What a controller says of a change that was asked for.
resonid_status told(resonid_error* error, const expected<void>& done) noexcept {
  return done ? RESONID_OK : fail(error, done.error());
}

}  // namespace

const Family kControl = FamilyOf<Controls>::kFamily;

}  // namespace resonid::c

using resonid::c::Controls;

resonid_status resonid_control_step(resonid_handle* control, double reference, double velocity,
                                    double position, double velocity_feed_forward, double torque_feed_forward,
                                    double* torque) noexcept {
  if (torque == nullptr) return RESONID_ERROR_NULL;
  *torque = 0.0;  // whatever is wrong, there is none
  return Controls::visit(control, [&](auto& c) {
    using Real = typename std::remove_reference_t<decltype(c)>::Scalar;
    *torque = static_cast<double>(
        c.step({static_cast<Real>(reference), static_cast<Real>(velocity), static_cast<Real>(position),
                static_cast<Real>(velocity_feed_forward), static_cast<Real>(torque_feed_forward)}));
  });
}
resonid_status resonid_control_set_gains(resonid_handle* control, double kp, double ki,
                                         resonid_error* error) noexcept {
  return Controls::visit(control, [&](auto& c) { return resonid::c::told(error, c.set_gains(kp, ki)); });
}
resonid_status resonid_control_set_schedule(resonid_handle* control, const resonid_gain_node* schedule,
                                            size_t count, resonid_error* error) noexcept {
  return Controls::visit(control, [&](auto& c) -> resonid_status {
    const auto nodes = resonid::c::nodes_of(schedule, count);
    if (!nodes) return resonid::c::fail(error, nodes.error());
    return resonid::c::told(error, c.set_schedule(nodes->span()));
  });
}
resonid_status resonid_control_exchange_filters(resonid_handle* control, const resonid_biquad* biquads,
                                                size_t count, uint32_t warm_up_samples, uint32_t fade_samples,
                                                resonid_error* error) noexcept {
  return Controls::visit(control, [&](auto& c) -> resonid_status {
    const auto filters = resonid::c::biquads_of(biquads, count);
    if (!filters) return resonid::c::fail(error, filters.error());
    return resonid::c::told(error, c.exchange_filters(filters->span(), warm_up_samples, fade_samples));
  });
}
resonid_status resonid_control_set_position(resonid_handle* control, double position) noexcept {
  return Controls::visit(control, [&](auto& c) {
    c.set_position(static_cast<typename std::remove_reference_t<decltype(c)>::Scalar>(position));
  });
}
