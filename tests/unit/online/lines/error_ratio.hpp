// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <resonid/online/lines/response_tracker.hpp>
#include <vector>

#include "closed_loop_fixture.hpp"

namespace resonid::test {

/// Normalised estimation error squared: mean of |error|^2/std^2, which is 1 +- 1/sqrt(n) for circular
/// Gaussian errors of that deviation, at the end of the record or, with `every` > 0, also every so many
/// samples from the moment on when the tracker is ready. `error` is the effect of the noise alone.
template <class Tracker>
double error_ratio(const Tracker& pattern, const std::vector<double>& ru, std::uint64_t seeds, double noise,
                   std::size_t every = 0) {
  auto tracker = online::ResponseTracker<Tracker>::create(pattern, {.known_delay_s = kDelay}).value();
  struct Value {
    std::complex<double> response;
    double deviation;
  };
  const auto run = [&](double level, std::uint64_t seed) {
    const auto record = run_loop(system_a(), ru, level, seed);
    tracker.reset();
    std::vector<Value> values;
    for (std::size_t k = 0; k < ru.size(); ++k) {
      tracker.step(static_cast<typename Tracker::Scalar>(ru[k]),
                   static_cast<typename Tracker::Scalar>(record.u[k]),
                   static_cast<typename Tracker::Scalar>(record.y[k]));
      const bool asked = every > 0 && tracker.ready() && (k + 1) % every == 0;
      if (!asked && k + 1 != ru.size()) continue;
      for (std::size_t i = 0; i < pattern.lines(); ++i)
        values.push_back({std::complex<double>(tracker.response(i, Approach::joint)),
                          static_cast<double>(tracker.standard_deviation(i))});
    }
    return values;
  };
  const auto clean = run(0.0, 0);
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const auto noisy = run(noise, seed);
    for (std::size_t i = 0; i < clean.size(); ++i)
      sum += std::norm((noisy[i].response - clean[i].response) / noisy[i].deviation);
  }
  return sum / static_cast<double>(seeds * clean.size());
}

/// The published sweep, 35 to 1.5 Hz in 17 s.
inline std::vector<double> chirp(std::size_t samples) {
  std::vector<double> ru(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * kSampleTime;
    ru[k] = std::cos(kTwoPi * t * (35.0 - 33.5 / 17.0 * 0.5 * t));
  }
  return ru;
}

/// Eight lines on the grid of a window of 500 samples.
inline std::vector<double> whole_lines() {
  std::vector<double> lines;
  lines.reserve(kLines.size());
  for (const double f : kLines) lines.push_back(std::round(f));
  return lines;
}
inline std::vector<double> whole_multisine(std::size_t samples) {
  std::vector<double> ru(samples);
  for (std::size_t k = 0; k < samples; ++k)
    for (const double f : whole_lines())
      ru[k] += std::cos(kTwoPi * f * static_cast<double>(k) * kSampleTime + f * f);
  return ru;
}

}  // namespace resonid::test
