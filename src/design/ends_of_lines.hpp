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
  bool is_whole = false;  ///< Lines reach half of the sample rate, above which nothing stands.

  /// The largest |L| for which nothing that stands above makes the loop unstable. What is not seen may be
  /// twice as large as an inertia would be; a resonance of which the flank is seen, fifty times; between the
  /// last line and half of the rate no room is left for one.
  [[nodiscard]] double largest_loop() const {
    return is_whole ? 0.9 : is_below_resonance() ? kBelowResonance : 0.5;
  }
  [[nodiscard]] bool is_below_resonance() const { return !is_whole && (rises || dips); }
  static constexpr double kBelowResonance = 0.02;
};

/// Of a machine at ascending frequencies, of which `size_at(i)` is |G| and `radius_at(i)` its largest error.
/// In place of |G| that of an inertia is looked at as one, |G| 2 sin(pi f Ts), lines within 5 % of a
/// frequency together, so that the noise of single ones is no rise. It rises by a fifth within an octave on
/// the flank of a resonance; past a peak, of which the other side lies below, it falls. Towards an
/// anti-resonance it falls quicker and quicker, 1 - (f/fa)^2, which a lag does not. As long as it only falls,
/// |G| counts as an inertia's.
template <class SizeAt, class RadiusAt>
[[nodiscard]] MachineEnd machine_end(std::span<const double> frequencies_hz, SizeAt&& size_at,
                                     RadiusAt&& radius_at, double sample_time_s) {
  constexpr double kGroup = 1.05, kSure = 0.6, kRise = 1.2, kPastPeak = 1.3, kPeak = 1.5;
  constexpr double kLittle = 0.25, kLess = 0.6, kSteep = 1.5, kQuarter = 1.19;
  constexpr double kOctave = 2.0, kTwoOctaves = 4.0, kNearlyHalf = 0.95;
  const double last_hz = frequencies_hz.back();
  const auto per_inertia = [&](double f) { return 2.0 * std::sin(kPi * std::min(f * sample_time_s, 0.5)); };
  MachineEnd end;
  end.is_whole = 2.0 * last_hz * sample_time_s >= kNearlyHalf;
  double last = 0.0, last_error = 0.0, largest = 0.0;
  double steepness = 0.0;  // over a quarter of an octave
  bool first = true, is_past_peak = false, has_peak = false;
  for (std::size_t i = frequencies_hz.size(); i > 0;) {
    const double top_hz = frequencies_hz[i - 1];
    if (kTwoOctaves * top_hz < last_hz) break;
    double sum = 0.0, squares = 0.0, lines = 0.0;
    for (; i > 0 && kGroup * frequencies_hz[i - 1] > top_hz; --i) {
      const double scale = per_inertia(frequencies_hz[i - 1]), radius = scale * radius_at(i - 1);
      sum += scale * size_at(i - 1);
      squares += radius * radius;
      ++lines;
    }
    const double here = sum / lines, error = kSure * std::sqrt(squares) / lines;
    if (steepness == 0.0 && kQuarter * top_hz < last_hz)
      steepness = std::log(std::max(here - error, 0.0) / (last + last_error)) / std::log(last_hz / top_hz);
    if (first) {
      last = here;
      last_error = error;
      first = false;
    }
    is_past_peak = is_past_peak || here - error > kPastPeak * (last + last_error);
    if (!is_past_peak && kOctave * top_hz >= last_hz && last - last_error > kRise * (here + error))
      end.rises = true;
    has_peak = has_peak || kPeak * (here + error) < largest;
    largest = std::max(largest, here - error);
  }
  end.dips = !has_peak && (last + last_error < kLittle * largest ||
                           (last + last_error < kLess * largest && steepness > kSteep));
  end.size = size_at(frequencies_hz.size() - 1) + radius_at(frequencies_hz.size() - 1);
  if (!end.is_whole && (end.rises || !has_peak))
    end.size = std::max(end.size, largest / per_inertia(last_hz));
  return end;
}

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
