// SPDX-License-Identifier: MIT
#include <array>
#include <resonid/plant/linear_drive.hpp>

namespace resonid::plant {

std::span<const std::string_view> enum_names(Structure) noexcept {
  static constexpr std::array<std::string_view, 2> kNames{"two-mass", "rigid"};
  return kNames;
}

expected<void, ConfigError> check(const DriveConfig& c) noexcept {
  if (!(c.driven_inertia > 0.0)) return refuse("driven_inertia", "must be > 0", c.driven_inertia);
  if (c.structure == Structure::two_mass) {
    if (!(c.load_inertia > 0.0)) return refuse("load_inertia", "must be > 0", c.load_inertia);
    if (!(c.stiffness > 0.0)) return refuse("stiffness", "must be > 0", c.stiffness);
    if (!(c.damping >= 0.0)) return refuse("damping", "must be >= 0", c.damping);
    if (!(c.radius_m >= 0.0)) return refuse("radius_m", "must be >= 0", c.radius_m);
  }
  if (!(c.viscous_friction >= 0.0)) return refuse("viscous_friction", "must be >= 0", c.viscous_friction);
  return {};
}

data::TwoMassParameters at_driven_shaft(const DriveConfig& c) noexcept {
  const double r2 = c.radius_m > 0.0 ? c.radius_m * c.radius_m : 1.0;
  return {c.driven_inertia, c.load_inertia, r2 * c.stiffness, r2 * c.damping, c.viscous_friction};
}

expected<std::unique_ptr<Drive>, ConfigError> make_drive(const DriveConfig& config, double sample_rate_hz,
                                                         double early_fraction) {
  if (const auto checked = check(config); !checked) return unexpected(checked.error());
  if (!(sample_rate_hz > 0.0)) return refuse("sample_rate_hz", "must be > 0", sample_rate_hz);
  if (!(early_fraction >= 0.0 && early_fraction < 1.0))
    return refuse("early_fraction", "must be >= 0 and < 1", early_fraction);
  const double step = 1.0 / sample_rate_hz;
  std::unique_ptr<Drive> drive;
  if (config.structure == Structure::rigid)
    drive = std::make_unique<RigidDrive>(rigid_system(config.driven_inertia, config.viscous_friction), step,
                                         early_fraction);
  else
    drive = std::make_unique<TwoMassDrive>(data::continuous_system(at_driven_shaft(config)), step,
                                           early_fraction);
  return drive;
}

}  // namespace resonid::plant
