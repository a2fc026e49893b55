// SPDX-License-Identifier: MIT
#include "design/between_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <resonid/base/constants.hpp>

namespace resonid::design {
namespace {

class LineFiller {
 public:
  LineFiller(std::span<const double> frequencies_hz, std::span<const std::complex<double>> values,
             std::span<const double> radii, double known_delay_s)
      : f_(frequencies_hz), values_(values), radii_(radii), known_delay_s_(known_delay_s) {}

  FilledLines run() {
    for (std::size_t i = 0; i < f_.size(); ++i) {
      if (i > 0) fill_below(i);
      add(f_[i], values_[i], radii_[i], true);
    }
    return std::move(filled_);
  }

 private:
  void add(double f, std::complex<double> value, double radius, bool measured) {
    filled_.frequencies_hz.push_back(f);
    filled_.values.push_back(value);
    filled_.radii.push_back(radius);
    filled_.measured.push_back(measured);
  }

  [[nodiscard]] double per_inertia(std::size_t i) const { return f_[i] * std::abs(values_[i]); }
  [[nodiscard]] bool is_peak(std::size_t i) const {
    if (i < 2 || i + 1 >= f_.size()) return true;
    return per_inertia(i - 1) * per_inertia(i) > per_inertia(i - 2) * per_inertia(i + 1);
  }
  /// What noise may turn a line by.
  [[nodiscard]] double unsure(std::size_t i) const {
    constexpr double kSure = 0.6;
    return std::asin(std::min(1.0, kSure * radii_[i] / std::abs(values_[i])));
  }

  /// Between lines i - 1 and i.
  void fill_below(std::size_t i) {
    constexpr double kStraight = kPi / 18.0, kUnclear = 2.0 / 3.0 * kPi, kMost = 0.999 * kPi;
    const auto low = values_[i - 1], high = values_[i];
    if (!(std::abs(low) > 0.0) || !(std::abs(high) > 0.0)) return;
    const double by_delay = kTwoPi * (f_[i] - f_[i - 1]) * known_delay_s_;
    const double turn = std::arg(high * std::conj(low) * std::polar(1.0, by_delay));
    if (std::abs(turn) < kStraight) return;
    double fall = -turn;
    if (std::abs(turn) > kUnclear) fall = is_peak(i) ? (turn > 0.0 ? kTwoPi - turn : -turn) : -std::abs(turn);
    const double sure = std::min(fall - unsure(i - 1) - unsure(i), kMost);
    if (sure > kStraight)
      add_arc(i, sure, fall + by_delay);
    else
      add_chord(i);
  }

  void add_between(std::size_t i, double part, std::complex<double> value, double times) {
    add(f_[i - 1] + part * (f_[i] - f_[i - 1]), value,
        times * (radii_[i - 1] + part * (radii_[i] - radii_[i - 1])), false);
  }

  static constexpr int kPlaces = 24;

  void add_chord(std::size_t i) {
    for (int k = 1; k < kPlaces; ++k) {
      const double part = static_cast<double>(k) / kPlaces;
      add_between(i, part, values_[i - 1] + part * (values_[i] - values_[i - 1]), 1.0);
    }
  }

  /// P cos(a) exp(-ja) from one line to the other, where tan(a) goes with frequency.
  void add_arc(std::size_t i, double fall, double whole_turn) {
    const double ratio = std::abs(values_[i - 1]) / std::abs(values_[i]);
    const double first = std::atan2(ratio * std::cos(fall) - 1.0, ratio * std::sin(fall));
    const double height = std::abs(values_[i - 1]) / std::cos(first);
    const double more = std::clamp((fall - 0.5 * kPi) / (0.25 * kPi), 0.0, 1.0);
    const double first_tan = std::tan(first), tans = std::tan(first + fall) - first_tan;
    for (int k = 1; k < kPlaces; ++k) {
      const double way = static_cast<double>(k) / kPlaces, angle = first + way * fall;
      const double times = 1.0 + more * std::pow(std::sin(kPi * way), 2);
      add_between(i, std::clamp((std::tan(angle) - first_tan) / tans, 0.0, 1.0),
                  std::polar(times * height * std::cos(angle), std::arg(values_[i - 1]) - way * whole_turn),
                  times);
    }
  }

  std::span<const double> f_;
  std::span<const std::complex<double>> values_;
  std::span<const double> radii_;
  double known_delay_s_;
  FilledLines filled_;
};

}  // namespace

FilledLines between_lines(std::span<const double> frequencies_hz,
                          std::span<const std::complex<double>> values, std::span<const double> radii,
                          double known_delay_s) {
  return LineFiller(frequencies_hz, values, radii, known_delay_s).run();
}

}  // namespace resonid::design
