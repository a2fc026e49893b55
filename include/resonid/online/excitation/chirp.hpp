// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/detail/sweep.hpp>
#include <resonid/online/excitation/metrics.hpp>
#include <span>
#include <string_view>

namespace resonid::online {

struct ChirpConfig {
  double sample_rate_hz = 0.0;  ///< Rate at which step() is called, > 0.
  double amplitude = 1.0;       ///< Peak value, > 0.
  double from_hz = 0.0;         ///< Frequency at the start, > 0 and below half the sample rate.
  double to_hz = 0.0;           ///< Frequency at the end, likewise; below from_hz the chirp goes down.
  double duration_s = 0.0;      ///< Length of one sweep, at least two samples.
  Sweep sweep = Sweep::linear;
  bool repeat = false;     ///< Begin again after the end; otherwise the signal is 0 from there on.
  double phase_rad = 0.0;  ///< Phase p of the first sample, which is amplitude * cos(p).
};

/// Sine whose frequency f(t) goes from f0 to f1 in the time T.
///
///   ru = A cos(2π φ(t) + p),   linear:       φ = f0 t + m t²/2,  m = (f1 - f0)/T,   f = f0 + m t
///                              logarithmic:  φ = f0 T/q (e^{q t/T} - 1),  q = ln(f1/f0),   f = f0 e^{q t/T}
///
/// The phase is evaluated in closed form at every sample: no error accumulates.
/// Source: Nevaranta 2016, Pub. VI, eq. 17 (mended: docs/errata.md).
class Chirp {
 public:
  static expected<Chirp, Error> create(const ChirpConfig& config);

  double step() noexcept;
  void reset() noexcept { sample_ = 0; }
  void fill(std::span<double> out) noexcept {
    for (double& x : out) x = step();
  }

  /// Instantaneous frequency `time_s` after the start of a sweep, held at the end.
  [[nodiscard]] double frequency_hz(double time_s) const noexcept;
  [[nodiscard]] std::size_t length_samples() const noexcept { return length_; }
  [[nodiscard]] Band band() const noexcept;
  [[nodiscard]] const ChirpConfig& config() const noexcept { return config_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return resonid::intact(config_.sweep, Sweep::logarithmic) && resonid::intact(config_.repeat);
  }

 private:
  Chirp(const ChirpConfig& config, std::size_t length) noexcept : config_(config), length_(length) {}

  ChirpConfig config_;
  std::size_t length_;
  std::size_t sample_ = 0;
};

}  // namespace resonid::online
