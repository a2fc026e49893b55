// SPDX-License-Identifier: MIT
// Runs the exported controllers and prints their torque, each as a float and what that leaves out: nearly a
// double.
#include <algorithm>
#include <array>

#include "../case.hpp"
#include "../platform.hpp"
#include "exported.h"

int program();
int program() {
  start_clock();
  Output out;
  for (int i = 0; i < exported_count; ++i) {
    const exported_controller& controller = exported_controllers[i];
    std::uint32_t ticks = 0;
    controller.init();
    for (int k = 0; k < exported_samples; ++k) {
      const std::uint32_t begin = clock_ticks();
      const double torque = controller.step(exported_told[k]);
      ticks += clock_ticks() - begin;
      const auto rounded = static_cast<float>(torque);
      out.floats(controller.name,
                 std::array{rounded, static_cast<float>(torque - static_cast<double>(rounded))});
    }
    out.number(controller.name, ticks);
  }
  return 0;
}
