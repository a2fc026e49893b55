// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/margins.hpp>

namespace resonid::diagnostics {
namespace {

using Complex = std::complex<double>;

double degrees(double radians) { return radians * 180.0 / kPi; }

/// L between two lines: logarithmic in magnitude, the shorter way round in phase.
Complex between(Complex a, Complex b, double t) {
  const Complex ratio = b / a;
  return a * std::polar(std::pow(std::abs(ratio), t), t * std::arg(ratio));
}

double phase_margin(Complex on_unit_circle) {
  double margin = 180.0 + degrees(std::arg(on_unit_circle));
  if (margin > 180.0) margin -= 360.0;
  return margin;
}

/// Point of the chord a-b nearest to -1.
double nearest_on_chord(Complex a, Complex b) {
  const Complex d = b - a;
  const double length = std::norm(d);
  if (!(length > 0.0)) return 0.0;
  return std::clamp((std::conj(d) * (Complex(-1.0) - a)).real() / length, 0.0, 1.0);
}

}  // namespace

std::optional<double> LoopMargins::crossover_hz() const {
  if (crossovers.empty()) return std::nullopt;
  return crossovers.front().frequency_hz;
}

std::optional<double> LoopMargins::phase_margin_deg() const {
  if (crossovers.empty()) return std::nullopt;
  return crossovers.front().phase_margin_deg;
}

LoopMargins loop_margins(const data::FrequencyResponse& loop) {
  LoopMargins margins;
  if (loop.lines() == 0) return margins;
  margins.modulus_margin = std::abs(1.0 + loop.value[0]);
  margins.modulus_margin_hz = loop.frequency_hz[0];
  for (std::size_t i = 0; i + 1 < loop.lines(); ++i) {
    const Complex a = loop.value[i];
    const Complex b = loop.value[i + 1];
    if (a == 0.0 || b == 0.0) continue;
    const double fa = loop.frequency_hz[i];
    const double step = loop.frequency_hz[i + 1] - fa;

    const double la = std::log(std::abs(a));
    const double lb = std::log(std::abs(b));
    if ((la >= 0.0) != (lb >= 0.0)) {
      const double t = la / (la - lb);
      const double margin = phase_margin(between(a, b, t));
      if (la >= 0.0) margins.crossovers.push_back({fa + t * step, margin});
      if (!margins.worst_phase_margin_deg || std::abs(margin) < std::abs(*margins.worst_phase_margin_deg))
        margins.worst_phase_margin_deg = margin;
    }

    const double nearest = nearest_on_chord(a, b);
    const double distance = std::abs(1.0 + a + nearest * (b - a));
    if (distance < margins.modulus_margin) {
      margins.modulus_margin = distance;
      margins.modulus_margin_hz = fa + nearest * step;
    }

    // Crossing of the negative real axis; neighbours more than 90 degrees apart say nothing about it.
    const double turn = std::arg(b / a);
    const double pa = std::arg(-a);
    if (std::abs(turn) < 0.5 * kPi && (pa >= 0.0) != (pa + turn >= 0.0) && std::abs(pa) < 0.5 * kPi) {
      const double t = -pa / turn;
      const double gain = -20.0 * std::log10(std::abs(between(a, b, t)));
      if (gain > 0.0 && (!margins.gain_margin_db || gain < *margins.gain_margin_db)) {
        margins.gain_margin_db = gain;
        margins.gain_margin_hz = fa + t * step;
      }
    }
  }
  return margins;
}

NyquistDistances nyquist_distances(Complex loop) { return {std::abs(loop), std::abs(1.0 + loop)}; }

NyquistResonance nyquist_resonance(const data::FrequencyResponse& loop) {
  NyquistResonance found;
  double deepest = 0.0;
  double highest = 0.0;
  for (std::size_t i = 1; i + 1 < loop.lines(); ++i) {
    const auto before = nyquist_distances(loop.value[i - 1]);
    const auto here = nyquist_distances(loop.value[i]);
    const auto after = nyquist_distances(loop.value[i + 1]);
    const bool region = loop.value[i].imag() < 0.0 && loop.value[i].real() > 0.0;
    if (region && here.d2 >= before.d2 && here.d2 >= after.d2 && here.d2 > highest) {
      highest = here.d2;
      found.resonance_hz = loop.frequency_hz[i];
    }
    if (region && here.d1 <= before.d1 && here.d1 <= after.d1 &&
        (!found.antiresonance_hz || here.d1 < deepest)) {
      deepest = here.d1;
      found.antiresonance_hz = loop.frequency_hz[i];
    }
  }
  return found;
}

}  // namespace resonid::diagnostics
