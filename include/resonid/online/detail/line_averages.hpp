// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>

namespace resonid::online::detail {

/// Response at lines that are not always excited (chirp), or not by a line (PRBS): means over the amplitudes,
/// each of which is narrow-band filtered alike, once more than by its tracker, fading.
///
///   Gd = sum Y Ru* / sum U Ru*      L = sum |Ru|^2 / sum U Ru* - 1
///   std^2 = mean |Y - Gd U|^2 c sum |Ru|^2 / |sum U Ru*|^2
///
/// Visits follow one another faster than the filters forget: c of them share their noise. Like every estimate
/// with a band, it smooths the response over that band; the second filter keeps what lies between the lines
/// out, which a tracker with steep neighbours lets through. Joint approach (docs/notation.md) to
/// averaged spectra (Welch 1967).
template <std::size_t MaxLines>
class LineAverages {
 public:
  using Complex = std::complex<double>;

  /// Time constants in visits: of the sums, of the second filter, and that of the trackers.
  void configure(double memory_visits, double filter_visits, double tracker_visits) noexcept {
    fading_ = 1.0 - 1.0 / memory_visits;
    narrow_ = 1.0 / filter_visits;
    shared_visits_ = std::max(1.0, 2.0 * (filter_visits + tracker_visits));
    reset();
  }
  void reset() noexcept { sums_ = {}; }

  /// Amplitudes: phasors with their phase referred to one fixed sample.
  void step(std::size_t line, Complex ru_amplitude, Complex u_amplitude, Complex y_amplitude) noexcept {
    Sums& s = sums_[line];
    const Complex ru = s.narrow_ru += narrow_ * (ru_amplitude - s.narrow_ru);
    const Complex u = s.narrow_u += narrow_ * (u_amplitude - s.narrow_u);
    const Complex y = s.narrow_y += narrow_ * (y_amplitude - s.narrow_y);
    s.y_ru = fading_ * s.y_ru + y * std::conj(ru);
    s.u_ru = fading_ * s.u_ru + u * std::conj(ru);
    s.y_u = fading_ * s.y_u + y * std::conj(u);
    s.ru = fading_ * s.ru + std::norm(ru);
    s.u = fading_ * s.u + std::norm(u);
    s.y = fading_ * s.y + std::norm(y);
    s.visits = fading_ * s.visits + 1.0;
  }

  [[nodiscard]] Complex response(std::size_t line) const noexcept {
    return sums_[line].y_ru / sums_[line].u_ru;
  }
  [[nodiscard]] Complex loop(std::size_t line) const noexcept {
    return sums_[line].ru / sums_[line].u_ru - 1.0;
  }
  [[nodiscard]] double standard_deviation(std::size_t line) const noexcept {
    const Sums& s = sums_[line];
    if (!(s.visits > shared_visits_)) return std::numeric_limits<double>::infinity();
    const Complex g = response(line);
    const double noise = s.y - 2.0 * (std::conj(g) * s.y_u).real() + std::norm(g) * s.u;
    return std::sqrt(std::max(0.0, noise) / s.visits * shared_visits_ * s.ru / std::norm(s.u_ru));
  }

 private:
  struct Sums {
    Complex narrow_ru, narrow_u, narrow_y;
    Complex y_ru, u_ru, y_u;
    double ru = 0.0, u = 0.0, y = 0.0, visits = 0.0;
  };
  std::array<Sums, MaxLines> sums_{};  // [line]
  double fading_ = 1.0, narrow_ = 1.0, shared_visits_ = 1.0;
};

}  // namespace resonid::online::detail
