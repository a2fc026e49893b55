// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/response/detail/local_rational.hpp>
#include <resonid/response/local_polynomial.hpp>

namespace resonid::response {
namespace {

constexpr double kRate = 500.0;

/// A resonance at 40 Hz with `damping`, 1/(1 + a1 z^-1 + a2 z^-2).
data::TransferFunction resonator(double damping) {
  const double w = kTwoPi * 40.0 / kRate;
  const double radius = std::exp(-damping * w);
  return {{0.0, 1.0},
          {1.0, -2.0 * radius * std::cos(w * std::sqrt(1.0 - damping * damping)), radius * radius},
          1.0 / kRate};
}

/// White input from the first sample on (a transient that nobody waits for), white noise on the output.
data::Record record_of(const data::TransferFunction& g, double noise, std::uint64_t seed,
                       std::size_t samples) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  data::Record record;
  record.sample_rate_hz = kRate;
  record.input.name = "u";
  record.output.name = "y";
  for (std::size_t k = 0; k < samples; ++k) record.input.samples.push_back(normal(random));
  record.output.samples = g.simulate(record.input.samples);
  for (double& y : record.output.samples) y += noise * normal(random);
  return record;
}

std::vector<double> grid() {
  std::vector<double> f;
  for (double x = 30.0; x <= 50.0; x += 0.5) f.push_back(x);
  return f;
}

double relative_rms(const data::FrequencyResponse& found, const data::TransferFunction& g) {
  double sum = 0.0;
  for (std::size_t i = 0; i < found.lines(); ++i)
    sum += std::norm(found.value[i] / g.response(found.frequency_hz[i]) - 1.0);
  return std::sqrt(sum / static_cast<double>(found.lines()));
}

TEST(LocalRational, IsExactForAResonanceWithoutNoise) {
  const auto g = resonator(0.003);
  LocalRationalConfig config;
  config.frequencies_hz = grid();
  config.half_width_bins = 40;
  const auto found = local_rational(record_of(g, 0.0, 1, 4000), config, {Approach::direct, {}, 0.0}).value();
  EXPECT_EQ(found.lines(), config.frequencies_hz.size());
  EXPECT_LT(relative_rms(found, g), 1e-3);
}

/// Half-power width 0.24 Hz, eight seconds: a few bins. No polynomial follows that.
TEST(LocalRational, BeatsTheLocalPolynomialAtASharpResonance) {
  const auto g = resonator(0.003);
  double rational = 0.0, polynomial = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto record = record_of(g, 0.3, seed, 4000);
    LocalRationalConfig config;
    config.frequencies_hz = grid();
    rational += relative_rms(local_rational(record, config, {Approach::direct, {}, 0.0}).value(), g) / 5.0;
    LocalPolynomialConfig other;
    other.frequencies_hz = grid();
    polynomial += relative_rms(local_polynomial(record, other, {Approach::direct, {}, 0.0}).value(), g) / 5.0;
  }
  RecordProperty("rational", std::to_string(rational));
  RecordProperty("polynomial", std::to_string(polynomial));
  EXPECT_LT(rational, 0.5 * polynomial);
}

TEST(LocalRational, ErrorBarsHoldTheTruth) {
  const auto g = resonator(0.02);
  int inside = 0, count = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    LocalRationalConfig config;
    config.frequencies_hz = {33.0, 37.0, 40.0, 43.0, 47.0};
    config.half_width_bins = 60;
    const auto found =
        local_rational(record_of(g, 0.5, seed, 4000), config, {Approach::direct, {}, 0.0}).value();
    for (std::size_t i = 0; i < found.lines(); ++i, ++count)
      if (std::abs(found.value[i] - g.response(found.frequency_hz[i])) <
          data::confidence_radius(found.std[i], 0.95))
        ++inside;
  }
  EXPECT_EQ(count, 100);
  EXPECT_GE(inside, 88);
}

TEST(LocalRational, RefusesWhatItCannotUse) {
  const auto record = record_of(resonator(0.02), 0.1, 1, 4000);
  LocalRationalConfig config;
  config.degree = 0;
  EXPECT_FALSE(local_rational(record, config, {Approach::direct, {}, 0.0}));
  config.degree = 2;
  config.half_width_bins = 4;
  EXPECT_FALSE(local_rational(record, config, {Approach::direct, {}, 0.0}));
  config.half_width_bins = 0;
  EXPECT_FALSE(local_rational(record, config, {Approach::joint, {}, 0.0}));
}

}  // namespace
}  // namespace resonid::response
