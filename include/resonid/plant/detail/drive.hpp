// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>
#include <cstddef>
#include <memory>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/data/two_mass.hpp>
#include <resonid/plant/detail/disturbance.hpp>
#include <resonid/plant/detail/friction.hpp>
#include <resonid/plant/detail/mass_system.hpp>
#include <span>
#include <string_view>
#include <vector>

namespace resonid::plant {

inline constexpr std::size_t kMaxMasses = 6;

/// How a mass moves, referred to the driven shaft.
struct MassMotion {
  double velocity = 0.0;  ///< rad/s (m/s)
  double angle = 0.0;     ///< rad (m)
};

/// The linear machine over one sample with the command held: x(k+1) = a x(k) + b u(k). Read part-way through
/// it, the driven side's velocity is `early_velocity` x + `early_velocity_command` u, and likewise its angle.
struct SampledDrive {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  Eigen::RowVectorXd velocity;  ///< of the driven side at the sample itself
  Eigen::RowVectorXd early_velocity, early_angle;
  double early_velocity_command = 0.0;
  double early_angle_command = 0.0;
  double sample_time_s = 0.0;
  bool grounded = false;  ///< Springs hold it in its place: the angle, the last state, acts on the others.

  /// How many of the first states the motion depends on: all but the angle of a free machine.
  [[nodiscard]] Eigen::Index moving_states() const noexcept { return a.rows() - (grounded ? 0 : 1); }
};

/// Response from command to driven velocity, without delay. Solved as it stands it keeps its digits near 0
/// Hz, where the polynomials of the transfer function cancel.
[[nodiscard]] std::complex<double> response(const SampledDrive& drive, double frequency_hz);
[[nodiscard]] data::TransferFunction transfer_function(const SampledDrive& drive);

/// What every simulated machine offers: torque in, motion of the driven side out, one sample at a time, with
/// the torque held between samples.
class Drive {
 public:
  virtual ~Drive() = default;

  /// Puts the machine in the steady state at this velocity and place (angle of the driven side; position of
  /// the cart of a tooth belt), at time 0; returns the torque that holds it there.
  virtual double settle(double velocity, double place) = 0;

  /// Moves on by one sample time under constant torque. Returns the motion of the driven side
  /// `early_fraction` of a sample before the end of that time (fixed at creation; 0: at its end), which is
  /// how a delay of a fraction of a sample is exact.
  virtual MassMotion advance(double torque) noexcept = 0;

  /// The load's angle (rad, m) or acceleration (rad/s2, m/s2) at the instant that settle() or advance() last
  /// returned the motion of; 0 without a second output.
  [[nodiscard]] virtual double second_output() const noexcept = 0;

