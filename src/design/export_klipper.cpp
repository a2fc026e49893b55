// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>

#include "design/export.hpp"

namespace resonid::design {
namespace {

/// Klipper's own impulses of the extra insensitive shapers are fitted up to these dampings.
double largest_damping(ShaperKind kind) {
  if (kind == ShaperKind::ei) return 0.4;
  return kind == ShaperKind::two_hump_ei ? 0.3 : 0.99;
}

bool is_extra_insensitive(ShaperKind kind) {
  return kind == ShaperKind::ei || kind == ShaperKind::two_hump_ei;
}

expected<void> check_axis(const KlipperAxis& axis) {
  if (axis.axis != "x" && axis.axis != "y" && axis.axis != "z") return refuse("axis", "must be x, y or z");
  if (axis.kinds.size() != axis.modes.size()) return refuse("modes", "must be as many as the shapers' kinds");
  if (axis.kinds.size() != 1)
    return refuse("modes", "must be one: Klipper shapes one mode of an axis",
                  static_cast<double>(axis.modes.size()));
  const ShapedMode& mode = axis.modes.front();
  const ShaperKind kind = axis.kinds.front();
  if (const auto shaper = shaper_for(kind, mode, axis.limit); !shaper) return tl::unexpected(shaper.error());
  if (mode.damping_ratio > largest_damping(kind))
    return refuse("damping_ratio",
                  fmt::format("must be at most {:g}, which Klipper allows for {}", largest_damping(kind),
                              name_of(kind)),
                  mode.damping_ratio);
  if (is_extra_insensitive(kind) && axis.limit != 0.05)
    return refuse("limit", "must be 0.05, which Klipper's extra insensitive shapers are made for",
                  axis.limit);
  return {};
}

}  // namespace

expected<std::string> to_klipper(const std::vector<KlipperAxis>& axes) {
  if (axes.empty()) return refuse("axes", "must not be empty");
  std::string text = "[input_shaper]\n";
  for (auto axis = axes.begin(); axis != axes.end(); ++axis) {
    if (const auto valid = check_axis(*axis); !valid) return tl::unexpected(valid.error());
    if (std::any_of(axes.begin(), axis, [&](const KlipperAxis& other) { return other.axis == axis->axis; }))
      return refuse("axis", "must stand there once only");
    const ShaperKind kind = axis->kinds.front();
    if (is_extra_insensitive(kind) && axis->modes.front().damping_ratio > 0.0)
      text += fmt::format("# {}: Klipper's own impulses for damped modes, of the same width\n", axis->axis);
    text += fmt::format("shaper_type_{0}: {1}\nshaper_freq_{0}: {2:.10g}\ndamping_ratio_{0}: {3:.10g}\n",
                        axis->axis, name_of(kind), axis->modes.front().frequency_hz,
                        axis->modes.front().damping_ratio);
  }
  return text;
}

}  // namespace resonid::design
