// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <recordings.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/periodic_averaging.hpp>
#include <resonid/response/welch.hpp>

#include "bench_fixture.hpp"
#include "drive_fixture.hpp"

namespace resonid {
namespace {

TEST(PeriodicAveraging, IsExactForAnExactSteadyState) {
  const test::BeltDrive drive;
  const std::vector<int> lines{3, 5, 8, 12, 17, 23, 31, 40};
  const auto record = drive.run(test::multisine(500, 16, lines), 0.0, 1, 10.0);
  response::PeriodicConfig config;
  config.drop_periods = 12;  // a mode decays by 1e-10 in 12 s
  response::ResponseOptions options;
  options.delay_s = 0.004;
  options.controller = drive.controller();
  for (const auto approach : {Approach::direct, Approach::indirect, Approach::joint}) {
    options.approach = approach;
    const auto response = response::periodic_average(record, config, options);
    ASSERT_TRUE(response) << response.error().requirement;
    ASSERT_EQ(response->lines(), lines.size());  // period and excited lines found
    for (std::size_t i = 0; i < lines.size(); ++i) {
      EXPECT_DOUBLE_EQ(response->frequency_hz[i], lines[i]);
      EXPECT_LT(std::abs(response->value[i] / drive.response(lines[i]) - 1.0), 1e-9) << lines[i];
      EXPECT_GT(response->coherence[i], 1.0 - 1e-9);
    }
  }
}

/// Those before the transient of a drive from rest has fallen below a thousandth, or into the noise.
TEST(TransientPeriods, AreThoseInWhichTheDriveHasNotSettled) {
  const test::BeltDrive drive;
  const auto settled_after = [&](double noise) {
    const auto record = drive.run(test::multisine(500, 16, {3, 5, 8, 12}), noise, 1, 10.0);
    return response::transient_periods(record, 500);
  };
  const auto quiet = settled_after(0.0), noisy = settled_after(0.002);
  const auto moved = [&](std::size_t period) {  // against what is there after 12 s, 1e-10 of it left
    const auto y = drive.run(test::multisine(500, 16, {3, 5, 8, 12}), 0.0, 1, 10.0).output.samples;
    double change = 0.0, size = 0.0, mean = 0.0;
    for (std::size_t k = 0; k < 500; ++k) mean += y[12 * 500 + k] / 500.0;
    for (std::size_t k = 0; k < 500; ++k) {
      change += std::pow(y[period * 500 + k] - y[12 * 500 + k], 2);
      size += std::pow(y[12 * 500 + k] - mean, 2);
    }
    return std::sqrt(change / size);
  };
  ASSERT_GE(quiet, 1U);
  EXPECT_GT(moved(quiet - 1), 0.9e-3);
  EXPECT_LT(moved(quiet), 1.1e-3);
  EXPECT_GE(noisy, 1U);
  EXPECT_LT(noisy, 8U);
}

TEST(TransientPeriods, AreNoneInARecordThatHasSettled) {
  const test::BeltDrive drive;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    auto record = drive.run(test::multisine(500, 16, {3, 5, 8, 12}), 0.05, seed, 10.0);
    for (auto* channel : {&record.input, &record.output, &record.excitation})
      channel->samples.erase(channel->samples.begin(), channel->samples.begin() + 12 * 500);
    EXPECT_EQ(response::transient_periods(record, 500), 0U) << "seed " << seed;
    record.output.samples.resize(1499);
    EXPECT_EQ(response::transient_periods(record, 500), 0U) << "less than three";
  }
}

TEST(TransientPeriods, AreNoneInARecordOfAMachineThatChanges) {
  const test::BeltDrive drive;
  auto record = drive.run(test::multisine(500, 16, {3, 5, 8, 12}), 0.002, 1, 10.0);
  for (auto* channel : {&record.input, &record.output, &record.excitation})
    channel->samples.erase(channel->samples.begin(), channel->samples.begin() + 8 * 500);
  auto changed = record;
  for (std::size_t k = 0; k < 4 * 500; ++k) changed.output.samples[k] *= 1.05;
  EXPECT_EQ(response::transient_periods(record, 500), 0U);
  EXPECT_EQ(response::transient_periods(changed, 500), 0U);
  changed = record;
  for (std::size_t k = 0; k < 500; ++k) changed.output.samples[k] *= 1.05;
  EXPECT_EQ(response::transient_periods(changed, 500), 1U);  // one alone may be a transient
}

TEST(PeriodicAveraging, RegionsHoldTheTruthWithFewPeriods) {
  const test::BeltDrive drive;
  const std::vector<int> lines{3, 5, 8, 12, 17, 23, 31, 40};
  response::ResponseOptions options;
  options.delay_s = 0.004;
  for (const std::size_t periods : {2u, 3u, 6u}) {
    const auto excitation = test::multisine(500, 6 + periods, lines);
    response::PeriodicConfig config;
    config.period_samples = 500;
    config.drop_periods = 6;
    int inside = 0;
    int all = 0;
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      const auto record = drive.run(excitation, 0.1, 1000 * periods + seed);
      config.lines_hz.assign(lines.begin(), lines.end());
      const auto response = response::periodic_average(record, config, options);
      ASSERT_TRUE(response);
      for (std::size_t i = 0; i < response->lines(); ++i, ++all)
        inside += std::abs(response->value[i] - drive.response(response->frequency_hz[i])) <
                  data::confidence_radius(response->std[i], 0.95);
    }
    EXPECT_NEAR(static_cast<double>(inside) / all, 0.95, 0.02) << periods << " periods";
  }
}

