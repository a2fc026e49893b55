// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/detail/gain_rule.hpp>
#include <resonid/online/lines/detail/noise_density.hpp>

namespace resonid::online {

/// b/a without the range checks of the standard library; 0/0 gives 0.
template <class Scalar>
[[nodiscard]] std::complex<Scalar> quotient(std::complex<Scalar> b, std::complex<Scalar> a) noexcept {
  const Scalar power = a.real() * a.real() + a.imag() * a.imag();
  if (!(power > Scalar(0))) return {};
  return {(b.real() * a.real() + b.imag() * a.imag()) / power,
          (b.imag() * a.real() - b.real() * a.imag()) / power};
}

/// What the noise n of the output, y = Gd u + n, does to the phasor Y - Gd U: its rms at every line. Trackers
/// with an innovation: the part of n near each line is e_y - Gd_l e_u; its power in a band a few times wider
/// than the tracker's, against the power that white noise would have at the same place, gives the density of
/// n around the line, and the tracker's noise gain the rest.
template <class Tracker>
class InnovationNoise {
 public:
  using Scalar = typename Tracker::Scalar;

  void configure(const Tracker& tracker, double memory_samples) noexcept {
    double slowest = 0.0;
    for (std::size_t i = 0; i < tracker.lines(); ++i) {
      slowest = std::max(slowest, tracker.lag_samples(i));
      const double narrow = kMoves ? kNarrow / std::max(1.0, tracker.lag_samples(i)) : 0.0;
      band_[i].configure(std::exp(-bandwidth(tracker, i)), std::exp(-narrow));
    }
    memory_ =
        static_cast<Scalar>(memory_samples > 0.0 ? memory_samples : std::max(2.0, kMemoryLags * slowest));
    for (std::size_t p = 0; p < Tracker::kProbes; ++p) measure_white(tracker.probe(p), white_[p]);
    reset();
  }
  void reset() noexcept {
    for (auto& band : band_) band.reset();
    for (auto& power : power_) power.reset();
  }

  void step(const Tracker& u, const Tracker& y) noexcept {
    const Scalar white_part = static_cast<Scalar>(y.probe_position());
    for (std::size_t i = 0; i < y.lines(); ++i) {
      const auto gd = quotient(y.phasor(i), u.phasor(i));
      const Scalar power = band_[i].step(
          {y.innovation() - gd.real() * u.innovation(), -gd.imag() * u.innovation()}, y.rotation(i));
      if (y.settled(i)) power_[i].add(power / white(i, white_part), memory_);
    }
  }

  /// `count` missing samples, before and after the trackers have missed them: they tell nothing of the noise.
  void before_gap(const Tracker& y, std::uint64_t count) noexcept {
    for (std::size_t i = 0; i < y.lines(); ++i)
      band_[i].hold(static_cast<std::complex<Scalar>>(y.turn_over(i, count)));
  }
  void after_gap(const Tracker&, const Tracker&, std::uint64_t) noexcept {}

  [[nodiscard]] Scalar phasor_error(std::size_t line, const Tracker& y) const noexcept {
    if (power_[line].empty()) return std::numeric_limits<Scalar>::infinity();
    return static_cast<Scalar>(y.noise_gain(line)) * std::sqrt(power_[line].value());
  }

 private:
  static constexpr double kMemoryLags = 100.0;
  // Of what stands on the line and is left out, likewise: while the line moves, that is the change of the
  // plant. A settled bank has nothing there.
  static constexpr double kNarrow = 0.5;
  static constexpr bool kMoves = requires { typename Tracker::MovingLine; };
  static constexpr double kBandwidth = 3.0;  // of the noise band, in bandwidths of the tracker

  /// Width of the noise band in rad per sample: not beyond half-way to the next line, where the innovation
  /// has a notch.
  static double bandwidth(const Tracker& tracker, std::size_t line) noexcept {
    const double lag = std::max(1.0, tracker.lag_samples(line));
    const auto angle = [&](std::size_t i) {
      return kTwoPi * tracker.frequency_hz(i) / tracker.sample_rate_hz();
    };
    double spacing = tracker.has_offset() ? angle(line) : 2.0 * angle(line);
    for (std::size_t j = 0; j < tracker.lines(); ++j)
      if (j != line) spacing = std::min(spacing, std::abs(angle(j) - angle(line)));
    return std::max(1.0 / lag, std::min(kBandwidth / lag, 0.5 * spacing));
  }

