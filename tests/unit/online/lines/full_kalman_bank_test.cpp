// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/detail/full_kalman_bank.hpp>
#include <string>
#include <vector>

namespace resonid::online {
namespace {

using Bank = FullKalmanBank<double, 4>;
constexpr double kRate = 500.0, kNoise = 0.1;
constexpr std::array<double, 3> kLines{2.9, 11.9, 14.9};
constexpr std::array<double, 3> kDrift{0.05, 0.2, 0.4};
constexpr double kOffsetDrift = 0.3;

Bank bank(RiccatiForm form) {
  return Bank::create({.sample_rate_hz = kRate,
                       .frequency_hz = kLines,
                       .noise_rms = kNoise,
                       .drift = kDrift,
                       .offset_drift = kOffsetDrift,
                       .form = form})
      .value();
}

// scipy.linalg.solve_discrete_are: full_kalman_bank_reference.py.
TEST(FullKalmanBank, SteadyStateMeetsScipy) {
  const std::array<double, 7> gain{0.01021254004,  -0.016125816007, 0.07592150295, 0.008082824085,
                                   0.094837473455, -0.119680743023, 0.114525826671};
  const std::array<std::array<double, 3>, 3> covariance{
      {{8.790274293385e-04, 1.796250617547e-05, 9.374877699496e-04},
       {0.002920413993, -0.000130506848, 0.002983318941},
       {0.00406745379, 0.00030598492, 0.004671023412}}};
  const auto steady = bank(RiccatiForm::steady_state);
  auto varying = bank(RiccatiForm::time_varying);
  for (int k = 0; k < 12000; ++k) varying.step(0.0);
  for (const Bank& b : {steady, varying}) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(b.gain(i).real(), gain[2 * i], 1e-10);
      EXPECT_NEAR(b.gain(i).imag(), gain[2 * i + 1], 1e-10);
      const auto p = b.covariance(i);
      EXPECT_NEAR(p(0, 0), covariance[i][0], 1e-10);
      EXPECT_NEAR(p(0, 1), covariance[i][1], 1e-10);
      EXPECT_EQ(p(0, 1), p(1, 0));
      EXPECT_NEAR(p(1, 1), covariance[i][2], 1e-10);
    }
    EXPECT_NEAR(b.offset_gain(), gain[6], 1e-10);
  }
}

// The model's own signal: phasors and an offset that wander, in noise. Mean of e' P^-1 e, which is 2 for a
// covariance that is right; from the first samples on, samples missing.
std::array<double, 3> squared_errors(std::size_t at, std::uint64_t seeds) {
  std::array<double, 3> mean{};
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    std::array<std::complex<double>, 3> p;
    for (auto& x : p) x = {normal(generator), normal(generator)};
    double offset = normal(generator);
    auto b = bank(RiccatiForm::time_varying);
    for (std::size_t k = 0; k <= at; ++k) {
      double z = offset + kNoise * normal(generator);
      for (const auto& x : p) z += x.real();
      b.step(k % 10 == 7 ? std::numeric_limits<double>::quiet_NaN() : z);
      if (k == at) break;
      for (std::size_t i = 0; i < 3; ++i) {
        const double step = kDrift[i] / std::sqrt(2.0 * kRate);
        p[i] = p[i] * std::polar(1.0, kTwoPi * kLines[i] / kRate) +
               std::complex<double>(step * normal(generator), step * normal(generator));
      }
      offset += kOffsetDrift / std::sqrt(kRate) * normal(generator);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const std::complex<double> e = b.phasor(i) - p[i];
      const Eigen::Vector2d error(e.real(), e.imag());
      mean[i] += error.dot(b.covariance(i).inverse() * error) / static_cast<double>(seeds);
    }
  }
  return mean;
}

// 400 seeds: standard deviation of the mean 0.1.
TEST(FullKalmanBank, CovarianceIsThatOfTheError) {
  for (const std::size_t at : {60U, 150U, 600U})
    for (const double mean : squared_errors(at, 400)) EXPECT_NEAR(mean, 2.0, 0.4) << at;
}

