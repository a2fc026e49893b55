// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/plant/detail/drive.hpp>

namespace resonid::plant {

/// A machine whose stiffness depends on time and on the cart's position: what it is now, and between which
/// limits it can go.
class Machine {
 public:
  Machine(MachineConfig config, double longest_s);

  [[nodiscard]] const MachineConfig& config() const noexcept { return config_; }
  [[nodiscard]] bool varies() const noexcept { return lowest_ < highest_; }
  [[nodiscard]] double lowest_factor() const noexcept { return lowest_; }
  [[nodiscard]] double highest_factor() const noexcept { return highest_; }

  /// Stiffness at a time and place over the nominal one (that of a tooth belt where the stroke begins),
  /// within the limits.
  [[nodiscard]] double factor(double time_s, double place) const noexcept;
  [[nodiscard]] MassSystem system(double factor) const;
  [[nodiscard]] std::size_t masses() const { return system(1.0).masses(); }
  [[nodiscard]] bool grounded() const { return system(1.0).grounded(); }
  /// Place of the cart, or angle of the driven side, from the angles of driven side and load; and back.
  [[nodiscard]] double place(double driven_angle, double load_angle) const noexcept;

  [[nodiscard]] double load_torque(double time_s) const noexcept;
  /// Stretch of the first coupling at an angle of the driven side, at the driven shaft (rad).
  [[nodiscard]] double stretch(double driven_angle) const noexcept;
  [[nodiscard]] bool disturbed() const noexcept;

 private:
  MachineConfig config_;
  double nominal_stiffness_ = 1.0;  // of a tooth belt
  double lowest_ = 1.0;
  double highest_ = 1.0;
};

}  // namespace resonid::plant
