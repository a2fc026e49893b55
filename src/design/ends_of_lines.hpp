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

/// The largest |L| at the last line: beyond it the response may be anything up to twice what it would be.
inline constexpr double kLargestAtEnd = 0.5;
/// The same where |L| rises there: the lines end on the flank of a resonance, of which |L| is a small part.
inline constexpr double kLargestRising = 0.25;

/// Above such lines nothing stands.
[[nodiscard]] inline bool reach_half_the_rate(double last_hz, double sample_time_s) noexcept {
  constexpr double kNearly = 0.95;
  return 2.0 * last_hz * sample_time_s >= kNearly;
}

/// Steps from a ten-thousandth of the first line up to it along which a controller of any kind is followed.
inline constexpr int kStepsBelowFirstLine = 2000;

struct LoopEnd {
  double size = 0.0;  ///< |L| at the last line; of a line that errs the largest within its error.
  double rise = 1.0;  ///< |L| at the last line over the least in the octave below it.

  [[nodiscard]] bool rises() const {
    constexpr double kFlat = 1.1;
    return rise > kFlat;
  }
};

/// Of a loop at ascending frequencies, of which `size_at(i)` is |L| at a line, and `size` that at the last
/// one with its error. The octave is looked at down to where |L| was twice as large: past a peak it falls,
/// whatever lies below that.
template <class SizeAt>
[[nodiscard]] LoopEnd loop_end(std::span<const double> frequencies_hz, SizeAt&& size_at, double size) {
  constexpr double kPastPeak = 2.0;
  const double last = size_at(frequencies_hz.size() - 1);
  double least = last;
  for (std::size_t i = frequencies_hz.size(); i-- > 0 && frequencies_hz[i] >= 0.5 * frequencies_hz.back();) {
    const double here = size_at(i);
    if (here > kPastPeak * last) break;
    least = std::min(least, here);
  }
  return {size, last / least};
}

/// Whether what the lines do not show may make the loop unstable. A thousandth more than the limit is none:
/// designs reach it, and gains are rounded.
[[nodiscard]] inline bool ends_too_large(const LoopEnd& end) {
  constexpr double kRounding = 1e-3;
  return !(end.size <= (end.rises() ? kLargestRising : (1.0 + kRounding) * kLargestAtEnd));
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
