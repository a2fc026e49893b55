// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <resonid/base/approach.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/lines/detail/controller_response.hpp>
#include <resonid/online/lines/detail/plant_noise.hpp>
#include <span>

namespace resonid::online {

struct ResponseTrackerConfig {
  double known_delay_s = 0.0;  ///< Delay in the measured output that is taken out of the response, >= 0.
  /// Controller C for the indirect approach, one of the two, or none: its response at every line (trackers of
  /// fixed lines), or its coefficients in powers of z^-1, at most kMaxControllerCoefficients each.
  std::span<const std::complex<double>> controller_at_line{};
  std::span<const double> controller_numerator{};
  std::span<const double> controller_denominator{};
  /// Memory of the noise estimate; 0 means 100 times the tracker's lag (100 windows of a sliding DFT).
  double noise_memory_samples = 0.0;
};

/// Plant response at the tracked lines, sample by sample: three identical trackers on ru, u and y, whose own
/// transfer cancels in every ratio.
///
///   direct Gd = Y/U     indirect Gcl = Y/Ru, Gd = Gcl/(1 - C Gcl)     joint Gd = (Y/Ru)/(U/Ru)     G = Gd
///   e^{+jwTd}
///
/// Direct and joint agree here: each phasor is locked to the line, so the direct ratio has not the bias that
/// it has with spectra (docs/methods/response_tracker.md). A sample with any signal not finite is missing for
/// all three. An approach that lacks what it needs gives NaN. Source: Nevaranta 2016, Pub. VI, eqs. 1-6.
template <class TrackerType>
class ResponseTracker {
 public:
  using Tracker = TrackerType;
  using Scalar = typename Tracker::Scalar;
  static constexpr std::size_t kMaxLines = Tracker::kMaxLines;

  /// `tracker` serves as the pattern of all three; its samples so far are forgotten.
  static expected<ResponseTracker, Error> create(const Tracker& tracker,
                                                 const ResponseTrackerConfig& config) {
    if (!(config.known_delay_s >= 0.0) || !std::isfinite(config.known_delay_s))
      return refuse("known_delay_s", "must be >= 0", config.known_delay_s);
    if (!(config.noise_memory_samples == 0.0 || config.noise_memory_samples >= 2.0))
      return refuse("noise_memory_samples", "must be 0 or at least 2", config.noise_memory_samples);
    if (!config.controller_at_line.empty() && (kMoves || config.controller_at_line.size() != tracker.lines()))
      return refuse("controller_at_line", "needs one value for every fixed line",
                    static_cast<double>(config.controller_at_line.size()));
    auto controller = ControllerResponse<kMaxLines>::create(
        config.controller_at_line, config.controller_numerator, config.controller_denominator);
    if (!controller) return unexpected<Error>(controller.error());
    return ResponseTracker(tracker, *controller, config);
  }

  void step(Scalar ru, Scalar u, Scalar y) noexcept {
    if (!(std::isfinite(ru) && std::isfinite(u) && std::isfinite(y))) {
      miss(1);
      return;
    }
    ru_.step(ru);
    u_.step(u);
    y_.step(y);
    noise_.step(u_, y_);
  }
  /// Without an excitation signal: direct only.
  void step(Scalar u, Scalar y) noexcept { step(Scalar(0), u, y); }
  /// `count` samples were lost: as so many steps with a sample that is not finite, in a bounded time. They
  /// leave the standard deviation as it is.
  void miss(std::uint64_t count) noexcept {
    if (count == 0) return;
    noise_.before_gap(y_, count);
    ru_.miss(count);
    u_.miss(count);
    y_.miss(count);
    noise_.after_gap(u_, y_, count);
  }
  void reset() noexcept {
    ru_.reset();
    u_.reset();
    y_.reset();
    noise_.reset();
  }

  /// G at the line, delay removed; NaN where a phasor that it divides by is 0 or the controller is not known.
  [[nodiscard]] std::complex<Scalar> response(std::size_t line, Approach approach) const noexcept {
    using Complex = std::complex<double>;
    const Complex ru = ru_.phasor(line), u = u_.phasor(line), y = y_.phasor(line);
    Complex g;
    if (approach == Approach::direct) {
      g = y / u;
    } else if (ru == 0.0) {
      g = std::numeric_limits<double>::quiet_NaN();
    } else if (approach == Approach::joint) {
      g = (y / ru) / (u / ru);
    } else {
      const Complex closed = y / ru;
      g = closed / (1.0 - controller_at(line) * closed);
    }
    g *= std::polar(1.0, kTwoPi * frequency_hz(line) * known_delay_s_);
    return {static_cast<Scalar>(g.real()), static_cast<Scalar>(g.imag())};
  }

  /// Standard deviation of the response, total: std^2 = E|error|^2, of the error that noise makes; the same
  /// for all three approaches to first order. Infinite until the line has settled (sliding DFT: until two
  /// windows are there).
  [[nodiscard]] Scalar standard_deviation(std::size_t line) const noexcept {
    const Scalar input = std::abs(u_.phasor(line));
    const Scalar error = noise_.phasor_error(line, y_);
    return input > Scalar(0) ? error / input : std::numeric_limits<Scalar>::infinity();
  }
  /// 1/(1 + (std/|G|)^2), from 0 to 1; 0 while the standard deviation is not known.
  [[nodiscard]] Scalar coherence(std::size_t line) const noexcept {
    const Scalar output = std::abs(y_.phasor(line));
    if (!(output > Scalar(0))) return Scalar(0);
    const Scalar ratio = noise_.phasor_error(line, y_) / output;
    return Scalar(1) / (Scalar(1) + ratio * ratio);
  }

  [[nodiscard]] bool settled(std::size_t line) const noexcept { return y_.settled(line); }
  [[nodiscard]] bool ready() const noexcept { return y_.ready(); }
  [[nodiscard]] std::size_t lines() const noexcept { return y_.lines(); }
  [[nodiscard]] double frequency_hz(std::size_t line) const noexcept { return y_.frequency_hz(line); }
  [[nodiscard]] double lag_samples(std::size_t line) const noexcept { return y_.lag_samples(line); }
  [[nodiscard]] std::uint64_t samples() const noexcept { return y_.samples(); }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return y_.skipped_samples(); }
  [[nodiscard]] const Tracker& excitation() const noexcept { return ru_; }
  [[nodiscard]] const Tracker& input() const noexcept { return u_; }
  [[nodiscard]] const Tracker& output() const noexcept { return y_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return ru_.intact() && u_.intact() && y_.intact() && ru_.lines() == y_.lines() &&
           u_.lines() == y_.lines() && controller_.intact();
  }

 private:
  static constexpr bool kMoves = requires { typename Tracker::MovingLine; };

  ResponseTracker(const Tracker& tracker, const ControllerResponse<kMaxLines>& controller,
                  const ResponseTrackerConfig& config) noexcept
      : ru_(tracker),
        u_(tracker),
        y_(tracker),
        controller_(controller),
        known_delay_s_(config.known_delay_s) {
    noise_.configure(tracker, config.noise_memory_samples);
    reset();
  }

  [[nodiscard]] std::complex<double> controller_at(std::size_t line) const noexcept {
    return controller_.at(line, frequency_hz(line) / y_.sample_rate_hz());
  }

  Tracker ru_, u_, y_;
  PlantNoise<Tracker> noise_;
  ControllerResponse<kMaxLines> controller_;
  double known_delay_s_ = 0.0;
};

}  // namespace resonid::online