  /// Power in the bands for white noise of unit variance: the energy of the impulse response, tracker and
  /// band.
  void measure_white(Tracker probe, std::array<Scalar, Tracker::kMaxLines>& white) noexcept {
    constexpr std::size_t kLongest = std::size_t{1} << 16U;
    std::size_t length = 0;
    for (std::size_t i = 0; i < probe.lines(); ++i)
      length = std::max(length, std::min(kLongest, probe.settling_samples(i)));
    length = std::min(kLongest, 2 * length);
    white.fill(Scalar(0));
    for (auto& band : band_) band.reset();
    for (std::size_t k = 0; k < length; ++k) {
      probe.step(k == 0 ? Scalar(1) : Scalar(0));
      for (std::size_t i = 0; i < probe.lines(); ++i)
        white[i] += band_[i].step(probe.innovation(), probe.rotation(i));
    }
  }

  [[nodiscard]] Scalar white(std::size_t line, Scalar position) const noexcept {
    if constexpr (Tracker::kProbes == 1) return white_[0][line];
    const auto low = std::min(static_cast<std::size_t>(position), Tracker::kProbes - 2);
    const Scalar part = position - static_cast<Scalar>(low);
    return (Scalar(1) - part) * white_[low][line] + part * white_[low + 1][line];
  }

  std::array<LinePower<Scalar>, Tracker::kMaxLines> band_{};                      // [line]
  std::array<FadingMean<Scalar>, Tracker::kMaxLines> power_{};                    // [line]
  std::array<std::array<Scalar, Tracker::kMaxLines>, Tracker::kProbes> white_{};  // [probe][line]
  Scalar memory_{};
};

/// The same for a sliding DFT: the scatter of Y - Gd U between windows that follow one another, of which half
/// the mean square belongs to each; once per window.
template <class Tracker>
class WindowNoise {
 public:
  using Scalar = typename Tracker::Scalar;

  void configure(const Tracker& tracker, double memory_samples) noexcept {
    memory_ = static_cast<Scalar>(
        memory_samples > 0.0 ? std::max(2.0, memory_samples / static_cast<double>(tracker.window_samples()))
                             : kMemoryWindows);
    reset();
  }
  void reset() noexcept {
    for (auto& power : power_) power.reset();
    missing_ = 0;
  }

  void step(const Tracker& u, const Tracker& y) noexcept {
    if (y.samples() % y.window_samples() == 0) end_window(u, y, y.samples());
  }
  /// `count` missing samples, before and after the trackers have missed them.
  void before_gap(const Tracker&, std::uint64_t) noexcept {}
  void after_gap(const Tracker& u, const Tracker& y, std::uint64_t count) noexcept {
    const std::uint64_t n = y.window_samples(), before = y.samples() - count, into = before % n;
    if (into + count < n) {
      missing_ += count;
      return;
    }
    missing_ += n - into;
    end_window(u, y, before - into + n);
    missing_ = y.samples() % n;
  }

  [[nodiscard]] Scalar phasor_error(std::size_t line, const Tracker&) const noexcept {
    if (power_[line].empty()) return std::numeric_limits<Scalar>::infinity();
    return std::sqrt(power_[line].value());
  }

 private:
  static constexpr double kMemoryWindows = 100.0;

  /// In place of missing samples stand those of the window before, which do not scatter: the others do in
  /// proportion. A window that is missing for the most part is left out.
  void end_window(const Tracker& u, const Tracker& y, std::uint64_t samples) noexcept {
    const std::uint64_t n = y.window_samples();
    const bool compare = samples >= 2 * n && 2 * missing_ <= n;
    const Scalar scale = missing_ == 0 || !compare
                             ? Scalar(0.5)
                             : Scalar(0.5) * static_cast<Scalar>(n) / static_cast<Scalar>(n - missing_);
    missing_ = 0;
    for (std::size_t i = 0; i < y.lines(); ++i) {
      const auto now_u = u.amplitude(i), now_y = y.amplitude(i);
      if (compare) {
        const auto gd = quotient(now_y + last_y_[i], now_u + last_u_[i]);
        const auto change_u = now_u - last_u_[i], change_y = now_y - last_y_[i];
        const Scalar re = change_y.real() - (gd.real() * change_u.real() - gd.imag() * change_u.imag());
        const Scalar im = change_y.imag() - (gd.real() * change_u.imag() + gd.imag() * change_u.real());
        power_[i].add(scale * (re * re + im * im), memory_);
      }
      last_u_[i] = now_u;
      last_y_[i] = now_y;
    }
  }

  std::array<std::complex<Scalar>, Tracker::kMaxLines> last_u_{}, last_y_{};  // [line]
  std::array<FadingMean<Scalar>, Tracker::kMaxLines> power_{};                // [line]
  Scalar memory_{};
  std::uint64_t missing_ = 0;  // samples of this window
};

template <class Tracker>
struct PlantNoiseOf {
  using Type = InnovationNoise<Tracker>;
};
template <class Tracker>
requires requires(const Tracker& t) { t.window_samples(); }
struct PlantNoiseOf<Tracker> {
  using Type = WindowNoise<Tracker>;
};
template <class Tracker>
using PlantNoise = typename PlantNoiseOf<Tracker>::Type;

}  // namespace resonid::online
