// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <resonid/online/excitation/excitation.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/detail/swept_response.hpp>

#include "bench_fixture.hpp"
#include "drive_fixture.hpp"

namespace resonid {
namespace {

constexpr double kRateHz = 500.0;

data::Record excited_by(std::vector<double> samples, double rate_hz = kRateHz) {
  data::Record record;
  record.sample_rate_hz = rate_hz;
  record.output.samples.assign(samples.size(), 0.0);
  record.excitation.samples = std::move(samples);
  return record;
}

online::ExcitationConfig chirp_config(double from_hz, double to_hz, double duration_s, online::Sweep sweep) {
  online::ExcitationConfig config;
  config.kind = online::Kind::chirp;
  config.from_hz = from_hz;
  config.to_hz = to_hz;
  config.duration_s = duration_s;
  config.sweep = sweep;
  return config;
}

std::vector<double> generated(const online::ExcitationConfig& config, double seconds,
                              double rate_hz = kRateHz) {
  auto source = online::Excitation::create(config, rate_hz);
  std::vector<double> samples(static_cast<std::size_t>(std::lround(seconds * rate_hz)));
  source.value().fill(samples);
  return samples;
}

void add_noise(std::vector<double>& samples, double deviation, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0.0, deviation);
  for (double& x : samples) x += normal(engine);
}

TEST(DetectChirp, FindsTheLawOfALinearOrLogarithmicChirp) {
  const struct {
    double from_hz, to_hz, duration_s;
  } laws[] = {{35.0, 1.5, 17.0}, {0.5, 100.0, 17.0}, {2.0, 245.0, 60.0}, {12.25, 13.5, 40.0}};
  for (const auto sweep : {online::Sweep::linear, online::Sweep::logarithmic})
    for (const auto& law : laws) {
      const auto config = chirp_config(law.from_hz, law.to_hz, law.duration_s, sweep);
      const auto found = response::detect_chirp(excited_by(generated(config, law.duration_s)));
      ASSERT_TRUE(found) << law.from_hz;
      EXPECT_EQ(found->sweep == online::Sweep::linear, sweep == online::Sweep::linear);
      EXPECT_DOUBLE_EQ(found->from_hz, law.from_hz);  // round numbers are found exactly
      EXPECT_DOUBLE_EQ(found->to_hz, law.to_hz);
      EXPECT_DOUBLE_EQ(found->duration_s, law.duration_s);
    }
}

TEST(DetectChirp, KeepsItsPhaseUnderNoiseAndOffset) {
  // Frequencies that are no round numbers; the sweep is cut off by the end of the record.
  const online::SweepLaw truth{3.0 + 1.0 / 3.0, 47.7777, 20.0};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto samples =
        generated(chirp_config(truth.from_hz, truth.to_hz, truth.duration_s, online::Sweep::linear), 15.0);
    add_noise(samples, 0.1, seed);
    for (double& x : samples) x += 3.0;
    const auto found = response::detect_chirp(excited_by(samples));
    ASSERT_TRUE(found) << seed;
    for (double t = 0.0; t < 15.0; t += 0.1)  // 0.01 cycles: 3.6 degrees
      ASSERT_NEAR(found->cycles(t) - truth.cycles(t), 0.0, 0.01) << seed << " at " << t;
  }
}

TEST(DetectChirp, TakesTheInputOnlyWhereItIsTheChirpItself) {
  const test::BeltDrive drive;
  auto record = drive.run(test::chirp(35.0, 1.5, 17.0, drive.step_s), 0.0, 1);
  EXPECT_TRUE(response::detect_chirp(record));
  record.excitation.samples.clear();
  EXPECT_FALSE(response::detect_chirp(record)) << "the loop bends amplitude and phase of u";
  record.input.samples = test::chirp(35.0, 1.5, 17.0, drive.step_s);
  EXPECT_TRUE(response::detect_chirp(record));
}

