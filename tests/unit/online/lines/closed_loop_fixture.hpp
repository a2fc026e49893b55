// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <random>
#include <resonid/base/approach.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/linear_system.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/data/two_mass.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <vector>

namespace resonid::test {

// The experiments of Publications IV and VI (docs/notation.md): coupled belt drive, PI velocity control, two
// samples of feedback delay.
inline constexpr double kSampleTime = 0.002;
inline constexpr double kControllerGain = 1.03598193204;
inline constexpr double kIntegralTime = 0.147023908851;
inline constexpr double kDelay = 2.0 * kSampleTime;
inline constexpr double kNoise = 0.1;
inline constexpr std::array<double, 8> kLines{2.9, 5.9, 8.9, 11.9, 14.9, 17.9, 20.9, 23.9};

/// Belt of stiffness K N/m and damping D Ns/m on pulleys of 0.05 m, both inertias 0.032 kgm2.
inline data::TwoMassParameters belt(double stiffness, double damping) {
  return {0.032, 0.032, stiffness * 0.0025, damping * 0.0025, 0.0};
}
inline data::TwoMassParameters system_a() { return belt(5.75e4, 100.0); }
inline data::TwoMassParameters system_b() { return belt(3.10e4, 90.0); }

/// Zero-order-hold response c (zI - A)^-1 b of the undelayed plant.
inline std::complex<double> true_response(const data::TwoMassParameters& drive, double frequency_hz) {
  const auto plant = zero_order_hold(data::continuous_system(drive), kSampleTime);
  const auto z = std::polar(1.0, kTwoPi * frequency_hz * kSampleTime);
  const Eigen::Matrix3cd shifted = z * Eigen::Matrix3cd::Identity() - plant.a.cast<std::complex<double>>();
  const Eigen::Vector3cd state = shifted.fullPivLu().solve(plant.b.cast<std::complex<double>>());
  return (plant.c.cast<std::complex<double>>() * state)(0);
}

struct LoopRecord {
  std::vector<double> u, y;
};

/// u = ru - C y, y = velocity two samples ago + white noise of standard deviation `noise`.
inline LoopRecord run_loop(const data::TwoMassParameters& drive, const std::vector<double>& ru, double noise,
                           std::uint64_t seed) {
  const auto plant = zero_order_hold(data::continuous_system(drive), kSampleTime);
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  Eigen::Vector3d state = Eigen::Vector3d::Zero();
  double integral = 0.0, older = 0.0, old = 0.0;
  LoopRecord record;
  for (const double excitation : ru) {
    const double y = older + (noise > 0.0 ? noise * normal(generator) : 0.0);
    integral += y * kSampleTime / kIntegralTime;
    const double u = excitation - kControllerGain * (y + integral);
    older = old;
    old = (plant.c * state)(0);
    state = plant.a * state + plant.b * u;
    record.u.push_back(u);
    record.y.push_back(y);
  }
  return record;
}

/// Eight lines of amplitude 1 with Schroeder phases.
inline std::vector<double> multisine(std::size_t samples) {
  std::vector<double> ru(samples);
  for (std::size_t k = 0; k < samples; ++k)
    for (std::size_t i = 0; i < kLines.size(); ++i) {
      const auto n = static_cast<double>(i);
      ru[k] +=
          std::cos(kTwoPi * kLines[i] * static_cast<double>(k) * kSampleTime - kPi * n * (n + 1.0) / 8.0);
    }
  return ru;
}

using Bank = online::KalmanBank<double, 8>;

/// Bank with lambda = 100 and one shared offset, joint approach: 30 s of Publication IV.
inline online::ResponseTracker<Bank> track(const data::TwoMassParameters& drive, double noise,
                                           std::uint64_t seed, std::size_t samples = 15000) {
  const auto bank =
      Bank::create({.sample_rate_hz = 1.0 / kSampleTime, .frequency_hz = kLines, .lambda = 100.0}).value();
  auto tracker = online::ResponseTracker<Bank>::create(bank, {.known_delay_s = kDelay}).value();
  const auto ru = multisine(samples);
  const auto record = run_loop(drive, ru, noise, seed);
  for (std::size_t k = 0; k < samples; ++k) tracker.step(ru[k], record.u[k], record.y[k]);
  return tracker;
}

/// How many of the true values lie in their 95 % regions |error| <= std sqrt(-ln 0.05), of `seeds` * 8.
inline int covered(const data::TwoMassParameters& drive, std::uint64_t first_seed, int seeds) {
  int inside = 0;
  for (int s = 0; s < seeds; ++s) {
    const auto tracker = track(drive, kNoise, first_seed + static_cast<std::uint64_t>(s));
    for (std::size_t i = 0; i < kLines.size(); ++i) {
      const auto error = tracker.response(i, Approach::joint) - true_response(drive, kLines[i]);
      if (std::abs(error) <= tracker.standard_deviation(i) * std::sqrt(-std::log(0.05))) ++inside;
    }
  }
  return inside;
}

}  // namespace resonid::test