  [[nodiscard]] virtual std::vector<MassMotion> motions() const = 0;  ///< [mass], now
  [[nodiscard]] virtual double place() const noexcept = 0;            ///< As in settle().
  [[nodiscard]] virtual double stiffness_factor()
      const noexcept = 0;  ///< Stiffness now over the nominal one.
  /// Whether springs hold it in its place, so that the torque that holds it depends on the place.
  [[nodiscard]] virtual bool grounded() const noexcept = 0;
  /// The linear part, for a stiffness of `factor` times the nominal one.
  [[nodiscard]] virtual SampledDrive sampled(double factor) const = 0;
};

enum class Structure { two_mass, rigid, three_mass, chain, tooth_belt };
inline constexpr EnumName<Structure> kStructureNames[] = {{Structure::two_mass, "two-mass"},
                                                          {Structure::rigid, "rigid"},
                                                          {Structure::three_mass, "three-mass"},
                                                          {Structure::chain, "chain"},
                                                          {Structure::tooth_belt, "tooth-belt"}};
[[nodiscard]] constexpr std::span<const EnumName<Structure>> enum_names(Structure) noexcept {
  return kStructureNames;
}

struct DriveConfig {
  Structure structure = Structure::two_mass;
  data::Motion motion = data::Motion::rotary;
  double driven_inertia = 0.0;
  double load_inertia = 0.0;
  double stiffness = 0.0;
  double damping = 0.0;
  double radius_m = 0.0;
  double viscous_friction = 0.0;
  double load_viscous_friction = 0.0;
  double load_radius_m = 0.0;
  double middle_inertia = 0.0;
  double stiffness_2 = 0.0;
  double damping_2 = 0.0;
  double bypass_stiffness = 0.0;
  double bypass_damping = 0.0;
  std::vector<double> inertias = {};
  std::vector<double> stiffnesses = {};
  std::vector<double> dampings = {};
  double cart_mass_kg = 0.0;
  double specific_stiffness_n = 0.0;
  double quality = 0.0;
  double upper_length_m = 0.0;
  double lower_length_m = 0.0;
  double stroke_from_m = 0.0;
  double stroke_to_m = 0.0;
  double motor_ground_stiffness = 0.0;
  double load_ground_stiffness = 0.0;
  double backlash = 0.0;
  double stiffening_twist = 0.0;
};

/// The fields in the order of reading; `structure` is set first and selects the rest.
template <class Visitor>
void describe(Visitor&& v, DriveConfig& c) {
  v("structure", c.structure, "two-mass, rigid, three-mass, chain or tooth-belt");
  const bool belt = c.structure == Structure::tooth_belt;
  const bool coupled = c.structure == Structure::two_mass || c.structure == Structure::three_mass;
  if (!belt) v("motion", c.motion, "rotary (kgm2, Nm/rad, Nms/rad) or linear (kg, N/m, Ns/m)");
  if (c.structure == Structure::chain) {
    v("inertias", c.inertias, "1 ... 6 inertias, the driven one first, the load last, > 0 (kgm2)");
    v("stiffnesses", c.stiffnesses,
      "between neighbours, one less, > 0 (Nm/rad; N/m of a belt when radius_m is given)");
    v("dampings", c.dampings, "likewise, >= 0 (Nms/rad; Ns/m of a belt when radius_m is given)");
  } else {
    v("driven_inertia", c.driven_inertia,
      "inertia of the driven side, of the whole machine when rigid, > 0 (kgm2)");
  }
  if (c.structure == Structure::three_mass)
    v("middle_inertia", c.middle_inertia,
      "inertia between the two sides, for example a belt tensioner, > 0 (kgm2)");
  if (coupled) {
    v("load_inertia", c.load_inertia, "inertia of the load at its own shaft, > 0 (kgm2)");
    v("stiffness", c.stiffness,
      "of the coupling, of that to the middle inertia where there is one, > 0 (Nm/rad; N/m of a belt when "
      "radius_m is given)");
    v("damping", c.damping, "likewise, >= 0 (Nms/rad; Ns/m of a belt when radius_m is given)");
  }
  if (c.structure == Structure::three_mass) {
    v("stiffness_2", c.stiffness_2, "between middle inertia and load, > 0 (as stiffness)");
    v("damping_2", c.damping_2, "likewise, >= 0 (as damping)");
    v("bypass_stiffness", c.bypass_stiffness,
      "of a second path from the driven side to the load that passes the middle inertia by, as in a belt "
      "loop "
      "with a tensioner; 0: none (as stiffness)");
    v("bypass_damping", c.bypass_damping, "likewise (as damping)");
  }
  if (belt) {
    v("cart_mass_kg", c.cart_mass_kg, "mass of the cart with its load, > 0 (kg)");
    v("specific_stiffness_n", c.specific_stiffness_n, "stiffness of the belt times its length, > 0 (N)");
    v("quality", c.quality, "quality factor that sets the belt's damping, K/(2 pi f_res quality), > 0");
    v("upper_length_m", c.upper_length_m,
      "length of the belt from pulley over cart to pulley, less the cart (m)");
    v("lower_length_m", c.lower_length_m, "length of the belt's other side (m)");
    v("stroke_from_m", c.stroke_from_m, "lowest position of the cart, > 0 (m)");
    v("stroke_to_m", c.stroke_to_m, "highest position of the cart, below upper_length_m (m)");
  }
  if (c.structure != Structure::rigid)
    v("radius_m", c.radius_m,
      belt ? "pitch radius of the driven pulley, > 0 (m)"
           : "radius of the belt's rollers; 0: stiffness and damping are those of a shaft (m)");
  if (coupled)
    v("load_radius_m", c.load_radius_m,
      "radius of the load's roller where it differs; the load is referred by (radius_m/load_radius_m)^2 (m)");
  v("viscous_friction", c.viscous_friction, "torque per velocity on the driven side, >= 0 (Nms/rad)");
  if (c.structure != Structure::rigid)
    v("load_viscous_friction", c.load_viscous_friction,
      "the same on the load, referred to the driven shaft, >= 0 (Nms/rad)");
  if (coupled || c.structure == Structure::rigid)
    v("motor_ground_stiffness", c.motor_ground_stiffness,
      "of a spring from the driven side to the ground, at rest at position 0 (flexure, gas spring), >= 0 "
      "(Nm/rad)");
  if (coupled)
    v("load_ground_stiffness", c.load_ground_stiffness,
      "the same on the load, referred to the driven shaft, >= 0 (Nm/rad)");
  if (c.structure == Structure::two_mass) {
    v("backlash", c.backlash,
      "whole width of the play in the coupling, within which it gives no torque; 0: none (rad; m of a belt "
      "when "
      "radius_m is given)");
    v("stiffening_twist", c.stiffening_twist,
      "twist d0 at which the coupling's restoring torque, stiffness d (1 + (d/d0)^2), is twice that of the "
      "linear one, d beyond the play; 0: linear (as backlash)");
  }
}

[[nodiscard]] expected<void, Error> check(const DriveConfig& config) noexcept;

/// Stiffness that the cart of a tooth belt sees at a position (Nevaranta 2016, eq. 2.7):
/// K1 + K2 K3/(K2 + K3) with Ki = c/li, l1 the position.
[[nodiscard]] double tooth_belt_stiffness(const DriveConfig& config, double position_m) noexcept;

/// Play and the twist at which the torque doubles, at the driven shaft (rad, m); 0: none, and linear.
struct BentCoupling {
  double play = 0.0;
  double stiffening_twist = 0.0;
  [[nodiscard]] bool bends() const noexcept { return play > 0.0 || stiffening_twist > 0.0; }
};
[[nodiscard]] BentCoupling bent_coupling(const DriveConfig& config) noexcept;

/// The machine's masses and couplings at the driven shaft, with every stiffness times `factor`. A tooth belt
/// is taken at the position; its damping follows its stiffness.
[[nodiscard]] MassSystem mass_system(const DriveConfig& config, double factor = 1.0, double position_m = 0.0);

/// The two-mass parameters at the driven shaft: for a belt K r², D r². Two-mass drives, and
/// tooth belts at a position.
[[nodiscard]] data::TwoMassParameters at_driven_shaft(const DriveConfig& config,
                                                      double position_m = 0.0) noexcept;

/// A machine with what surrounds it up to the torque command.
struct MachineConfig {
  DriveConfig drive;
  FrictionConfig friction;
  DisturbanceConfig disturbance;
  double torque_lag_s = 0.0;  ///< Time constant of the torque loop, 0: none.
  data::SecondOutput second_output = data::SecondOutput::none;
};

/// `early_fraction` in [0, 1), see Drive::advance; `longest_s` is how long the drive will run at most: over
/// that time its stiffness must stay positive.
[[nodiscard]] expected<std::unique_ptr<Drive>, Error> make_drive(const MachineConfig& machine,
                                                                 double sample_rate_hz, double early_fraction,
                                                                 double longest_s = 0.0);

}  // namespace resonid::plant
