// SPDX-License-Identifier: MIT
#include "monitor/service/measured_coherence.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/base/error_text.hpp>
#include <stdexcept>

#include "folder.hpp"

namespace resonid::monitor {
namespace {

constexpr double kCoherentRate = 1000.0;
constexpr std::size_t kCoherentSegment = 1024;

monitoring::AxisSpec coherent_spec(bool has_excitation) {
  monitoring::AxisSpec spec;
  spec.sample_rate_hz = kCoherentRate;
  spec.has_excitation = has_excitation;
  return spec;
}

/// A ring of 60 s in a folder of its own.
struct CoherentRing {
  explicit CoherentRing(bool has_excitation) {
    RingSettings settings{"x", {"input", "output"}, kCoherentRate, 60'000};
    if (has_excitation) settings.channels.insert(settings.channels.begin(), "excitation");
    auto made = Ring::open(folder.path() / "ring", settings);
    if (!made) throw std::runtime_error(message_of(made.error()));
    ring = std::move(*made);
    ring->put_anchor(0, std::nullopt);
  }
  void put(const std::vector<double>& values) const {
    const std::size_t most = 1000 * ring->channels();
    for (std::size_t at = 0; at < values.size(); at += most) {
      ring->put(std::span(values).subspan(at, std::min(most, values.size() - at)));
      ring->commit({});
      ring->set_read(ring->end());
    }
  }
  Folder folder;
  std::unique_ptr<Ring> ring;
};

/// White noise through y(k) = 0.5 y(k-1) + x(k), and noise of the same colour with so much of its power.
class NoisyFilter {
 public:
  NoisyFilter(double noise_power, std::uint64_t seed) : noise_(std::sqrt(noise_power)), random_(seed) {}
  void append(std::vector<double>& values, std::size_t samples, bool input_too = false) {
    for (std::size_t k = 0; k < samples; ++k) {
      const double x = gaussian_(random_);
      clean_ = 0.5 * clean_ + x;
      disturbance_ = 0.5 * disturbance_ + noise_ * gaussian_(random_);
      values.push_back(x);
      if (input_too) values.push_back(gaussian_(random_));
      values.push_back(clean_ + disturbance_);
    }
  }

