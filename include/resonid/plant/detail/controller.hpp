// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/plant/detail/motion.hpp>
#include <span>
#include <string_view>
#include <vector>

namespace resonid::plant {

enum class ControllerKind { none, p, pi, pid, cascade, rst, transfer_function };
inline constexpr EnumName<ControllerKind> kControllerKindNames[] = {
    {ControllerKind::none, "none"},
    {ControllerKind::p, "p"},
    {ControllerKind::pi, "pi"},
    {ControllerKind::pid, "pid"},
    {ControllerKind::cascade, "cascade"},
    {ControllerKind::rst, "rst"},
    {ControllerKind::transfer_function, "transfer-function"}};
[[nodiscard]] constexpr std::span<const EnumName<ControllerKind>> enum_names(ControllerKind) noexcept {
  return kControllerKindNames;
}

/// The velocity controller of a drive, without the excitation: see Controller for the laws. Units are those
/// of a rotary drive; of a linear one Ns/m, N and m/s.
struct ControllerConfig {
  ControllerKind kind = ControllerKind::none;
  double gain = 0.0;
  double integral_time_s = 0.0;
  double derivative_time_s = 0.0;
  double derivative_filter_s = 0.0;
  double position_gain = 0.0;
  double velocity_feedforward = 0.0;
  double acceleration_feedforward = 0.0;
  double viscous_feedforward = 0.0;
  double coulomb_feedforward = 0.0;
  double reference_delay_s = 0.0;
  std::vector<double> r;
  std::vector<double> s;
  std::vector<double> t;
  std::vector<double> numerator;
  std::vector<double> denominator;
  double velocity_limit = 0.0;
  double torque_limit = 0.0;
};

/// The fields in the order of reading; `kind` is set first and selects the rest.
template <class Visitor>
void describe(Visitor&& v, ControllerConfig& c) {
  using enum ControllerKind;
  v("kind", c.kind, "none (open loop), p, pi, pid, cascade, rst, or transfer-function");
  if (c.kind == p || c.kind == pi || c.kind == pid || c.kind == cascade)
    v("gain", c.gain, "proportional gain of the velocity controller, > 0 (Nms/rad)");
  if (c.kind == pi || c.kind == pid || c.kind == cascade)
    v("integral_time_s", c.integral_time_s,
      "C(z) = gain (1 + Ts/integral_time z/(z-1)), of a pid with the derivative added inside, > 0 (s)");
  if (c.kind == pid) {
    v("derivative_time_s", c.derivative_time_s,
      "Td of the derivative Td/(Tf+Ts) (z-1)/(z - Tf/(Tf+Ts)), >= 0 (s)");
    v("derivative_filter_s", c.derivative_filter_s,
      "Tf of the derivative, time constant of its lag, >= 0 (s)");
  }
  if (c.kind == cascade) {
    v("position_gain", c.position_gain, "velocity reference per position error, > 0 (1/s)");
    v("velocity_feedforward", c.velocity_feedforward,
      "part of the profile's velocity that is added to the velocity reference, 0 ... 1");
    v("acceleration_feedforward", c.acceleration_feedforward,
      "torque per acceleration of the profile that is added to the controller's, >= 0 (kgm2)");
    v("viscous_feedforward", c.viscous_feedforward,
      "torque per velocity of the profile, added likewise, >= 0 (Nms/rad)");
    v("coulomb_feedforward", c.coulomb_feedforward,
      "torque in the direction of the profile's velocity, added likewise, >= 0 (Nm)");
    v("reference_delay_s", c.reference_delay_s,
      "by which the profile's position and velocity are compared later than torque is fed forward, as what "
      "is measured comes late, >= 0 (s)");
  }
  if (c.kind == rst) {
    v("r", c.r, "coefficients of R in R u = T ref - S y, in powers of z^-1, at the sample rate of the run");
    v("s", c.s, "coefficients of S, likewise: on the measured velocity");
    v("t", c.t, "coefficients of T, likewise: on the velocity reference");
  }
  if (c.kind == transfer_function) {
    v("numerator", c.numerator, "coefficients b0, b1 ... in powers of z^-1, at the sample rate of the run");
    v("denominator", c.denominator, "coefficients a0, a1 ..., likewise; a0 not 0");
  }
  if (c.kind != none)
    v("velocity_limit", c.velocity_limit, "greatest velocity reference either way; 0: none (rad/s)");
  v("torque_limit", c.torque_limit,
    "greatest torque either way, of controller and excitation together; 0: none (Nm)");
}

/// Refuses what is out of range, not finite, improper (R or the denominator begins with 0) or unstable (a
/// root of R or of the denominator outside the unit circle; integrators are on it).
[[nodiscard]] expected<void, Error> check(const ControllerConfig& config);

/// What the controller is fed with, delay and noise of the measurement included.
struct Measured {
  double position = 0.0;  ///< Read by a cascade only.
  double velocity = 0.0;
};

/// A drive's controller, sample by sample. With v* the velocity reference, y the measured velocity:
///
///   p, pi, pid         u = C (v* - y),  C = gain (1 + Ts/Ti z/(z-1) + Td/(Tf+Ts) (z-1)/(z - Tf/(Tf+Ts)))
///   transfer-function  u = C (v* - y),  C = numerator/denominator
///   cascade            u = C_pi (v* - y),  v* = position_gain (p* - p) + velocity_feedforward dp*/dt
///   rst                R u = T v* - S y
///
/// What a cascade adds to u by the profile alone, torque_feedforward(), is no part of the law: the caller
/// adds it as an excitation, so that the limit holds for both together.
///
/// Integral and derivative are backward Euler (the derivative's lag with its pole in
/// Tf/(Tf+Ts)). v* is limited first. A sample takes three calls, between which the caller adds the
/// excitation:
///
///   c = command(setpoint, measured);  u = limit(c + ru);  commit(u == c + ru ? c : u - ru);
///
/// Anti-windup: the recursion goes on from the output that commit() reports, so that an integrating law
/// resumes from the torque that was really given, as an incremental PI does (observer polynomial 1: Astrom
/// and Wittenmark 1997, 9.4). What the limit takes from a proportional or derivative kick is therefore not
/// given later either. A copyable value; no heap outside create(),
/// feedback() and copies.
class Controller {
 public:
  static constexpr std::size_t kMaxOrder = 16;  ///< Largest order of R, S, T, numerator and denominator.