TEST(FullKalmanBank, TimeVaryingFormIsThereSooner) {
  auto steady = bank(RiccatiForm::steady_state), varying = bank(RiccatiForm::time_varying);
  for (int k = 0; k < 200; ++k) {
    const double z = std::cos(kTwoPi * kLines[0] * k / kRate) + 5.0;
    steady.step(z);
    varying.step(z);
  }
  EXPECT_LT(std::abs(varying.amplitude(0) - 1.0), 1e-3);
  EXPECT_GT(std::abs(steady.amplitude(0) - 1.0), 0.1);
  EXPECT_NEAR(varying.offset(), 5.0, 1e-3);
}

TEST(FullKalmanBank, StaysPositiveInSinglePrecision) {
  const auto exact = bank(RiccatiForm::steady_state);
  auto single = FullKalmanBank<float, 4>::create({.sample_rate_hz = kRate,
                                                  .frequency_hz = kLines,
                                                  .noise_rms = kNoise,
                                                  .drift = kDrift,
                                                  .offset_drift = kOffsetDrift})
                    .value();
  for (int k = 0; k < 200000; ++k) single.step(k % 3 == 0 ? 1.0F : -1.0F);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto p = single.covariance(i);
    EXPECT_EQ(p(0, 1), p(1, 0));
    EXPECT_NEAR(p(0, 0), exact.covariance(i)(0, 0), 1e-3 * exact.covariance(i)(0, 0));
    EXPECT_NEAR(p(1, 1), exact.covariance(i)(1, 1), 1e-3 * exact.covariance(i)(1, 1));
    EXPECT_TRUE(std::isfinite(std::abs(single.phasor(i))));
  }
}

TEST(FullKalmanBank, NoiseGainIsMeasured) {
  auto b = bank(RiccatiForm::steady_state);
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  std::array<double, 3> power{};
  constexpr int kSamples = 400000;
  for (int k = 0; k < kSamples; ++k) {
    b.step(normal(generator));
    for (std::size_t i = 0; i < 3; ++i) power[i] += std::norm(b.phasor(i)) / kSamples;
  }
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(std::sqrt(power[i]) / b.noise_gain(i), 1.0, 0.03);
}

TEST(FullKalmanBank, RefusesWhatCannotWork) {
  const auto field = [](const FullKalmanBankConfig& c) {
    const auto made = Bank::create(c);
    return made ? std::string() : std::string(made.error().field);
  };
  const std::array<double, 1> drift{0.1}, still{0.0};
  const std::array<double, 2> two{0.1, 0.1}, twice{2.9, 2.9};
  const std::array<double, 5> many{1.0, 2.0, 3.0, 4.0, 5.0};
  FullKalmanBankConfig good{.sample_rate_hz = kRate, .frequency_hz = kLines, .drift = drift};
  EXPECT_EQ(field(good), "");
  const auto with = [&](auto change) {
    auto c = good;
    change(c);
    return field(c);
  };
  EXPECT_EQ(with([](auto& c) { c.sample_rate_hz = 0.0; }), "sample_rate_hz");
  EXPECT_EQ(with([](auto& c) { c.sample_rate_hz = 20.0; }), "frequency_hz");
  EXPECT_EQ(with([](auto& c) { c.frequency_hz = {}; }), "frequency_hz");
  EXPECT_EQ(with([&](auto& c) { c.frequency_hz = twice; }), "frequency_hz");
  EXPECT_EQ(with([&](auto& c) { c.frequency_hz = many; }), "frequency_hz");
  EXPECT_EQ(with([](auto& c) { c.noise_rms = 0.0; }), "noise_rms");
  EXPECT_EQ(with([&](auto& c) { c.drift = still; }), "drift");
  EXPECT_EQ(with([&](auto& c) { c.drift = two; }), "drift");
  EXPECT_EQ(with([](auto& c) { c.drift = {}; }), "drift");
  EXPECT_EQ(with([](auto& c) { c.offset_drift = -1.0; }), "offset_drift");
  EXPECT_EQ(with([](auto& c) { c.start_deviation = -1.0; }), "start_deviation");
}

}  // namespace
}  // namespace resonid::online
