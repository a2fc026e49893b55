// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "linalg/decompositions.hpp"
#include "plant/elastic_drives.hpp"

namespace resonid::plant {
namespace {

double squared(double x) noexcept { return x * x; }
bool is_not_negative(double x) noexcept { return x >= 0.0 && std::isfinite(x); }

/// Stiffness and damping of a belt at the driven shaft, or as they stand.
double shaft_factor(const DriveConfig& c) noexcept { return c.radius_m > 0.0 ? squared(c.radius_m) : 1.0; }

double load_factor(const DriveConfig& c) noexcept {
  return c.radius_m > 0.0 && c.load_radius_m > 0.0 ? squared(c.radius_m / c.load_radius_m) : 1.0;
}

/// Damping that gives the resonance its quality (Nevaranta 2016, Table 2.2): b = K/(2 pi f_res Q), at the
/// driven shaft.
double belt_damping(const DriveConfig& c, double stiffness, double load_inertia) noexcept {
  const double omega = std::sqrt(stiffness * (1.0 / c.driven_inertia + 1.0 / load_inertia));
  return stiffness / (omega * c.quality);
}

expected<void, Error> check_coupled(const DriveConfig& c) noexcept {
  if (!(c.load_inertia > 0.0)) return refuse("load_inertia", "must be > 0", c.load_inertia);
  if (!(c.stiffness > 0.0)) return refuse("stiffness", "must be > 0", c.stiffness);
  if (!(c.damping >= 0.0)) return refuse("damping", "must be >= 0", c.damping);
  if (!(c.load_radius_m >= 0.0)) return refuse("load_radius_m", "must be >= 0", c.load_radius_m);
  if (c.load_radius_m > 0.0 && !(c.radius_m > 0.0))
    return refuse("load_radius_m", "needs radius_m beside it", c.load_radius_m);
  if (c.structure == Structure::two_mass) return {};
  if (!(c.middle_inertia > 0.0)) return refuse("middle_inertia", "must be > 0", c.middle_inertia);
  if (!(c.stiffness_2 > 0.0)) return refuse("stiffness_2", "must be > 0", c.stiffness_2);
  if (!(c.damping_2 >= 0.0)) return refuse("damping_2", "must be >= 0", c.damping_2);
  if (!(c.bypass_stiffness >= 0.0)) return refuse("bypass_stiffness", "must be >= 0", c.bypass_stiffness);
  if (!(c.bypass_damping >= 0.0)) return refuse("bypass_damping", "must be >= 0", c.bypass_damping);
  return {};
}

expected<void, Error> check_chain(const DriveConfig& c) noexcept {
  if (c.inertias.empty() || c.inertias.size() > kMaxMasses)
    return refuse("inertias", "must hold 1 ... 6 values");
  if (c.stiffnesses.size() + 1 != c.inertias.size())
    return refuse("stiffnesses", "must hold one value less than inertias");
  if (c.dampings.size() != c.stiffnesses.size())
    return refuse("dampings", "must hold as many values as stiffnesses");
  for (const double x : c.inertias)
    if (!(x > 0.0)) return refuse("inertias", "must be > 0", x);
  for (const double x : c.stiffnesses)
    if (!(x > 0.0)) return refuse("stiffnesses", "must be > 0", x);
  for (const double x : c.dampings)
    if (!(x >= 0.0)) return refuse("dampings", "must be >= 0", x);
  return {};
}

expected<void, Error> check_belt(const DriveConfig& c) noexcept {
  if (!(c.cart_mass_kg > 0.0)) return refuse("cart_mass_kg", "must be > 0", c.cart_mass_kg);
  if (!(c.specific_stiffness_n > 0.0))
    return refuse("specific_stiffness_n", "must be > 0", c.specific_stiffness_n);
  if (!(c.quality > 0.0)) return refuse("quality", "must be > 0", c.quality);
  if (!(c.radius_m > 0.0)) return refuse("radius_m", "must be > 0", c.radius_m);
  if (!(c.lower_length_m > 0.0)) return refuse("lower_length_m", "must be > 0", c.lower_length_m);
  if (!(c.stroke_from_m > 0.0)) return refuse("stroke_from_m", "must be > 0", c.stroke_from_m);
  if (!(c.stroke_to_m > c.stroke_from_m))
    return refuse("stroke_to_m", "must be more than stroke_from_m", c.stroke_to_m);
  if (!(c.upper_length_m > c.stroke_to_m))
    return refuse("upper_length_m", "must be more than stroke_to_m", c.upper_length_m);
  return {};
}

/// What has nothing to act on in a machine without a coupling.
expected<void, Error> check_rigid(const DisturbanceConfig& d) noexcept {
  constexpr const char* kNeeds = "needs a coupling: this machine is rigid";
  if (d.eccentricity != 0.0) return refuse("eccentricity", kNeeds, d.eccentricity);
  if (d.stiffness_drift_per_s != 0.0) return refuse("stiffness_drift_per_s", kNeeds, d.stiffness_drift_per_s);
  if (d.loosening != 0.0) return refuse("loosening", kNeeds, d.loosening);
  return {};
}

}  // namespace

std::complex<double> response(const SampledDrive& drive, double frequency_hz) {
  const Eigen::Index n = drive.moving_states();
  const std::complex<double> z = std::polar(1.0, kTwoPi * frequency_hz * drive.sample_time_s);
  Eigen::MatrixXcd m = -drive.a.topLeftCorner(n, n).cast<std::complex<double>>();
  m.diagonal().array() += z;
  const Eigen::VectorXcd x = linalg::ComplexLu(m).solve(drive.b.head(n).cast<std::complex<double>>());
  return (drive.velocity.head(n).cast<std::complex<double>>() * x)(0);
}

/// Denominator: characteristic polynomial by Faddeev and LeVerrier; numerator: from the impulse response
/// h(0) = 0, h(i) = c A^(i-1) b, as b_i = sum_j a_j h(i-j).
data::TransferFunction transfer_function(const SampledDrive& drive) {
  const Eigen::Index n = drive.moving_states();
  const Eigen::MatrixXd matrix = drive.a.topLeftCorner(n, n);
  const auto count = static_cast<std::size_t>(n) + 1;
  std::vector<double> a(count), h(count), b(count, 0.0);
  a[0] = 1.0;
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd x = drive.b.head(n);
  for (std::size_t i = 1; i < count; ++i) {
    m = (matrix * m).eval();
    m.diagonal().array() += a[i - 1];
    a[i] = -(matrix * m).trace() / static_cast<double>(i);
    h[i] = drive.velocity.head(n) * x;
    x = (matrix * x).eval();
  }
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j <= i; ++j) b[i] += a[j] * h[i - j];
  return {b, a, drive.sample_time_s};
}

