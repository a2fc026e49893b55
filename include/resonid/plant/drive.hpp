// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/two_mass.hpp>
#include <span>
#include <string_view>

namespace resonid::plant {

/// What every simulated machine offers: torque in, velocity of the driven side out, one sample at a time,
/// with the torque held between samples.
class Drive {
 public:
  virtual ~Drive() = default;

  /// Puts the machine in the steady state at this velocity; returns the torque that holds it there.
  virtual double settle(double velocity) = 0;

  /// Moves on by one sample time under constant torque. Returns the velocity `early_fraction` of a sample
  /// before the end of that time (fixed at creation; 0: at its end), which is how a delay of a fraction of a
  /// sample is exact.
  virtual double advance(double torque) noexcept = 0;
};

enum class Structure { two_mass, rigid };
[[nodiscard]] std::span<const std::string_view> enum_names(Structure) noexcept;

struct DriveConfig {
  Structure structure = Structure::two_mass;
  data::Motion motion = data::Motion::rotary;
  double driven_inertia = 0.0;
  double load_inertia = 0.0;
  double stiffness = 0.0;
  double damping = 0.0;
  double radius_m = 0.0;
  double viscous_friction = 0.0;
};

/// The fields in the order of reading; `structure` is set first and selects the rest.
template <class Visitor>
void describe(Visitor&& v, DriveConfig& c) {
  v("structure", c.structure, "two-mass or rigid");
  v("motion", c.motion, "rotary (kgm2, Nm/rad, Nms/rad) or linear (kg, N/m, Ns/m)");
  v("driven_inertia", c.driven_inertia,
    "inertia of the driven side, of the whole machine when rigid, > 0 (kgm2)");
  if (c.structure == Structure::two_mass) {
    v("load_inertia", c.load_inertia, "inertia of the load, referred to the driven shaft, > 0 (kgm2)");
    v("stiffness", c.stiffness, "of the coupling, > 0 (Nm/rad; N/m of a belt when radius_m is given)");
    v("damping", c.damping, "of the coupling, >= 0 (Nms/rad; Ns/m of a belt when radius_m is given)");
    v("radius_m", c.radius_m,
      "radius of the belt's rollers; 0: stiffness and damping are those of a shaft (m)");
  }
  v("viscous_friction", c.viscous_friction, "torque per velocity on the driven side, >= 0 (Nms/rad)");
}

[[nodiscard]] expected<void, ConfigError> check(const DriveConfig& config) noexcept;

/// The two-mass parameters at the driven shaft: for a belt K r², D r² (METHOD 2.1).
[[nodiscard]] data::TwoMassParameters at_driven_shaft(const DriveConfig& config) noexcept;

/// `early_fraction` in [0, 1), see Drive::advance.
[[nodiscard]] expected<std::unique_ptr<Drive>, ConfigError> make_drive(const DriveConfig& config,
                                                                       double sample_rate_hz,
                                                                       double early_fraction);

}  // namespace resonid::plant
