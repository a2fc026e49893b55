// SPDX-License-Identifier: MIT
#include "core.h"

#include <algorithm>
#include <array>
#include <optional>
#include <resonid/base/flush_denormals.hpp>
#include <string_view>

#include "axis.hpp"

namespace {

std::array<std::optional<resonid::linuxcnc::Axis>, RESONID_MAX_AXES> axes;  // static memory: no heap

template <std::size_t N>
void copy(std::string_view text, char (&to)[N]) {
  const std::size_t length = std::min(text.size(), N - 1);
  std::copy_n(text.data(), length, to);
  to[length] = '\0';
}

}  // namespace

extern "C" {

int resonid_axis_create(int axis, const resonid_axis_shape* shape, resonid_axis_error* error) {
  if (axis < 0 || axis >= RESONID_MAX_AXES) {
    copy("count", error->field);
    copy("must be at most 8 axes", error->requirement);
    error->value = axis + 1;
    return -1;
  }
  const auto made = resonid::linuxcnc::Axis::create(*shape);
  if (!made) {
    copy(made.error().field, error->field);
    copy(made.error().requirement, error->requirement);
    error->value = made.error().value;
    return -1;
  }
  axes[static_cast<std::size_t>(axis)].emplace(*made);
  return 0;
}

double resonid_axis_excite(int axis, const resonid_axis_settings* settings,
                           const resonid_axis_sample* sample) {
  const resonid::FlushDenormals flush;
  return axes[static_cast<std::size_t>(axis)]->excite(*settings, *sample);
}

void resonid_axis_identify(int axis, const resonid_axis_settings* settings,
                           const resonid_axis_sample* sample) {
  const resonid::FlushDenormals flush;
  axes[static_cast<std::size_t>(axis)]->identify(*settings, *sample);
}

const resonid_axis_results* resonid_axis_read(int axis) {
  return &axes[static_cast<std::size_t>(axis)]->results();
}

}  // extern "C"
