// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "design/controller.hpp"
#include "design/shaper.hpp"

// Designs as text for other controllers (docs/methods/tune.md 16). What a target cannot express is refused,
// never approximated.
namespace resonid::design {

/// u = F (kp (b r - y) + sum of ki Ts (r - y)), F the product of the biquads.
struct ExportedController {
  FilteredPi controller;
  double sample_time_s = 0.0;
  double set_point_weight = 1.0;             ///< b, 0 ... 1
  std::optional<double> torque_limit;        ///< Nm; at it the sum is not driven further out.
  std::string name = "velocity_controller";  ///< A letter, then letters, digits and single underscores.
};

enum class CNumber { in_double, in_float };

/// A C99 header without heap or library: struct of coefficients and states, NAME_init(), NAME_step(), and
/// NAME_set_gains(), which makes no jump. In float, biquads that lose their shape are refused
/// (docs/methods/tune.md 16.4).
[[nodiscard]] expected<std::string> to_c(const ExportedController& design, CNumber number);

/// IEC 61131-3 structured text: a FUNCTION_BLOCK with LREAL variables, which gives no torque when the cycle
/// time of its task is another one than the design's.
[[nodiscard]] expected<std::string> to_structured_text(const ExportedController& design);

/// LinuxCNC HAL: `pid`, and before it `biquad`s of type 0, alike in the paths of reference and velocity, so
/// that the limit of `pid` is that of the torque. A set-point weight other than 1 is refused.
[[nodiscard]] expected<std::string> to_hal(const ExportedController& design,
                                           const std::string& thread = "servo-thread");

/// The shaper of one axis of a printer.
struct KlipperAxis {
  std::string axis;  ///< "x", "y" or "z"
  std::vector<ShaperKind> kinds;
  std::vector<ShapedMode> modes;  ///< [kind]; more than one is refused.
  double limit = 0.05;            ///< Another one is refused for extra insensitive shapers.
};
/// Section [input_shaper] of a Klipper configuration.
[[nodiscard]] expected<std::string> to_klipper(const std::vector<KlipperAxis>& axes);

}  // namespace resonid::design