  static expected<Controller, Error> create(const ControllerConfig& config, double sample_rate_hz);

  /// The controller's output before excitation and limit; 0 in open loop. Changes nothing that a further
  /// call would not overwrite until commit() ends the sample.
  [[nodiscard]] double command(const Setpoint& setpoint, const Measured& measured) noexcept;
  /// What a cascade feeds forward: acceleration_feedforward a + viscous_feedforward v + coulomb_feedforward
  /// sign(v) by the profile's acceleration and velocity; 0 of every other kind.
  [[nodiscard]] double torque_feedforward(const Setpoint& setpoint) const noexcept;
  /// By which the setpoint of command() is later than that of torque_feedforward().
  [[nodiscard]] double reference_delay_s() const noexcept {
    return uses_position() ? config_.reference_delay_s : 0.0;
  }
  /// The torque within the limit.
  [[nodiscard]] double limit(double torque) const noexcept;
  /// Ends the sample with the controller's output as it took effect: the limited torque less the excitation.
  /// Where nothing was limited pass command()'s own value, as the difference rounds.
  void commit(double applied) noexcept;

  /// Puts the controller in the steady state in which these constant inputs give `torque`. They must balance
  /// (imbalance() = 0, following_error() in a cascade); of a law without memory and in open loop nothing is
  /// set.
  void settle(const Setpoint& setpoint, const Measured& measured, double torque) noexcept;

  [[nodiscard]] bool closed() const noexcept { return config_.kind != ControllerKind::none; }
  /// Whether the law holds any torque in the steady state without an error of velocity (rst: R(1) = 0).
  [[nodiscard]] bool integrates() const noexcept { return closed() && torque_gain_ == 0.0; }
  [[nodiscard]] bool uses_position() const noexcept { return config_.kind == ControllerKind::cascade; }

  /// T(1) v* - S(1) velocity - R(1) torque: 0 in the steady state at a constant velocity, whatever holds the
  /// machine there (p ... transfer-function: R denominator, S = T numerator; cascade: v* is the velocity that
  /// its position loop settles at). 0 in open loop.
  [[nodiscard]] double imbalance(double reference_velocity, double velocity, double torque) const noexcept;
  /// Reference less measured position in the steady state at a constant velocity of a cascade, else 0.
  [[nodiscard]] double following_error(double velocity) const noexcept;

  /// Linear law from measured velocity to -u, for judging the loop: C; R^-1 S; of a cascade
  /// C_pi (1 + position_gain Ts z/(z-1)), position being the backward-Euler integral of velocity: of that
  /// before a filter of the velocity with this pole. None in open loop.
  [[nodiscard]] std::optional<data::TransferFunction> feedback(double filter_pole = 0.0) const;
  /// The same of the velocity loop alone, and the gain of the position loop around it, 0: none.
  [[nodiscard]] std::optional<data::TransferFunction> velocity_feedback() const;
  [[nodiscard]] double position_gain() const noexcept {
    return uses_position() ? config_.position_gain : 0.0;
  }

 private:
  using Filter = DiscreteFilter<double, kMaxOrder>;
  explicit Controller(ControllerConfig config, double step_s) : config_(std::move(config)), step_s_(step_s) {}
  [[nodiscard]] double limited_velocity(double velocity) const noexcept;
  [[nodiscard]] double velocity_reference(const Setpoint& setpoint, const Measured& measured) const noexcept;
  expected<void, Error> make_filters();

  ControllerConfig config_;
  double step_s_;
  Filter law_;                   // C; rst: 1/R
  Filter reference_;             // rst: T
  Filter feedback_;              // rst: S
  double reference_gain_ = 0.0;  // T(1), S(1), R(1); the last exactly 0 of an integrating law
  double velocity_gain_ = 0.0;
  double torque_gain_ = 0.0;
  double reference_velocity_ = 0.0;  // inputs of the sample that commit() ends
  double measured_velocity_ = 0.0;
  double input_ = 0.0;  // of law_
};

}  // namespace resonid::plant
