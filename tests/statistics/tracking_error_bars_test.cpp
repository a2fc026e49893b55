// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/detail/full_kalman_bank.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <string>

#include "error_ratio.hpp"

namespace resonid::test {
namespace {

// Normalised estimation error squared of the line trackers on a constant plant, Publication IV and VI with
// noise 0.1 rad/s: its mean over 100 seeds lies within 0.8 ... 1.3 of the nominal 1.
constexpr std::uint64_t kSeeds = 100;
constexpr double kRate = 1.0 / kSampleTime;

void expect_nominal(double ratio) {
  testing::Test::RecordProperty("error_ratio", std::to_string(ratio));
  EXPECT_GE(ratio, 0.8);
  EXPECT_LE(ratio, 1.3);
}

TEST(TrackingErrorBars, KalmanBank) {
  const auto bank = Bank::create({.sample_rate_hz = kRate, .frequency_hz = kLines, .lambda = 100.0}).value();
  expect_nominal(error_ratio(bank, multisine(15000), kSeeds, kNoise));
}

TEST(TrackingErrorBars, FullKalmanBank) {
  const std::array<double, 1> drift{0.1};
  for (const auto form : {online::RiccatiForm::time_varying, online::RiccatiForm::steady_state}) {
    const auto bank = online::FullKalmanBank<double, 8>::create({.sample_rate_hz = kRate,
                                                                 .frequency_hz = kLines,
                                                                 .noise_rms = kNoise,
                                                                 .drift = drift,
                                                                 .form = form})
                          .value();
    expect_nominal(error_ratio(bank, multisine(15000), kSeeds, kNoise));
  }
}

TEST(TrackingErrorBars, SlidingDft) {
  const auto lines = whole_lines();
  for (const auto window : {online::DftWindow::rectangular, online::DftWindow::hann}) {
    const auto dft =
        online::SlidingDft<double, 8, 500>::create(
            {.sample_rate_hz = kRate, .window_samples = 500, .frequency_hz = lines, .window = window})
            .value();
    expect_nominal(error_ratio(dft, whole_multisine(30500), kSeeds, kNoise));
  }
}

// Every 0.2 s of the whole sweep. Taken singly the ratio goes from 0.5, where the tracker has just left the
// resonance and still takes its change for noise, to 2.1 on the resonance, where U is smallest.
TEST(TrackingErrorBars, ChirpTracker) {
  for (const auto gain : {online::GainRule::fixed, online::GainRule::placed_poles}) {
    const auto tracker =
        online::ChirpTracker<double>::create(
            {.sample_rate_hz = kRate, .from_hz = 35.0, .to_hz = 1.5, .duration_s = 17.0, .gain = gain})
            .value();
    expect_nominal(error_ratio(tracker, chirp(8500), kSeeds, kNoise, 100));
  }
}

}  // namespace
}  // namespace resonid::test