TEST(PeriodicAveraging, AcceptsAHintOfTheLinesAndRefusesTheRest) {
  const test::BeltDrive drive;
  const auto record = drive.run(test::multisine(500, 4, {3, 12, 23}), 0.01, 1);
  response::PeriodicConfig config;
  config.lines_hz = {12.2};
  const auto lines = response::periodic_lines(record, config, Approach::joint);
  ASSERT_TRUE(lines);
  ASSERT_EQ(lines->lines.size(), 1u);
  EXPECT_DOUBLE_EQ(lines->lines[0].frequency_hz, 12.0);
  config.drop_periods = 3;
  EXPECT_EQ(response::periodic_lines(record, config, Approach::joint).error().field, "drop_periods");
  config.drop_periods = 0;
  config.lines_hz = {251.0};
  EXPECT_EQ(response::periodic_lines(record, config, Approach::joint).error().field, "lines_hz");
}

TEST(ExcitationLines, DetectsPeriodsAndTheirAbsence) {
  const test::BeltDrive drive;
  EXPECT_EQ(response::detect_period(drive.run(test::multisine(500, 5, {3, 12, 23}), 0.1, 1)), 500u);
  auto measured = drive.run(test::multisine(400, 5, {3, 7, 12, 23}), 0.1, 1);
  measured.excitation.samples.clear();
  EXPECT_EQ(response::detect_period(measured), 400u);
  EXPECT_FALSE(response::detect_period(drive.run(test::chirp(35.0, 1.5, 17.0, 0.002), 0.1, 1)));
}

TEST(ExcitationLines, FindsTheBandOfAChirp) {
  const test::BeltDrive drive;
  const auto band =
      response::excited_band_hz(drive.run(test::chirp(60.0, 5.0, 30.0, 0.002), 0.1, 1), Approach::joint);
  ASSERT_TRUE(band);
  EXPECT_NEAR(band->first, 5.0, 1.0);
  EXPECT_NEAR(band->second, 60.0, 1.0);
}

TEST(PeriodicAveraging, MeasuresTheTwoMassBench) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  const auto record = test::two_mass_bench(path);
  EXPECT_EQ(response::detect_period(record), 2500u);
  response::PeriodicConfig config;
  config.drop_periods = 1;
  const auto response = response::periodic_average(record, config, test::direct());
  ASSERT_TRUE(response);
  ASSERT_EQ(response->lines(), 240u);
  EXPECT_DOUBLE_EQ(response->frequency_hz.front(), 11.0);
  EXPECT_DOUBLE_EQ(response->frequency_hz.back(), 250.0);
  auto coherence = response->coherence;
  std::nth_element(coherence.begin(), coherence.begin() + 120, coherence.end());
  EXPECT_GT(coherence[120], 0.999);
  // Independent two-mass fit of the bench: anti-resonance 53.9 Hz, resonance 76.2 Hz.
  const auto magnitude = [&](std::size_t a, std::size_t b) {
    return std::abs(response->value[a]) < std::abs(response->value[b]);
  };
  std::vector<std::size_t> order(240);
  for (std::size_t i = 0; i < 240; ++i) order[i] = i;
  EXPECT_NEAR(response->frequency_hz[*std::min_element(order.begin(), order.begin() + 100, magnitude)], 53.9,
              1.5);
  EXPECT_NEAR(response->frequency_hz[*std::max_element(order.begin() + 40, order.end(), magnitude)], 76.2,
              1.5);
}

/// The noise on a slow signal makes peaks of its correlation at a few samples; nothing repeats there.
TEST(DetectPeriod, IsNotTheFirstRippleOnASlowSignal) {
  std::mt19937 generator(5);
  std::normal_distribution<double> noise(0.0, 1e-3);
  data::Record record;
  record.sample_rate_hz = 1000.0;
  for (int k = 0; k < 4000; ++k)
    record.input.samples.push_back(std::sin(kTwoPi * 0.8 * k / 4000.0) + noise(generator));
  record.output = record.input;
  EXPECT_FALSE(response::detect_period(record));
}

TEST(PeriodicAveraging, AgreesWithWelchOnTheTwoMassBench) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  auto record = test::two_mass_bench(path);
  response::PeriodicConfig periodic;
  periodic.drop_periods = 1;
  const auto first = response::periodic_average(record, periodic, test::direct());
  record.input.samples.erase(record.input.samples.begin(), record.input.samples.begin() + 2500);
  record.output.samples.erase(record.output.samples.begin(), record.output.samples.begin() + 2500);
  response::WelchConfig welch;
  welch.period_samples = 2500;
  const auto second = response::welch(record, welch, test::direct());
  ASSERT_TRUE(first && second);
  ASSERT_EQ(second->lines(), 240u);
  double ratio = 0.0;
  for (std::size_t i = 0; i < 240; ++i) {
    // The same periods; neighbouring lines share their noise in the one, and only the noise of the input is
    // weighed otherwise.
    const double deviation = std::max(first->std[i], second->std[i]);
    EXPECT_LT(std::abs(first->value[i] - second->value[i]), 0.2 * deviation) << first->frequency_hz[i];
    ratio += std::log(second->std[i] / first->std[i]) / 240.0;
  }
  EXPECT_NEAR(std::exp(ratio), 1.0, 0.25);  // a mean logarithm of chi-square with 8 degrees is 0.07 below
}

}  // namespace
}  // namespace resonid
