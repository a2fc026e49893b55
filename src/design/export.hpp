// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "design/controller.hpp"
#include "design/schedule.hpp"
#include "design/shaper.hpp"

// Designs as text for other controllers (docs/methods/tune.md 16). What a target cannot express is refused,
// never approximated.
namespace resonid::design {

/// Torque by the reference of a position loop: what the caller of a text gives it as torque feed-forward.
struct TorqueFeedForward {
  double inertia = 0.0;  ///< Nm/(rad/s^2)
  double viscous = 0.0;  ///< Nm/(rad/s)
  double coulomb = 0.0;  ///< Nm, in the direction of the velocity.
  double delay_s = 0.0;  ///< By which the loop is given position and velocity later.
};

///   r = reference, or kv (reference - x) + velocity feed-forward
///   u = F (kp (b r - y) + sum of ki Ts (r - y)) + torque feed-forward, F the product of the biquads
///
/// There are feed-forwards where kv is given. It is the law of online::DriveControl, but for samples that are
/// missing: a text takes what it is given.
struct ExportedController {
  FilteredPi controller;  ///< kp and ki 0 where a schedule gives them.
  double sample_time_s = 0.0;
  double set_point_weight = 1.0;             ///< b, 0 ... 1
  std::optional<double> torque_limit;        ///< Nm; at it the sum is not driven further out.
  std::string name = "velocity_controller";  ///< A letter, then letters, digits and single underscores.
  std::vector<ScheduleNode> schedule;        ///< Gains over position, ascending; empty: kp and ki everywhere.
  std::optional<double> largest_speed =
      {};                      ///< That of a schedule's position, in its unit per s: said in a comment.
  double kv = 0.0;             ///< 1/s; > 0: the reference is a position. Then b must be 1.
  bool sums_velocity = false;  ///< The position is Ts times the sum of the velocity, from 0, not measured.
  /// Where kv is given: also a function NAME_torque_feed_forward() in C and structured text, a comment in
  /// HAL.
  std::optional<TorqueFeedForward> feed_forward = {};

  [[nodiscard]] bool needs_position() const { return kv > 0.0 || !schedule.empty(); }
};

/// u = (T r - R y)/S: a PID, RST, state feedback, or what a controller file holds. Only C and structured text
/// can say it. Nothing winds up at the limit (docs/methods/tune.md 16.3).
struct ExportedRst {
  std::vector<double> r, s;  ///< In powers of z^-1.
  std::vector<double> t;     ///< Empty: R.
  double sample_time_s = 0.0;
  std::optional<double> torque_limit;        ///< Nm
  std::string name = "velocity_controller";  ///< As in ExportedController.
  std::string what = "RST";                  ///< For its comment.
};

enum class CNumber { in_double, in_float };

/// A C99 header without heap or library: struct of coefficients and states, NAME_init(), NAME_step(), and
/// without a schedule NAME_set_gains(), which makes no jump. In float, biquads that lose their shape are
/// refused (docs/methods/tune.md 16.4).
[[nodiscard]] expected<std::string> to_c(const ExportedController& design, CNumber number);

/// NAME_init() and NAME_step(). In float, laws whose response errs by more than 1 % are refused.
[[nodiscard]] expected<std::string> to_c(const ExportedRst& design, CNumber number);

/// IEC 61131-3 structured text: a FUNCTION_BLOCK with LREAL variables, which gives no torque when the cycle
/// time of its task is another one than the design's.
[[nodiscard]] expected<std::string> to_structured_text(const ExportedController& design);
[[nodiscard]] expected<std::string> to_structured_text(const ExportedRst& design);

/// LinuxCNC HAL: `pid`, and before it `biquad`s of type 0, alike in the paths of reference and velocity, so
/// that the limit of `pid` is that of the torque; a set-point weight is FF0 = -kp (1 - b) on the command; a
/// position loop is a second `pid`, a summed position an `integ`. A schedule is refused.
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