TEST(DetectChirp, WantsItFromTheFirstSampleOnAndOnlyOnce) {
  const auto once = chirp_config(2.0, 35.0, 10.0, online::Sweep::linear);
  const auto with_silence = [&](std::size_t before, double seconds) {
    auto samples = generated(once, seconds);
    samples.insert(samples.begin(), before, 0.0);
    return response::detect_chirp(excited_by(samples));
  };
  ASSERT_TRUE(with_silence(0, 14.0)) << "silence behind the chirp";
  EXPECT_NEAR(with_silence(0, 14.0)->duration_s, 10.0, 0.02);
  EXPECT_NEAR(with_silence(0, 14.0)->to_hz, 35.0, 0.1);
  EXPECT_TRUE(with_silence(3, 10.0));
  EXPECT_FALSE(with_silence(100, 10.0));
  EXPECT_FALSE(with_silence(1000, 10.0));
  auto twice = once;
  twice.repeat = true;
  EXPECT_FALSE(response::detect_chirp(excited_by(generated(twice, 20.0))));
  EXPECT_FALSE(response::detect_chirp(excited_by(generated(twice, 13.0))));
}

TEST(DetectChirp, TakesNothingElseForOne) {
  std::mt19937_64 engine(20);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto refuse = [](const char* name, const std::vector<double>& samples, int seed) {
    EXPECT_FALSE(response::detect_chirp(excited_by(samples))) << name << ' ' << seed;
  };
  for (int seed = 0; seed < 60; ++seed) {
    std::vector<double> noise(3000 + 50 * static_cast<std::size_t>(seed));
    for (double& x : noise) x = normal(engine);
    refuse("white noise", noise, seed);
    auto coloured = noise;  // a resonance anywhere, from broad to narrow
    const double radius = 0.9 + 0.0999 * (seed % 10) / 10.0;
    const double pole = 2.0 * radius * std::cos(0.05 + 0.04 * seed);
    for (std::size_t k = 2; k < coloured.size(); ++k)
      coloured[k] += pole * coloured[k - 1] - radius * radius * coloured[k - 2];
    refuse("narrow-band noise", coloured, seed);
    auto binary = noise;
    for (std::size_t k = 0; k < binary.size(); ++k) {
      const auto held = k - k % static_cast<std::size_t>(1 + seed % 20);
      binary[k] = noise[held] > 0.0 ? 1.0 : -1.0;
    }
    refuse("binary", binary, seed);
    auto turning = noise;
    for (std::size_t k = 0; k < turning.size(); ++k) {
      const double t = static_cast<double>(k) / kRateHz;
      turning[k] = std::sin(kTwoPi * (20.0 * t + (2 + seed % 9) * std::sin(kTwoPi * t / (3 + seed % 5))));
    }
    refuse("frequency modulation", turning, seed);
    auto sine = noise;
    for (std::size_t k = 0; k < sine.size(); ++k)
      sine[k] = std::sin(kTwoPi * (1.0 + 3.0 * seed) * static_cast<double>(k) / kRateHz);
    refuse("sine", sine, seed);
    for (const int kind : {0, 1, 2}) {  // Schroeder, random and zero phases, one to three periods
      const std::size_t period = 1500 + 20 * static_cast<std::size_t>(seed);
      const int lines = 5 + 2 * seed;
      std::vector<double> samples(period * static_cast<std::size_t>(1 + seed % 3), 0.0);
      for (int i = 0; i < lines; ++i) {
        const double phase =
            kind == 0 ? -kPi * i * (i + 1) / lines : (kind == 1 ? kTwoPi * uniform(engine) : 0.0);
        for (std::size_t k = 0; k < samples.size(); ++k)
          samples[k] += std::cos(kTwoPi * (1 + seed % 7 + 2 * i) * static_cast<double>(k % period) /
                                     static_cast<double>(period) +
                                 phase);
      }
      refuse("multisine", samples, seed);
    }
  }
  refuse("silence", std::vector<double>(5000, 1.0), 0);
  refuse("too short", test::chirp(1.0, 100.0, 1.0, 0.002), 0);
}

TEST(DetectChirp, TellsASteppedSineFromAChirp) {
  online::ExcitationConfig config;
  config.kind = online::Kind::stepped_sine;
  config.lines_hz.assign(test::range_hz(20.0, 35.0, 0.5));
  EXPECT_FALSE(response::detect_chirp(excited_by(generated(config, 17.0))));
}

}  // namespace
}  // namespace resonid
