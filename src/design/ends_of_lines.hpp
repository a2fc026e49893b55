// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <resonid/base/constants.hpp>
#include <span>

// What is taken for granted of a machine below the first and above the last line of its response
// (docs/methods/tune.md 7.7): that it integrates its torque, and that no resonance stands close by.
namespace resonid::design {

/// |L| at the last line: beyond it the response may be anything up to twice what it would be.
inline constexpr double kLargestLoopAtEnd = 0.5;

/// By how much |L|, of which `loop_size(i)` is that at a line, is larger at the last line than anywhere in
/// the octave below it, down to where it was twice as large: past a peak it falls, whatever lies below that.
template <class Size>
[[nodiscard]] double rise_at_end(std::span<const double> frequency_hz, Size&& loop_size) {
  constexpr double kPastPeak = 2.0;
  const double at_end = loop_size(frequency_hz.size() - 1);
  double least = at_end;
  for (std::size_t i = frequency_hz.size(); i-- > 0 && frequency_hz[i] >= 0.5 * frequency_hz.back();) {
    const double size = loop_size(i);
    if (size > kPastPeak * at_end) break;
    least = std::min(least, size);
  }
  return at_end / least;
}

/// Whether the lines end on the flank of a resonance that the loop would meet above them; `size`: |L| at the
/// last one, with its error.
[[nodiscard]] inline bool ends_on_flank(double size, double rise) noexcept {
  constexpr double kNear = 0.5 * kLargestLoopAtEnd, kFlat = 1.1;
  return size > kNear && rise > kFlat;
}

/// A quarter turn away from an inertia is no delay that a loop of |L| > 1 would stand there: the sign is
/// wrong, or the line lies between an anti-resonance and its resonance.
[[nodiscard]] inline bool begins_as_inertia(std::complex<double> machine) {
  return std::abs(std::arg(machine * std::complex<double>(0.0, 1.0))) < 0.5 * kPi;
}

/// arg(1 + L) at the first line, where the machine's response is `machine`, without jumps from the turn on
/// which it lies `decades` below: there the machine is an inertia, and what turns its response away from -90
/// deg at the line is a delay. `controller(part)`: C at that part of the line's frequency; `turn_below`: near
/// which arg(1 + L) lies at the lowest.
template <class Controller>
[[nodiscard]] double angle_at_first_line(std::complex<double> machine, double decades, double turn_below,
                                         Controller&& controller) {
  constexpr int kSteps = 200;
  const std::complex<double> inertia = machine * std::complex<double>(0.0, 1.0);
  double angle = turn_below;
  auto before = std::polar(1.0, turn_below);
  for (int i = 0; i <= kSteps; ++i) {
    const double part = std::pow(10.0, -decades * (kSteps - i) / kSteps);
    const auto g = std::polar(std::abs(inertia) / part, std::arg(inertia) * part - 0.5 * kPi);
    const std::complex<double> now = 1.0 + controller(part) * g;
    angle += std::arg(now * std::conj(before));
    before = now;
  }
  return angle;
}

}  // namespace resonid::design
