// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <resonid/online/lines/sweep_response.hpp>
#include <vector>

#include "closed_loop_fixture.hpp"

namespace resonid::test {

struct Sweeping {
  double from_hz = 35.0, to_hz = 1.5, duration_s = 17.0;
  online::Sweep sweep = online::Sweep::linear;

  [[nodiscard]] online::SweepResponseConfig config(double rate_hz = 1.0 / kSampleTime,
                                                   double delay_s = kDelay) const {
    return {.chirp = {.sample_rate_hz = rate_hz,
                      .from_hz = from_hz,
                      .to_hz = to_hz,
                      .duration_s = duration_s,
                      .sweep = sweep,
                      .offset = true,
                      .gain = online::GainRule::placed_poles},
            .known_delay_s = delay_s};
  }
  [[nodiscard]] std::vector<double> excitation() const {
    const online::SweepLaw law{from_hz, to_hz, duration_s, sweep};
    std::vector<double> ru(static_cast<std::size_t>(duration_s / kSampleTime));
    for (std::size_t k = 0; k < ru.size(); ++k)
      ru[k] = std::cos(kTwoPi * law.cycles(static_cast<double>(k) * kSampleTime));
    return ru;
  }
};

/// Errors of the response and of the resonance against the truth along sweeps, every 25th sample.
class SweepErrors {
 public:
  using Truth = std::function<std::complex<double>(double)>;

  /// `resonance_hz` is the undamped one; 0 where there is none to compare with.
  template <class Real, std::size_t Rows>
  void run(online::SweepResponse<Real, Rows> tracker, const std::vector<double>& ru,
           const std::vector<double>& u, const std::vector<double>& y, const Truth& truth,
           double resonance_hz) {
    for (std::size_t k = 0; k < ru.size(); ++k) {
      tracker.step(static_cast<Real>(ru[k]), static_cast<Real>(u[k]), static_cast<Real>(y[k]));
      if (k % 25 != 0 || !tracker.settled()) continue;
      const double f = tracker.described_hz();
      const auto g = truth(f);
      const double error = std::norm(std::complex<double>(tracker.response()) - g);
      const double std = static_cast<double>(tracker.standard_deviation());
      ratio_.add(error / (std * std));
      relative_.add(error / std::norm(g));
      band_[std::min(band_.size() - 1, static_cast<std::size_t>(f))].add(error / (std * std));
      uncorrected(tracker, truth);
      const auto mode = tracker.resonance();
      if (!(mode.frequency_hz > 0.0) || resonance_hz == 0.0) continue;
      const double off = (mode.frequency_hz - resonance_hz) / mode.std_hz;
      resonance_.add(off * off);
    }
  }

  /// Normalised error squared: mean of |error|^2/std^2, 1 for true bars.
  [[nodiscard]] double ratio() const { return ratio_.mean(); }
  [[nodiscard]] double band(std::size_t hz) const { return band_[hz].mean(); }
  [[nodiscard]] double worst_band() const {
    double worst = 0.0;
    for (const auto& b : band_) worst = std::max(worst, b.mean());
    return worst;
  }
  [[nodiscard]] double relative_rms() const { return std::sqrt(relative_.mean()); }
  [[nodiscard]] double resonance_ratio() const { return resonance_.mean(); }
  [[nodiscard]] std::size_t resonances() const { return resonance_.count; }
  [[nodiscard]] std::size_t values() const { return ratio_.count; }
  /// The same for the tracker without correction.
  [[nodiscard]] double uncorrected_ratio() const { return raw_ratio_.mean(); }
  [[nodiscard]] double uncorrected_rms() const { return std::sqrt(raw_relative_.mean()); }

 private:
  struct Mean {
    double sum = 0.0;
    std::size_t count = 0;
    void add(double x) {
      sum += x;
      ++count;
    }
    [[nodiscard]] double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0.0; }
  };

  template <class Tracker>
  void uncorrected(const Tracker& tracker, const Truth& truth) {
    const auto& raw = tracker.uncorrected();
    const double f = tracker.uncorrected_hz();
    const auto turn = std::polar(1.0, kTwoPi * tracker.known_delay_s() * (f - raw.frequency_hz(0)));
    const double error = std::norm(std::complex<double>(raw.response(0, Approach::direct)) * turn - truth(f));
    const double std = static_cast<double>(raw.standard_deviation(0));
    raw_ratio_.add(error / (std * std));
    raw_relative_.add(error / std::norm(truth(f)));
  }

  Mean ratio_, relative_, resonance_, raw_ratio_, raw_relative_;
  std::array<Mean, 60> band_{};  // of 1 Hz
};

inline double undamped_resonance_hz(const data::TwoMassParameters& p) {
  return std::sqrt(p.stiffness * (1.0 / p.driven_inertia + 1.0 / p.load_inertia)) / kTwoPi;
}

/// Sweeps over the drive in its loop, with noise of seeds 1 ... `seeds`.
template <class Real = double>
SweepErrors sweep_errors(const data::TwoMassParameters& drive, const Sweeping& sweep, double noise,
                         std::uint64_t seeds) {
  const auto pattern = online::SweepResponse<Real>::create(sweep.config()).value();
  const auto ru = sweep.excitation();
  SweepErrors errors;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const auto record = run_loop(drive, ru, noise, seed);
    errors.run(
        pattern, ru, record.u, record.y, [&](double f) { return true_response(drive, f); },
        undamped_resonance_hz(drive));
  }
  return errors;
}

}  // namespace resonid::test
