// SPDX-License-Identifier: MIT
#include "design/line_margins.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <resonid/base/constants.hpp>

namespace resonid::design {
namespace {

constexpr double kTurnDeg = 360.0;

/// Where |L| = 1, or a disk reaches it: the angle from -1, and how far the disk takes it either way.
struct PlaceAtOne {
  double frequency_hz = 0.0, margin_deg = 0.0, reach_deg = 0.0;

  PlaceAtOne(double at_hz, const std::complex<double>& loop, double radius)
      : frequency_hz(at_hz), margin_deg(std::arg(-loop) * 180.0 / kPi) {
    const double size = std::abs(loop);
    // The circle around L cuts the unit circle at this angle from it.
    const double cosine = (1.0 + size * size - radius * radius) / (2.0 * size);
    reach_deg = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / kPi;
  }
  [[nodiscard]] bool reaches_minus_one() const { return std::abs(margin_deg) <= reach_deg; }
  [[nodiscard]] double least_phase_deg() const {
    return std::copysign(std::max(0.0, std::abs(margin_deg) - reach_deg), margin_deg);
  }
  /// By which the angle is behind -1 when it is turned back.
  [[nodiscard]] double turn_deg() const { return margin_deg >= 0.0 ? margin_deg : margin_deg + kTurnDeg; }
  [[nodiscard]] double delay_s() const { return turn_deg() / kTurnDeg / frequency_hz; }
  [[nodiscard]] double least_delay_s() const {
    return reaches_minus_one() ? 0.0 : std::max(0.0, turn_deg() - reach_deg) / kTurnDeg / frequency_hz;
  }
};

class MarginLines {
 public:
  MarginLines(std::span<const double> frequencies_hz, std::span<const std::complex<double>> loop,
              std::span<const double> radii)
      : frequencies_hz_(frequencies_hz), loop_(loop), radii_(radii) {}

  LineMargins run() {
    find_crossings();
    find_gain_margin();
    return std::move(found_);
  }

 private:
  [[nodiscard]] double between(std::span<const double> values, std::size_t i, double part) const {
    return values[i - 1] + part * (values[i] - values[i - 1]);
  }

  /// A controller may be zero at a line.
  [[nodiscard]] double log_size(std::size_t i) const {
    return std::log(std::max(std::abs(loop_[i]), std::numeric_limits<double>::min()));
  }

  [[nodiscard]] bool reaches_one(std::size_t i) const {
    const double size = std::abs(loop_[i]);
    return size > 0.0 && std::abs(size - 1.0) <= radii_[i];
  }

  [[nodiscard]] PlaceAtOne place_at(std::size_t i) const { return {frequencies_hz_[i], loop_[i], radii_[i]}; }

  /// Least phase margin of a crossing below line i, and of the lines on either side up to the first that does
  /// not reach 1: within the disks the loop may cross at any of them.
  [[nodiscard]] double least_around(const PlaceAtOne& crossing, std::size_t i) const {
    double least = crossing.least_phase_deg();
    const auto also_at = [&](std::size_t line) {
      const double there = place_at(line).least_phase_deg();
      if (std::abs(there) < std::abs(least)) least = there;
    };
    for (std::size_t line = i; line > 0 && reaches_one(line - 1); --line) also_at(line - 1);
    for (std::size_t line = i; line < loop_.size() && reaches_one(line); ++line) also_at(line);
    return least;
  }

  void find_crossings() {
    std::vector<PlaceAtOne> reached;
    for (std::size_t i = 0; i < loop_.size(); ++i)
      if (reaches_one(i)) reached.push_back(place_at(i));
    for (std::size_t i = 1; i < loop_.size(); ++i) {
      const double before = log_size(i - 1), after = log_size(i);
      if ((before >= 0.0) == (after >= 0.0)) continue;
      const double part = before / (before - after);
      const double angle = std::arg(loop_[i - 1]) + part * std::arg(loop_[i] * std::conj(loop_[i - 1]));
      const PlaceAtOne at(between(frequencies_hz_, i, part), std::polar(1.0, angle),
                          between(radii_, i, part));
      found_.crossings.push_back({at.frequency_hz, at.margin_deg, before >= 0.0});
      found_.worst_deg.push_back(least_around(at, i));
      if (!found_.phase_deg || std::abs(at.margin_deg) < std::abs(found_.phase_deg->value))
        found_.phase_deg = {at.margin_deg, at.least_phase_deg()};
      if (!found_.delay_s || at.delay_s() < found_.delay_s->value)
        found_.delay_s = {at.delay_s(), at.least_delay_s()};
      reached.push_back(at);
    }
    if (!found_.phase_deg) return;
    for (const PlaceAtOne& at : reached) {
      auto& worst_deg = found_.phase_deg->worst;
      if (std::abs(at.least_phase_deg()) < std::abs(worst_deg)) worst_deg = at.least_phase_deg();
      found_.delay_s->worst = std::min(found_.delay_s->worst, at.least_delay_s());
    }
  }

  void find_gain_margin() {
    double largest = 0.0, largest_reached = 0.0;
    const auto reach = [&](double from, double to) {  // -L on the axis, within a disk
      if (from < 1.0) largest_reached = std::max(largest_reached, std::min(1.0, to));
    };
    for (std::size_t i = 0; i < loop_.size(); ++i) {
      const double square = radii_[i] * radii_[i] - loop_[i].imag() * loop_[i].imag();
      if (square < 0.0) continue;
      reach(-loop_[i].real() - std::sqrt(square), -loop_[i].real() + std::sqrt(square));
    }
    for (std::size_t i = 1; i < loop_.size(); ++i) {
      const auto a = loop_[i - 1], b = loop_[i];
      if ((a.imag() >= 0.0) == (b.imag() >= 0.0) || !(a.real() < 0.0 && b.real() < 0.0)) continue;
      const double part = a.imag() / (a.imag() - b.imag());
      const double size = -a.real() - part * (b.real() - a.real()), radius = between(radii_, i, part);
      if (size < 1.0) largest = std::max(largest, size);
      reach(size - radius, size + radius);
    }
    const auto decibels = [](double size) { return -20.0 * std::log10(size); };
    if (largest > 0.0) found_.gain_db = {decibels(largest), decibels(largest_reached)};
  }

  std::span<const double> frequencies_hz_;
  std::span<const std::complex<double>> loop_;
  std::span<const double> radii_;
  LineMargins found_;
};

}  // namespace

LineMargins line_margins(std::span<const double> frequencies_hz, std::span<const std::complex<double>> loop,
                         std::span<const double> radii) {
  return MarginLines(frequencies_hz, loop, radii).run();
}

}  // namespace resonid::design