expected<void, Error> check(const DriveConfig& c) noexcept {
  if (c.structure == Structure::chain) {
    if (const auto ok = check_chain(c); !ok) return ok;
  } else if (!(c.driven_inertia > 0.0)) {
    return refuse("driven_inertia", "must be > 0", c.driven_inertia);
  }
  if (c.structure == Structure::two_mass || c.structure == Structure::three_mass)
    if (const auto ok = check_coupled(c); !ok) return ok;
  if (c.structure == Structure::tooth_belt)
    if (const auto ok = check_belt(c); !ok) return ok;
  if (!(c.radius_m >= 0.0)) return refuse("radius_m", "must be >= 0", c.radius_m);
  if (!(c.viscous_friction >= 0.0)) return refuse("viscous_friction", "must be >= 0", c.viscous_friction);
  if (!(c.load_viscous_friction >= 0.0))
    return refuse("load_viscous_friction", "must be >= 0", c.load_viscous_friction);
  if (!is_not_negative(c.motor_ground_stiffness))
    return refuse("motor_ground_stiffness", "must be >= 0", c.motor_ground_stiffness);
  if (!is_not_negative(c.load_ground_stiffness))
    return refuse("load_ground_stiffness", "must be >= 0", c.load_ground_stiffness);
  if (!is_not_negative(c.backlash)) return refuse("backlash", "must be >= 0", c.backlash);
  if (!is_not_negative(c.stiffening_twist))
    return refuse("stiffening_twist", "must be >= 0", c.stiffening_twist);
  if (c.structure == Structure::two_mass && bent_coupling(c).bends() && c.load_ground_stiffness > 0.0)
    return refuse("load_ground_stiffness", "must be 0 beside backlash or stiffening_twist",
                  c.load_ground_stiffness);
  return {};
}

BentCoupling bent_coupling(const DriveConfig& c) noexcept {
  if (c.structure != Structure::two_mass) return {};
  const double radius = c.radius_m > 0.0 ? c.radius_m : 1.0;
  return {c.backlash / radius, c.stiffening_twist / radius};
}

double tooth_belt_stiffness(const DriveConfig& c, double position_m) noexcept {
  const double near = c.specific_stiffness_n / position_m;
  const double far = c.specific_stiffness_n / (c.upper_length_m - position_m);
  const double lower = c.specific_stiffness_n / c.lower_length_m;
  return near + far * lower / (far + lower);
}

