// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <resonid/base/enum_names.hpp>
#include <resonid/online/axis_result.hpp>
#include <span>

namespace resonid::monitoring {

/// What is followed of a machine and watched for changes.
enum class Watched : std::uint8_t {
  resonance,         ///< Hz, undamped
  antiresonance,     ///< Hz, undamped
  stiffness,         ///< Nm/rad at the driven shaft
  driven_inertia,    ///< kgm2
  load_inertia,      ///< kgm2
  damping,           ///< Nms/rad
  coulomb_friction,  ///< Nm
  load_torque,       ///< Nm: the constant torque that the input does not hold
  modulus_margin,    ///< min |1 + L|
  phase_margin,      ///< degrees
  gap,               ///< largest chordal distance to the baseline, 0 ... 1
};
inline constexpr std::size_t kWatched = 11;
inline constexpr EnumName<Watched> kWatchedNames[] = {{Watched::resonance, "resonance"},
                                                      {Watched::antiresonance, "antiresonance"},
                                                      {Watched::stiffness, "stiffness"},
                                                      {Watched::driven_inertia, "driven-inertia"},
                                                      {Watched::load_inertia, "load-inertia"},
                                                      {Watched::damping, "damping"},
                                                      {Watched::coulomb_friction, "coulomb-friction"},
                                                      {Watched::load_torque, "load-torque"},
                                                      {Watched::modulus_margin, "modulus-margin"},
                                                      {Watched::phase_margin, "phase-margin"},
                                                      {Watched::gap, "gap"}};
[[nodiscard]] constexpr std::span<const EnumName<Watched>> enum_names(Watched) noexcept {
  return kWatchedNames;
}

/// What is known of an axis at one instant.
struct Row {
  std::uint64_t sample = 0;  ///< Index of the newest sample in it.
  double lag_samples = 0.0;  ///< It describes the machine of so many samples before that.
  std::array<online::Figure, kWatched> figures{};
  double coherence = online::AxisRow::kUnknown;
  double residual_rms = online::AxisRow::kUnknown;  ///< In the output's unit.
  online::AxisGates gates;
  online::AxisVerdict verdict = online::AxisVerdict::not_measured;
  bool trusted = false;

  [[nodiscard]] const online::Figure& operator[](Watched w) const noexcept {
    return figures[static_cast<std::size_t>(w)];
  }
  [[nodiscard]] online::Figure& operator[](Watched w) noexcept {
    return figures[static_cast<std::size_t>(w)];
  }
};

}  // namespace resonid::monitoring
