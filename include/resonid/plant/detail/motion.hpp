// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <span>
#include <string_view>
#include <vector>

namespace resonid::plant {

/// Where the machine should be. Units of the driven side (rad, rad/s, rad/s2), m, m/s, m/s2 for linear motion
/// and of the cart for a tooth belt.
struct Setpoint {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
};

enum class MotionKind { standstill, constant, trapezoidal, s_curve };
inline constexpr EnumName<MotionKind> kMotionKindNames[] = {{MotionKind::standstill, "standstill"},
                                                            {MotionKind::constant, "constant"},
                                                            {MotionKind::trapezoidal, "trapezoidal"},
                                                            {MotionKind::s_curve, "s-curve"}};
[[nodiscard]] constexpr std::span<const EnumName<MotionKind>> enum_names(MotionKind) noexcept {
  return kMotionKindNames;
}

struct MotionConfig {
  MotionKind kind = MotionKind::standstill;
  double velocity = 0.0;
  double acceleration = 0.0;
  double jerk = 0.0;
  double from = 0.0;
  double to = 0.0;
  double wait_s = 0.0;
  double dwell_s = 0.0;
  bool returns = false;
  std::vector<double> shaper_amplitudes = {};
  std::vector<double> shaper_times_s = {};
};

/// The fields in the order of reading; `kind` is set first and selects the rest. Units of the driven side,
/// rad and rad/s, m and m/s for linear motion and of the cart for a tooth belt.
template <class Visitor>
void describe(Visitor&& v, MotionConfig& c) {
  v("kind", c.kind,
    "standstill, constant (velocity), trapezoidal or s-curve; units of the driven side, rad and rad/s, m and "
    "m/s for linear motion and of the cart for a tooth belt");
  const bool moves = c.kind == MotionKind::trapezoidal || c.kind == MotionKind::s_curve;
  if (c.kind == MotionKind::constant)
    v("velocity", c.velocity, "of the run, from the first sample on; its sign is the direction (rad/s, m/s)");
  if (moves) {
    v("velocity", c.velocity, "greatest velocity of a move, > 0 (rad/s, m/s)");
    v("acceleration", c.acceleration, "greatest acceleration of a move, > 0 (rad/s2, m/s2)");
  }
  if (c.kind == MotionKind::s_curve) v("jerk", c.jerk, "greatest jerk of a move, > 0 (rad/s3, m/s3)");
  v("from", c.from, "position at the start (rad, m)");
  if (!moves) return;
  v("to", c.to, "position at the other end, not `from` (rad, m)");
  v("wait_s", c.wait_s, "rest at `from` before each move to `to`, >= 0 (s)");
  v("returns", c.returns, "whether it moves back to `from` and begins again, else it stays at `to`");
  v("dwell_s", c.dwell_s, "rest at `to` before each move back, >= 0 (s)");
  v("shaper_amplitudes", c.shaper_amplitudes,
    "impulses of an input shaper, which the reference is convolved with, > 0 and 1 together; empty: none");
  v("shaper_times_s", c.shaper_times_s, "their times, as many, >= 0 (s)");
}

[[nodiscard]] expected<void, Error> check(const MotionConfig& config) noexcept;

/// The reference of a motion as a function of time.
///
///   standstill     at `from`
///   constant       from + velocity t, settled: it turns at `velocity` already before t = 0
///   trapezoidal    rest for wait_s, a move, rest for dwell_s, the move back, and again from the beginning
///   s-curve        likewise with limited jerk
///
/// With an input shaper, the sum of its impulses' amplitudes times the reference that much earlier: each move
/// takes as much longer as its last impulse is late, and its derivatives are smaller. A dwell must outlast
/// it, or a move back begins before the way there is over.
///
/// A move takes the least time from rest to rest within its limits. One of limited jerk is the trapezoid of
/// velocity v and acceleration a, averaged over the past a/jerk seconds, with v and a lowered where the move
/// is too short to reach them (averaging the full trapezoid would exceed the jerk there): a = sqrt(v jerk)
/// below v = a²/jerk, and v from the distance D = v (v/a + a/jerk). Source: Lambrechts, Boerlage and
/// Steinbuch 2005, third-order profile. Each value is computed from the time alone, so nothing accumulates;
/// ends are met exactly.
class MotionProfile {
 public:
  struct Range {
    double lowest = 0.0;
    double highest = 0.0;
  };

  static expected<MotionProfile, Error> create(const MotionConfig& config);

  /// `time_s` from the start of the run. At a step of the acceleration its value lies between both sides.
  [[nodiscard]] Setpoint at(double time_s) const noexcept;

  /// Whether it goes from place to place, neither resting nor turning on.
  [[nodiscard]] bool moves() const noexcept;
  /// Duration of one move from rest to rest before it is shaped; 0 without moves.
  [[nodiscard]] double move_duration_s() const noexcept { return duration_s_; }
  /// The positions between which the reference stays from 0 to `duration_s`.
  [[nodiscard]] Range reached(double duration_s) const noexcept;

 private:
  explicit MotionProfile(const MotionConfig& config) noexcept : config_(config) {}
  void plan() noexcept;
  [[nodiscard]] Setpoint unshaped(double time_s) const noexcept;
  [[nodiscard]] Setpoint from_rest(double time_s) const noexcept;
  [[nodiscard]] Setpoint move(double time_s) const noexcept;
  [[nodiscard]] static Setpoint between(double start, double end, const Setpoint& way) noexcept;

  MotionConfig config_;
  double distance_ = 0.0;  // |to - from|
  double peak_velocity_ = 0.0;
  double peak_acceleration_ = 0.0;
  double smoothing_s_ = 0.0;  // time in which the acceleration rises to its peak
  double ramp_s_ = 0.0;       // time in which the velocity rises to its peak
  double duration_s_ = 0.0;
};

}  // namespace resonid::plant