 private:
  double noise_, clean_ = 0.0, disturbance_ = 0.0;
  std::mt19937_64 random_;
  std::normal_distribution<double> gaussian_;
};

double mean_of(const CoherenceSpectrum& spectrum, double from_hz, double to_hz) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t b = 2; b + 1 < spectrum.value.size(); ++b) {
    const double hz = static_cast<double>(b) * spectrum.spacing_hz;
    if (hz < from_hz || hz > to_hz) continue;
    sum += spectrum.value[b];
    ++count;
  }
  return sum / count;
}

/// E of the estimate, to first order in 1/n.
double expected_of(double truth, double averages) { return truth + (1.0 - truth) * (1.0 - truth) / averages; }

TEST(MeasuredCoherence, IsSignalOverSignalAndNoise) {
  for (const double noise_power : {0.1, 1.0, 4.0}) {
    const CoherentRing x(false);
    std::vector<double> values;
    NoisyFilter(noise_power, 7).append(values, 40'000);
    x.put(values);
    const auto spectrum = measured_coherence(*x.ring, coherent_spec(false), kCoherentSegment);
    EXPECT_NEAR(spectrum.averages, 32.0 * 0.947, 0.1);
    const double truth = 1.0 / (1.0 + noise_power);
    EXPECT_NEAR(mean_of(spectrum, 0.0, 500.0), expected_of(truth, spectrum.averages), 0.02) << noise_power;

    // Single bins scatter by what is said of them.
    double square = 0.0;
    std::vector<double> frequency_hz;
    for (int b = 4; b < 500; ++b) frequency_hz.push_back(b * spectrum.spacing_hz);
    const auto columns = coherence_at(spectrum, frequency_hz);
    ASSERT_EQ(columns.std.size(), frequency_hz.size());
    const double mean = mean_of(spectrum, 0.0, 500.0);
    double told = 0.0;
    for (std::size_t i = 0; i < frequency_hz.size(); ++i) {
      square += std::pow(columns.value[i] - mean, 2.0) / static_cast<double>(frequency_hz.size());
      told += columns.std[i] / static_cast<double>(frequency_hz.size());
    }
    EXPECT_NEAR(std::sqrt(square) / told, 1.0, 0.25) << noise_power;
  }
}

TEST(MeasuredCoherence, IsNearZeroWhereNothingExcites) {
  const CoherentRing x(false);
  std::mt19937_64 random(3);
  std::normal_distribution<double> gaussian;
  std::vector<double> values;
  // Two poles at 20 Hz each take what excites away at high frequencies.
  const double pole = std::exp(-kTwoPi * 20.0 / kCoherentRate);
  double first = 0.0, second = 0.0;
  for (int k = 0; k < 40'000; ++k) {
    first = pole * first + (1.0 - pole) * gaussian(random);
    second = pole * second + (1.0 - pole) * first;
    values.insert(values.end(), {second, second + 0.05 * gaussian(random)});
  }
  x.put(values);
  const auto spectrum = measured_coherence(*x.ring, coherent_spec(false), kCoherentSegment);
  EXPECT_GT(mean_of(spectrum, 2.0, 10.0), 0.98);
  EXPECT_LT(mean_of(spectrum, 400.0, 490.0), 0.08);
}

TEST(MeasuredCoherence, IsThatOfTheExcitationWhereTheAxisHasOne) {
  const CoherentRing x(true);
  std::vector<double> values;
  NoisyFilter(0.0, 5).append(values, 20'000, true);
  x.put(values);
  EXPECT_GT(mean_of(measured_coherence(*x.ring, coherent_spec(true), kCoherentSegment), 0.0, 500.0), 0.99);
}

TEST(MeasuredCoherence, IsMeasuredBesideGaps) {
  const CoherentRing x(false);
  NoisyFilter filter(0.0, 9);
  std::vector<double> values;
  for (int part = 0; part < 8; ++part) {
    values.clear();
    filter.append(values, 5000);
    if (part == 3) values[5001] = std::numeric_limits<double>::quiet_NaN();
    x.put(values);
    x.ring->put_anchor(x.ring->next_sample() + 777, std::nullopt);
    x.ring->commit({});
  }
  const auto spectrum = measured_coherence(*x.ring, coherent_spec(false), kCoherentSegment);
  EXPECT_GT(spectrum.averages, 20.0);
  EXPECT_GT(mean_of(spectrum, 0.0, 500.0), 0.99);
}

TEST(MeasuredCoherence, IsNotKnownOfFewSamplesOrOfWhatRests) {
  const CoherentRing few(false), rests(false);
  EXPECT_TRUE(measured_coherence(*few.ring, coherent_spec(false), kCoherentSegment).value.empty());
  std::vector<double> values;
  NoisyFilter filter(0.0, 11);
  filter.append(values, kCoherentSegment * 9 / 2 - 1);  // eight segments but for a sample
  few.put(values);
  EXPECT_TRUE(measured_coherence(*few.ring, coherent_spec(false), kCoherentSegment).value.empty());
  values.clear();
  filter.append(values, 1);
  few.put(values);
  EXPECT_FALSE(measured_coherence(*few.ring, coherent_spec(false), kCoherentSegment).value.empty());
  rests.put(std::vector<double>(80'000, 0.1));
  MeasuredCoherence measured;
  EXPECT_TRUE(measured.at(*rests.ring, coherent_spec(false), {1.0, 2.0}).value.empty());
}

TEST(MeasuredCoherence, LooksAtAPositionAsItsDifferences) {
  const CoherentRing x(false);
  auto spec = coherent_spec(false);
  spec.output_quantity = data::OutputQuantity::position;
  std::vector<double> values;
  NoisyFilter(0.0, 13).append(values, 40'000);
  double position = 0.0;
  for (std::size_t k = 1; k < values.size(); k += 2) values[k] = position += values[k] + 3.0;
  x.put(values);
  EXPECT_GT(mean_of(measured_coherence(*x.ring, spec, kCoherentSegment), 0.0, 500.0), 0.99);
}

TEST(MeasuredCoherence, HasSegmentsAsTheCurveNeedsThem) {
  std::vector<double> many;
  for (int i = 0; i < 160; ++i) many.push_back(std::pow(490.0, i / 159.0));
  EXPECT_EQ(coherence_segment(many, 1000.0), 1024U);
  EXPECT_EQ(coherence_segment({10.0, 12.0, 30.0}, 1000.0), 512U);
  EXPECT_EQ(coherence_segment({0.01, 0.02}, 1000.0), 8192U);
  EXPECT_EQ(coherence_segment({400.0}, 1000.0), 256U);
}

TEST(MeasuredCoherence, StaysForASecond) {
  const CoherentRing x(false);
  NoisyFilter loud(9.0, 1), clean(0.0, 2);
  std::vector<double> values;
  loud.append(values, 20'000);
  x.put(values);
  MeasuredCoherence measured;
  const std::vector<double> frequency_hz{1.0, 50.0, 51.0};
  const auto begin = std::chrono::steady_clock::now();
  const auto before = measured.at(*x.ring, coherent_spec(false), frequency_hz);
  values.clear();
  clean.append(values, 20'000);
  x.put(values);
  const auto after = measured.at(*x.ring, coherent_spec(false), frequency_hz);
  // A busy machine may take longer.
  if (std::chrono::steady_clock::now() - begin < std::chrono::seconds(1)) {
    EXPECT_EQ(after.value, before.value);
  }
}

}  // namespace
}  // namespace resonid::monitor
