// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <optional>
#include <resonid/base/constants.hpp>
#include <span>

// What is taken for granted of a machine below the first and above the last line of its response
// (docs/methods/tune.md 7.7): that it integrates its torque, and that no resonance stands close by.
namespace resonid::design {

/// Steps from a ten-thousandth of the first line up to it along which a controller of any kind is followed.
inline constexpr int kStepsBelowFirstLine = 2000;

/// What lines tell of a machine at the last of them, from where on it is not known.
struct MachineEnd {
  double size = 0.0;   ///< The largest |G| there within its error, or what an inertia brings there if larger.
  bool rises = false;  ///< On the flank of a resonance, which stands above.
  bool dips = false;   ///< Before an anti-resonance, above which a resonance stands.
  bool is_sparse = false;  ///< Too few lines in the last octave to tell either.
  bool is_whole = false;   ///< Lines reach half of the sample rate, above which nothing stands.

  /// The largest |L| for which nothing that stands above makes the loop unstable. What is not seen may be
  /// twice as large as an inertia would be; a resonance of which the flank is seen, fifty times; between the
  /// last line and half of the rate no room is left for one.
  [[nodiscard]] double largest_loop() const {
    return is_whole ? 0.9 : is_below_resonance() ? kBelowResonance : 0.5;
  }
  [[nodiscard]] bool is_below_resonance() const { return !is_whole && (rises || dips || is_sparse); }
  static constexpr double kBelowResonance = 0.02;
};

/// Of a machine at ascending frequencies: |G| and its largest error at each.
///
/// What is looked at is |G| 2 sin(pi f Ts), of an inertia one number, w: lines within 5 % of a frequency
/// together, so that the noise of single ones is no rise, and at least four of them in the last octave. It
/// rises by a fifth within that octave on the flank of a resonance. A peak, from which w falls by a third on
/// both sides, has been passed; past it w stays above what it was below that resonance and its
/// anti-resonance, or falls towards the next one. Where none was passed w falls towards an anti-resonance
/// quicker and quicker, as 1 - (f/fa)^2, which a lag does not; velocities by differences fall by cos(pi f
/// Ts), which is no dip. As long as w only falls, and where it rises again, |G| counts as the inertia's.
[[nodiscard]] MachineEnd machine_end(std::span<const double> frequencies_hz, std::span<const double> sizes,
                                     std::span<const double> radii, double sample_time_s);

/// Whether what the lines do not show may make the loop unstable; `largest_controller`: |C| from the last
/// line on. A thousandth more than the limit is none: designs reach it, and gains are rounded.
[[nodiscard]] inline bool ends_too_large(const MachineEnd& end, double largest_controller) {
  constexpr double kRounding = 1e-3;
  return !(end.size * largest_controller <= (1.0 + kRounding) * end.largest_loop());
}

/// A quarter turn away from an inertia is no delay that a loop of |L| > 1 would stand there: the sign is
/// wrong, or the line lies between an anti-resonance and its resonance.
[[nodiscard]] inline bool begins_as_inertia(std::complex<double> machine) {
  return std::abs(std::arg(machine * std::complex<double>(0.0, 1.0))) < 0.5 * kPi;
}

/// arg(1 + L) at the first line, where the machine's response is `machine`, without jumps from a
/// ten-thousandth of its frequency up, in so many steps. There the machine is an inertia, and what turns its
/// response away from -90 deg at the line is a delay; each integrator of the controller turns by as much.
/// `controller(part)`: C at that part of the line's frequency. Nothing where L begins on the other side: its
/// sign is wrong.
template <class Controller>
[[nodiscard]] std::optional<double> angle_at_first_line(std::complex<double> machine, double integrators,
                                                        int steps, Controller&& controller) {
  constexpr double kDecades = 4.0, kSameSide = 2.0 / 3.0 * kPi;
  const std::complex<double> inertia = machine * std::complex<double>(0.0, 1.0);
  double angle = -0.5 * kPi * (1.0 + integrators);
  auto before = std::polar(1.0, angle);
  for (int i = 0; i <= steps; ++i) {
    const double part = std::pow(10.0, -kDecades * (steps - i) / steps);
    const auto g = std::polar(std::abs(inertia) / part, std::arg(inertia) * part - 0.5 * kPi);
    const std::complex<double> now = 1.0 + controller(part) * g;
    const double turn = std::arg(now * std::conj(before));
    if (i == 0 && std::abs(turn) > kSameSide) return std::nullopt;
    angle += turn;
    before = now;
  }
  return angle;
}

}  // namespace resonid::design
