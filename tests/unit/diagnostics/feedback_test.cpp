// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/detail/feedback.hpp>

namespace resonid::diagnostics {
namespace {

constexpr double kPole = 0.95, kGain = 0.1;

/// y(k+1) = pole y(k) + gain u(k), white noise of unit size on the recorded y, u = ru - feedback y.
data::Record loop(double feedback, double excitation, std::size_t samples, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise;
  data::Record record;
  record.sample_rate_hz = 500.0;
  double state = 0.0;
  for (std::size_t k = 0; k < samples; ++k) {
    const double y = state + noise(generator);
    const double u = excitation * noise(generator) - feedback * y;
    record.output.samples.push_back(y);
    record.input.samples.push_back(u);
    state = kPole * state + kGain * u;
  }
  return record;
}

/// Without feedback the probability is uniform: 120 records, binomial limits of 3.5 standard deviations.
TEST(Feedback, RateOfFalseAlarmsIsTheOneStated) {
  constexpr int kRecords = 120;
  int tenth = 0, half = 0;
  for (int i = 0; i < kRecords; ++i) {
    const auto f = find_feedback(loop(0.0, 1.0, 1500, static_cast<unsigned>(i)), 0.0);
    ASSERT_TRUE(f.has_value());
    EXPECT_FALSE(f->present());
    tenth += f->probability < 0.1 ? 1 : 0;
    half += f->probability < 0.5 ? 1 : 0;
  }
  // What looks ahead does not count, so that the rate is a little below the stated one.
  EXPECT_LE(tenth, 0.1 * kRecords + 3.5 * std::sqrt(0.09 * kRecords));
  EXPECT_GE(tenth, 1);
  EXPECT_LE(half, 0.5 * kRecords + 3.5 * std::sqrt(0.25 * kRecords));
  EXPECT_GE(half, 0.5 * kRecords - 5.0 * std::sqrt(0.25 * kRecords));
}

TEST(Feedback, FindsWeakFeedback) {
  const auto f = find_feedback(loop(0.3, 1.0, 4000, 1), 0.0);
  ASSERT_TRUE(f.has_value());
  EXPECT_TRUE(f->present());
  // Of u = ru - 0.3 y the innovation's part: 0.09/(1 + 0.09).
  EXPECT_NEAR(f->seen, 0.09 / 1.09, 0.02);
  EXPECT_NEAR(f->d.front(), -0.3, 4.0 * std::sqrt(1.0 / 4000.0));
}

/// The bias of averaged spectra, (G S_ru - S_v C* ...)/S_u, from the loop's own transfer functions.
TEST(Feedback, BiasOfTheDirectResponseIsThatOfTheory) {
  const double feedback = 2.0, excitation = 1.0;
  const auto f = find_feedback(loop(feedback, excitation, 60000, 1), 0.0);
  ASSERT_TRUE(f.has_value());
  for (const double hz : {20.0, 50.0, 100.0}) {
    const auto z = std::polar(1.0, -kTwoPi * hz / 500.0);
    const auto g = kGain * z / (1.0 - kPole * z);
    // y = S (G ru + v), u = S (ru - C v): Gd = (G S_ru - C S_v)/(S_ru + C^2 S_v).
    const auto direct =
        (g * excitation * excitation - feedback) / (excitation * excitation + feedback * feedback);
    const auto bias = direct / g - 1.0;
    EXPECT_NEAR(std::abs(f->direct_bias(hz) / bias - 1.0), 0.0, 0.25) << hz;
  }
}

/// u = S (ru - C v): C^2 S_v/(S_ru + C^2 S_v) of its power is noise, at every frequency.
TEST(Feedback, ShareOfNoiseInTheInputIsThatOfTheory) {
  for (const auto& [feedback, excitation] : {std::pair(2.0, 1.0), {0.5, 2.0}, {2.0, 0.05}}) {
    const auto f = find_feedback(loop(feedback, excitation, 60000, 1), 0.0);
    ASSERT_TRUE(f.has_value());
    const double share = feedback * feedback / (feedback * feedback + excitation * excitation);
    for (const double hz : {20.0, 50.0, 100.0}) EXPECT_NEAR(f->noise_share(hz), share, 0.3 * share) << hz;
  }
}

TEST(Feedback, InputThatLooksAheadIsNone) {
  auto record = loop(0.0, 1.0, 20000, 3);
  // The output half a sample early: y(k) answers part of u(k) too.
  for (std::size_t k = 0; k < record.samples(); ++k)
    record.output.samples[k] += 0.5 * record.input.samples[k];
  const auto f = find_feedback(record, 0.0);
  ASSERT_TRUE(f.has_value());
  EXPECT_FALSE(f->present());
}

TEST(Feedback, NothingIsFedBackWithoutNoise) {
  auto record = loop(0.0, 1.0, 4000, 1);
  double state = 0.0;
  for (std::size_t k = 0; k < record.samples(); ++k) {
    record.output.samples[k] = state;
    state = kPole * state + kGain * record.input.samples[k];
  }
  const auto f = find_feedback(record, 0.0);
  ASSERT_TRUE(f.has_value());
  EXPECT_EQ(f->probability, 1.0);
  for (const double hz : {5.0, 50.0}) {
    const auto z = std::polar(1.0, -kTwoPi * hz / 500.0);
    EXPECT_NEAR(std::abs(f->response(hz) / (kGain * z / (1.0 - kPole * z)) - 1.0), 0.0, 1e-6);
  }
}

TEST(Feedback, RefusesWhatItCannotJudge) {
  EXPECT_EQ(find_feedback(loop(0.0, 1.0, 500, 1), 0.0).error().field, "record");
  auto still = loop(0.0, 1.0, 2000, 1);
  std::fill(still.input.samples.begin(), still.input.samples.end(), 1.0);
  EXPECT_FALSE(find_feedback(still, 0.0).has_value());
}

}  // namespace
}  // namespace resonid::diagnostics
