// SPDX-License-Identifier: MIT
// Best linear approximation and detection lines on static cubic and square laws behind a known filter, where
// theory gives the levels, and on the linear filter alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/response/best_linear_approximation.hpp>
#include <resonid/response/detail/detection_lines.hpp>
#include <resonid/response/detail/excitation_lines.hpp>

namespace resonid::response {
namespace {

constexpr std::size_t kPeriod = 2048;

struct Law {
  double square = 0.0;
  double cube = 0.0;
  double noise = 0.0;
};

/// Periods of a random-phase multisine of rms 1 at the multiples that `excited` names, through
/// v(k) = 0.5 v(k-1) + w(k), w = u + square u^2 + cube u^3, in steady state.
data::Record run(const std::vector<int>& excited, std::uint64_t seed, const Law& law, std::size_t periods) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> phase(0.0, kTwoPi);
  std::normal_distribution<double> normal;
  const double amplitude = std::sqrt(2.0 / static_cast<double>(excited.size()));
  std::vector<double> u(kPeriod, 0.0);
  for (const int k : excited) {
    const double p = phase(random);
    for (std::size_t n = 0; n < kPeriod; ++n)
      u[n] += amplitude * std::cos(kTwoPi * static_cast<double>(static_cast<std::size_t>(k) * n % kPeriod) /
                                       static_cast<double>(kPeriod) +
                                   p);
  }
  data::Record record;
  record.sample_rate_hz = static_cast<double>(kPeriod);  // 1 Hz between the multiples
  record.input.name = "u";
  record.output.name = "y";
  double v = 0.0;
  for (std::size_t n = 0; n < (periods + 1) * kPeriod; ++n) {
    const double x = u[n % kPeriod];
    v = 0.5 * v + x + law.square * x * x + law.cube * x * x * x;
    if (n < kPeriod) continue;
    record.input.samples.push_back(x);
    record.output.samples.push_back(v + law.noise * normal(random));
  }
  return record;
}

std::vector<int> all_up_to(int last) {
  std::vector<int> lines;
  for (int k = 1; k <= last; ++k) lines.push_back(k);
  return lines;
}

std::complex<double> filter(double f) {
  return 1.0 / (1.0 - 0.5 * std::polar(1.0, -kTwoPi * f / static_cast<double>(kPeriod)));
}

double rms(const std::vector<double>& x, const std::vector<double>& scale) {
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * x[i] / (scale[i] * scale[i]);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

/// Gaussian input of variance 1 (many lines): the best linear approximation of u + c u^3 is 1 + 3 c
/// (Bussgang), and what is left, c (u^3 - 3 u), has variance 6 c^2, spread over three times the band like the
/// third convolution of the flat spectrum: density within the band 3/4 - (f/B)^2/4 of 1/(2B) ... see the sum
/// below.
TEST(BestLinearApproximation, SeparatesNoiseFromTheDistortionOfACube) {
  constexpr int kLast = 200;
  constexpr double kCube = 0.05, kNoise = 0.02;
  std::vector<data::Record> records;
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
    records.push_back(run(all_up_to(kLast), seed, {0.0, kCube, kNoise}, 6));
  const auto found = best_linear_approximation(records, {}, Approach::direct).value();
  ASSERT_EQ(found.lines.lines.size(), static_cast<std::size_t>(kLast));
  std::vector<double> filter_size, expected_distortion, ones(kLast, 1.0);
  double largest = 0.0;
  for (const auto& line : found.lines.lines) {
    const double x = line.frequency_hz / kLast;
    filter_size.push_back(std::abs(filter(line.frequency_hz)));
    largest = std::max(
        largest, std::abs(line.output / line.input / filter(line.frequency_hz) / (1.0 + 3.0 * kCube) - 1.0));
    // Spectrum of u: 1/(2B) over |f| < B; its triple convolution at x = f/B: (3 - x^2)/(8 B); times 6 c^2.
    // Per line of 1 Hz relative to the power of an excited line, 1/(2B): 6 c^2 (3 - x^2)/4.
    expected_distortion.push_back(kCube * std::sqrt(6.0 * (3.0 - x * x) / 4.0));
  }
  EXPECT_LT(largest, 0.12);
  std::vector<double> relative;
  for (std::size_t i = 0; i < filter_size.size(); ++i)
    relative.push_back(found.distortion_std[i] / filter_size[i] / expected_distortion[i]);
  EXPECT_NEAR(rms(relative, ones), 1.0, 0.08);
  // Amplitude of a line sqrt(2/200) = 0.1; of the mean of 6 periods' noise: 2 s/sqrt(N), 12 records.
  const double noise = 2.0 * kNoise / std::sqrt(static_cast<double>(kPeriod) * 6.0 * 12.0) / 0.1;
  std::vector<double> relative_noise;
  for (const double s : found.noise_std) relative_noise.push_back(s / noise);
  EXPECT_NEAR(rms(relative_noise, ones), 1.0, 0.05);
}

TEST(BestLinearApproximation, FindsNoDistortionInALinearPlant) {
  std::vector<data::Record> records;
  for (std::uint64_t seed = 1; seed <= 8; ++seed)
    records.push_back(run(all_up_to(100), seed, {0.0, 0.0, 0.02}, 6));
  const auto found = best_linear_approximation(records, {}, Approach::direct).value();
  double distortion = 0.0, noise = 0.0;
  for (std::size_t i = 0; i < found.noise_std.size(); ++i) {
    distortion += std::pow(found.distortion_std[i], 2);
    noise += 8.0 * std::pow(found.noise_std[i], 2);  // of one realisation
  }
  EXPECT_LT(distortion, 0.5 * noise);  // the positive halves of what chance leaves
}

TEST(BestLinearApproximation, SplitsARecordWhereThePhasesChange) {
  auto record = run(all_up_to(50), 1, {}, 4);
  for (std::uint64_t seed = 2; seed <= 3; ++seed) {
    const auto next = run(all_up_to(50), seed, {}, 4);
    record.input.samples.insert(record.input.samples.end(), next.input.samples.begin(),
                                next.input.samples.end());
    record.output.samples.insert(record.output.samples.end(), next.output.samples.begin(),
                                 next.output.samples.end());
  }
  const auto parts = realisations_of(record, kPeriod);
  ASSERT_EQ(parts.size(), 3U);
  for (const auto& part : parts) EXPECT_EQ(part.samples(), 3 * kPeriod);
  EXPECT_FALSE(best_linear_approximation(std::span(parts).first(1), {}, Approach::direct));
  const auto found = best_linear_approximation(parts, {}, Approach::direct).value();
  for (const auto& line : found.lines.lines)
    EXPECT_LT(std::abs(line.output / line.input / filter(line.frequency_hz) - 1.0), 1e-6);
}

data::Record joined(std::vector<data::Record> parts) {
  for (std::size_t i = 1; i < parts.size(); ++i)
    for (auto channel : {&data::Record::input, &data::Record::output}) {
      auto& to = (parts[0].*channel).samples;
      const auto& from = (parts[i].*channel).samples;
      to.insert(to.end(), from.begin(), from.end());
    }
  return parts[0];
}

std::vector<int> narrow_band() {
  std::vector<int> lines;
  for (int k = 100; k < 130; ++k) lines.push_back(k);
  return lines;
}

TEST(Realisations, PeriodIsFoundAlthoughThePhasesChange) {
  for (const auto& excited : {all_up_to(50), narrow_band()})
    for (const std::size_t periods : {3U, 4U, 5U, 12U})
      for (const std::uint64_t count : {2U, 5U, 9U}) {
        std::vector<data::Record> parts;
        for (std::uint64_t seed = 1; seed <= count; ++seed) parts.push_back(run(excited, seed, {}, periods));
        const auto record = joined(parts);
        EXPECT_EQ(detect_period(record).value_or(0), kPeriod) << periods << " periods, " << count;
        EXPECT_EQ(realisations_of(record, kPeriod).size(), count);
      }
}

TEST(Realisations, ACutRecordLosesOnlyTheRealisationsThatTheCutSpoils) {
  std::vector<data::Record> parts;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) parts.push_back(run(all_up_to(50), seed, {}, 6));
  auto record = joined(parts);
  for (auto* channel : {&record.input, &record.output})
    channel->samples.erase(channel->samples.begin(), channel->samples.begin() + 700);
  EXPECT_EQ(detect_period(record).value_or(0), kPeriod);
  const auto found = realisations_of(record, kPeriod);
  ASSERT_EQ(found.size(), 4U);
  const auto bla = best_linear_approximation(found, {kPeriod, 0, 0.0, 0.0, {}}, Approach::direct).value();
  for (const auto& line : bla.lines.lines)
    EXPECT_LT(std::abs(line.output / line.input / filter(line.frequency_hz) - 1.0), 1e-6);
}

TEST(Realisations, OtherRecordsHaveNone) {
  // A record that simply repeats, one that never does, a stepped sine and a sweep.
  EXPECT_FALSE(detect_realisation_period(run(all_up_to(50), 1, {0.0, 0.0, 0.05}, 12)));
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  data::Record noise = run(all_up_to(50), 1, {}, 12), stepped = noise, sweep = noise;
  double phase = 0.0;
  for (std::size_t k = 0; k < noise.input.samples.size(); ++k) {
    noise.input.samples[k] = normal(random);
    const double t = static_cast<double>(k) / static_cast<double>(noise.input.samples.size());
    stepped.input.samples[k] =
        std::sin(kTwoPi * (0.01 + 0.005 * std::floor(8.0 * t)) * static_cast<double>(k));
    sweep.input.samples[k] = std::sin(phase);
    phase += kTwoPi * (0.005 + 0.05 * t);
  }
  for (const auto* record : {&noise, &stepped, &sweep}) EXPECT_FALSE(detect_realisation_period(*record));
}

TEST(Realisations, TheSamePhasesAreRefusedAlsoWhenShifted) {
  const auto one = run(all_up_to(50), 1, {}, 4);
  auto shifted = one;
  for (auto* channel : {&shifted.input, &shifted.output})
    std::rotate(channel->samples.begin(), channel->samples.begin() + 300, channel->samples.end());
  const auto other = run(all_up_to(50), 2, {}, 4);
  const auto fewer = run(all_up_to(20), 3, {}, 4);
  using Pair = std::pair<std::size_t, std::size_t>;
  EXPECT_EQ(no_realisations(std::vector{one, other}, kPeriod), std::nullopt);
  EXPECT_EQ(no_realisations(std::vector{one, other, shifted}, kPeriod), (Pair{0, 2}));
  EXPECT_EQ(no_realisations(std::vector{one, fewer}, kPeriod), (Pair{0, 1}));
  EXPECT_EQ(best_linear_approximation(std::vector{one, shifted}, {kPeriod, 0, 0.0, 0.0, {}}, Approach::direct)
                .error()
                .field,
            "records");
}

/// The test must sound once in a thousand by chance, and at a distortion of a tenth of the noise's power it
/// has to be heard over the 400 x 7 degrees of freedom.
TEST(BestLinearApproximation, TellsDistortionFromChance) {
  int alarms = 0;
  for (std::uint64_t trial = 0; trial < 40; ++trial) {
    std::vector<data::Record> records;
    for (std::uint64_t m = 0; m < 4; ++m)
      records.push_back(run(all_up_to(100), 100 * trial + m + 1, {0.0, 0.0, 0.02}, 5));
    alarms += best_linear_approximation(records, {}, Approach::direct).value().level.significant ? 1 : 0;
  }
  EXPECT_LE(alarms, 1);
  std::vector<data::Record> records;
  for (std::uint64_t seed = 1; seed <= 8; ++seed)
    records.push_back(run(all_up_to(400), seed, {0.0, 0.002, 0.02}, 6));
  const auto found = best_linear_approximation(records, {}, Approach::direct).value();
  EXPECT_TRUE(found.level.significant);
  // c sqrt(6 (3 - x^2)/4), mean square over 0 < x < 1: c^2 6 (3 - 1/3)/4; the filter weighs both alike.
  EXPECT_NEAR(found.level.level / (0.002 * 2.0), 1.0, 0.15);
}

/// Few realisations: the circle of the response holds the truth as often as it says.
TEST(BestLinearApproximation, ErrorBarsHoldWithTwoRealisations) {
  int held = 0, all = 0;
  for (std::uint64_t trial = 0; trial < 20; ++trial) {
    const std::vector<data::Record> records{run(all_up_to(100), 2 * trial + 1, {0.0, 0.0, 0.05}, 4),
                                            run(all_up_to(100), 2 * trial + 2, {0.0, 0.0, 0.05}, 4)};
    const auto lines = best_linear_approximation(records, {}, Approach::direct).value().lines;
    const auto g = plant_response(lines, {Approach::direct, std::nullopt, 0.0}).value();
    for (std::size_t i = 0; i < g.lines(); ++i) {
      const double radius = data::confidence_radius(g.std[i], 0.95);
      held += std::abs(g.value[i] - filter(g.frequency_hz[i])) < radius ? 1 : 0;
      ++all;
    }
  }
  // 2000 lines, neighbours share their noise: some 250 independent ones, so 1.4 % standard deviation.
  EXPECT_NEAR(static_cast<double>(held) / all, 0.95, 0.04);
}

/// Odd multiples, one of every four left out.
std::vector<int> odd_with_gaps() {
  std::vector<int> lines;
  for (int k = 1, i = 0; k < 400; k += 2, ++i)
    if (i % 4 != 2) lines.push_back(k);
  return lines;
}

TEST(DetectionLines, TellEvenFromOddDistortion) {
  const auto even = detection_lines(run(odd_with_gaps(), 3, {0.02, 0.0, 0.01}, 8), {}).value();
  EXPECT_TRUE(even.even.significant);
  EXPECT_FALSE(even.odd.significant);
  EXPECT_GT(even.even.lines, 150U);
  const auto odd = detection_lines(run(odd_with_gaps(), 3, {0.0, 0.02, 0.01}, 8), {}).value();
  EXPECT_FALSE(odd.even.significant);
  EXPECT_TRUE(odd.odd.significant);
  const auto none = detection_lines(run(odd_with_gaps(), 3, {0.0, 0.0, 0.01}, 8), {}).value();
  EXPECT_FALSE(none.even.significant);
  EXPECT_FALSE(none.odd.significant);
}

/// c u^2 of a Gaussian u of variance 1 has variance 2 c^2 around its mean. All of it lies on even multiples.
/// Of excited odd lines with share q = 3/4 in |f| < B the convolution is triangular over 2 B: within the band
/// three quarters of the power, on B/2 even lines of 1 Hz; per excited line there is 1/(q B/2).
TEST(DetectionLines, LevelOfASquareIsThatOfTheory) {
  constexpr double kSquare = 0.05;
  const auto found = detection_lines(run(odd_with_gaps(), 5, {kSquare, 0.0, 0.0}, 4), {}).value();
  // The filter weighs both alike to first order: 400 Hz of 2048 changes it from 2 to 1.3, so 15 % are
  // allowed.
  EXPECT_NEAR(found.even.level / (kSquare * std::sqrt(2.0 * 0.75 * 0.75)), 1.0, 0.15);
}

TEST(DetectionLines, RefuseAFullExcitation) {
  EXPECT_FALSE(detection_lines(run(all_up_to(100), 1, {}, 4), {}));
}

}  // namespace
}  // namespace resonid::response