MassSystem mass_system(const DriveConfig& c, double factor, double position_m) {
  const double shaft = shaft_factor(c);
  const double load = c.load_inertia * load_factor(c);
  MassSystem system;
  switch (c.structure) {
    case Structure::rigid:
      system = {{c.driven_inertia}, {0.0}, {}};
      break;
    case Structure::two_mass:
      system = {
          {c.driven_inertia, load}, {0.0, 0.0}, {{0, 1, shaft * factor * c.stiffness, shaft * c.damping}}};
      break;
    case Structure::three_mass:
      system = {{c.driven_inertia, c.middle_inertia, load},
                {0.0, 0.0, 0.0},
                {{0, 1, shaft * factor * c.stiffness, shaft * c.damping},
                 {1, 2, shaft * factor * c.stiffness_2, shaft * c.damping_2},
                 {0, 2, shaft * factor * c.bypass_stiffness, shaft * c.bypass_damping}}};
      break;
    case Structure::chain:
      system = {c.inertias, std::vector<double>(c.inertias.size(), 0.0), {}};
      for (std::size_t i = 0; i + 1 < c.inertias.size(); ++i)
        system.couplings.push_back({i, i + 1, shaft * factor * c.stiffnesses[i], shaft * c.dampings[i]});
      break;
    case Structure::tooth_belt: {
      const double cart = shaft * c.cart_mass_kg;
      const double stiffness = shaft * factor * tooth_belt_stiffness(c, position_m);
      system = {{c.driven_inertia, cart}, {0.0, 0.0}, {{0, 1, stiffness, belt_damping(c, stiffness, cart)}}};
      break;
    }
  }
  system.viscous.front() += c.viscous_friction;
  system.ground.assign(system.masses(), 0.0);
  const bool may_be_grounded = c.structure == Structure::rigid || c.structure == Structure::two_mass ||
                               c.structure == Structure::three_mass;
  if (may_be_grounded) system.ground.front() += c.motor_ground_stiffness;
  if (system.masses() > 1) {
    system.viscous.back() += c.load_viscous_friction;
    if (may_be_grounded) system.ground.back() += c.load_ground_stiffness;
  }
  return system;
}

data::TwoMassParameters at_driven_shaft(const DriveConfig& c, double position_m) noexcept {
  if (c.structure == Structure::tooth_belt) {
    const double cart = shaft_factor(c) * c.cart_mass_kg;
    const double stiffness = shaft_factor(c) * tooth_belt_stiffness(c, position_m);
    return {c.driven_inertia, cart, stiffness, belt_damping(c, stiffness, cart), c.viscous_friction};
  }
  const double shaft = shaft_factor(c);
  return {c.driven_inertia, load_factor(c) * c.load_inertia, shaft * c.stiffness, shaft * c.damping,
          c.viscous_friction};
}

expected<std::unique_ptr<Drive>, Error> make_drive(const MachineConfig& machine, double sample_rate_hz,
                                                   double early_fraction, double longest_s) {
  if (const auto ok = check(machine.drive); !ok) return unexpected(ok.error());
  if (const auto ok = check(machine.friction); !ok) return unexpected(ok.error());
  if (const auto ok = check(machine.disturbance); !ok) return unexpected(ok.error());
  if (!(machine.torque_lag_s >= 0.0)) return refuse("torque_lag_s", "must be >= 0", machine.torque_lag_s);
  if (!(sample_rate_hz > 0.0)) return refuse("sample_rate_hz", "must be > 0", sample_rate_hz);
  if (!(early_fraction >= 0.0 && early_fraction < 1.0))
    return refuse("early_fraction", "must be >= 0 and < 1", early_fraction);
  const double step = 1.0 / sample_rate_hz;
  Machine model(machine, longest_s);
  if (!(model.lowest_factor() > 0.0))
    return refuse("stiffness_drift_per_s", "must leave every stiffness above 0 over the whole run",
                  machine.disturbance.stiffness_drift_per_s);
  const std::size_t masses = model.system(1.0).masses();
  if (masses == 1 && machine.friction.load.any())
    return refuse("load_coulomb", "needs a load: this machine is rigid", machine.friction.load.coulomb);
  if (masses == 1)
    if (const auto ok = check_rigid(machine.disturbance); !ok) return unexpected(ok.error());
  if (!bent_coupling(machine.drive).bends()) return elastic_drive(std::move(model), step, early_fraction);
  if (machine.disturbance.eccentricity != 0.0)
    return refuse("eccentricity", "must be 0 beside backlash or stiffening_twist",
                  machine.disturbance.eccentricity);
  return bent_drive(std::move(model), step, early_fraction);
}

}  // namespace resonid::plant
