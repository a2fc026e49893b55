// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/models/discrete_model.hpp>

namespace resonid::online::detail {

/// What an estimator tells about one instant, the same for all of them.
struct AxisReading {
  using Model = DiscreteModel<double, 3>;
  using Covariance = ModelCovariance<double, 3>;
  static constexpr double kUnknown = AxisRow::kUnknown;

  std::uint64_t sample = 0;
  double lag_samples = 0.0;
  bool ready = false, excited = true, physical = true;
  bool finds_resonance = true;   ///< Otherwise `uncertainty` is that of something else.
  bool has_model = false;        ///< `model` answers at any frequency.
  bool wants_covariance = true;  ///< Said by the axis: the rows hold what needs it.
  Model model;  ///< Discrete model of the plant; for a rigid machine all beyond order 1 is 0.
  std::array<Figure, kAxisParameters> parameter{};
  Figure resonance_hz, antiresonance_hz;
  double resonance_damping = kUnknown, antiresonance_damping = kUnknown;
  double driven_inertia = kUnknown, load_inertia = kUnknown, stiffness = kUnknown;
  double uncertainty = kUnknown, most_uncertainty = kUnknown;
  double coherence = kUnknown;
  double first_line_hz = 0.0, last_line_hz = std::numeric_limits<double>::infinity();

  /// Covariance of the model, [b, a]; infinite or 0 while it is not known.
  [[nodiscard]] Covariance covariance() const noexcept {
    return Eigen::Map<const Covariance>(covariance_.data());
  }
  void set_covariance(const Covariance& c) noexcept {
    covariance_known_ = true;
    Eigen::Map<Covariance>(covariance_.data()) = c;
  }
  [[nodiscard]] bool covariance_known() const noexcept { return covariance_known_; }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return intact_flags(ready, excited, physical, finds_resonance, has_model, wants_covariance,
                        covariance_known_);
  }

 private:
  std::array<double, 36> covariance_{};  // an Eigen matrix is not trivially copyable
  bool covariance_known_ = false;
};

/// Modes, masses and plausibility of reading.model. A machine has its poles inside the unit circle (an
/// integrator may lie a little outside), a torque that accelerates it, and oscillates with a positive
/// damping; one of order 1 does not oscillate. Masses from the residue at z = 1, G -> (Ts/J)/(z - 1), and
/// J2/J1 = (w_res/w_ares)^2 - 1.
void find_modes(AxisReading& reading, std::size_t order, double sample_rate_hz) noexcept;

}  // namespace resonid::online::detail
