// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <complex>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/fit/detail/response_modes.hpp>
#include <vector>

namespace resonid::test {

/// Two or three masses in a row by their impedances, damping of the couplings in proportion to stiffness.
struct Chain {
  double driven = 0.02, middle = 0.02, last = 0.0;  ///< last 0: two masses
  double stiffness = 0.0, stiffness_2 = 0.0, proportion_s = 0.0, friction = 0.0, delay_s = 0.0;

  using Complex = std::complex<double>;
  static Complex in_row(Complex a, Complex b) { return a * b / (a + b); }
  [[nodiscard]] Complex load(Complex s) const {
    return middle * s + (last > 0.0 ? in_row(proportion_s * stiffness_2 + stiffness_2 / s, last * s) : 0.0);
  }
  [[nodiscard]] Complex spring(Complex s) const { return proportion_s * stiffness + stiffness / s; }
  [[nodiscard]] Complex response(double f) const {
    const Complex s(0.0, kTwoPi * f);
    return std::exp(-s * delay_s) / (driven * s + friction + in_row(spring(s), load(s)));
  }

  struct Root {
    bool anti = false;
    double frequency_hz = 0.0, damping_ratio = 0.0;
  };
  /// By Newton's method on the impedances, from the frequencies without damping.
  [[nodiscard]] std::vector<Root> roots() const {
    std::vector<Root> found;
    for (const bool anti : {true, false}) {
      const double own = anti ? 0.0 : stiffness / driven;
      const double sum =
          own + stiffness / middle + (last > 0.0 ? stiffness_2 / middle + stiffness_2 / last : 0.0);
      if (last <= 0.0) {
        found.push_back(root(anti, std::sqrt(sum)));
        continue;
      }
      const double product = stiffness * stiffness_2 *
                             (anti ? 1.0 / middle / last : (driven + middle + last) / driven / middle / last);
      const double half = std::sqrt(0.25 * sum * sum - product);
      found.push_back(root(anti, std::sqrt(0.5 * sum - half)));
      found.push_back(root(anti, std::sqrt(0.5 * sum + half)));
    }
    return found;
  }

 private:
  [[nodiscard]] Root root(bool anti, double w) const {
    const auto impedance = [&](Complex s) {
      return anti ? spring(s) + load(s) : driven * s + friction + in_row(spring(s), load(s));
    };
    Complex s(-0.5 * proportion_s * w * w, w);
    for (int step = 0; step < 30; ++step) {
      const Complex h = 1e-6 * s;
      Complex by = impedance(s) / ((impedance(s + h) - impedance(s - h)) / (2.0 * h));
      if (std::abs(by) > 0.02 * std::abs(s)) by *= 0.02 * std::abs(s) / std::abs(by);
      s -= by;
    }
    return {anti, std::abs(s) / kTwoPi, -s.real() / std::abs(s)};
  }
};

/// Anti-resonance at 12 Hz (two masses), so damped, friction and 3 ms of delay. `ratio`: second to first
/// mass.
inline Chain chain(int masses, double ratio, double damping_ratio) {
  Chain c;
  const double w = kTwoPi * 12.0;
  c.middle = ratio * c.driven;
  c.last = masses == 3 ? 0.7 * c.middle : 0.0;
  c.stiffness = w * w * c.middle;
  c.stiffness_2 = 1.75 * c.stiffness;
  c.proportion_s = 2.0 * damping_ratio / w;
  c.friction = 0.02;
  c.delay_s = 0.003;
  return c;
}

/// Lines with known noise: a share of the value, and as much of the value at 30 Hz everywhere.
inline data::FrequencyResponse noisy(const Chain& c, double spacing_hz, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  data::FrequencyResponse g;
  const double floor = noise * std::abs(c.response(30.0));
  for (double f = 1.0; f <= 150.0; f += spacing_hz * (f < 20.0 ? 1.0 : 3.0)) {
    const auto value = c.response(f);
    const double std = 0.5 * std::hypot(noise * std::abs(value), floor);
    const double part = std * std::sqrt(0.5);
    g.frequency_hz.push_back(f);
    g.value.push_back(value + std::complex<double>(part * normal(random), part * normal(random)));
    g.std.push_back(std);
  }
  return g;
}

struct ModesCoverage {
  int modes = 0, frequency = 0, damping = 0;  ///< found, and 95 % intervals of them that hold the truth
  int striking = 0;                           ///< found of 10 dB that no root is near

  void add(const Chain& c, const data::FrequencyResponse& g) {
    const auto found = fit::response_modes(g, 0.5);
    std::vector<bool> taken(found.size(), false);
    for (const auto& truth : c.roots()) {
      std::size_t nearest = found.size();
      double least = std::log(1.25);
      for (std::size_t i = 0; i < found.size(); ++i) {
        const auto& m = found[i].mode;
        const double off = std::abs(std::log(m.frequency_hz.value / truth.frequency_hz));
        if (m.anti == truth.anti && !taken[i] && off < least) nearest = i, least = off;
      }
      if (nearest == found.size()) continue;
      taken[nearest] = true;
      const auto& m = found[nearest].mode;
      ++modes;
      frequency += std::abs(m.frequency_hz.value - truth.frequency_hz) < 1.96 * m.frequency_hz.std ? 1 : 0;
      damping += std::abs(m.damping_ratio.value - truth.damping_ratio) < 1.96 * m.damping_ratio.std ? 1 : 0;
    }
    for (std::size_t i = 0; i < found.size(); ++i)
      striking += !taken[i] && found[i].prominence_db >= 10.0 ? 1 : 0;
  }
};

}  // namespace resonid::test
