// SPDX-License-Identifier: MIT
// The explicit call for lost samples: as so many samples that are not finite, in a bounded time.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/detail/full_kalman_bank.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/line_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <type_traits>

namespace resonid::online {
namespace {

constexpr double kRate = 1000.0;
constexpr std::array<double, 3> kLines{8.0, 20.0, 52.0};  // of a window of 250 samples: bins 2, 5, 13
constexpr std::uint64_t kHuge = 1'000'000'000'000'000;

KalmanBank<double, 4> bank(std::type_identity<KalmanBank<double, 4>>) {
  return *KalmanBank<double, 4>::create({.sample_rate_hz = kRate, .frequency_hz = kLines, .lambda = 50.0});
}
FullKalmanBank<double, 4> bank(std::type_identity<FullKalmanBank<double, 4>>) {
  static constexpr std::array<double, 1> kDrift{0.05};
  return *FullKalmanBank<double, 4>::create(
      {.sample_rate_hz = kRate, .frequency_hz = kLines, .noise_rms = 0.1, .drift = kDrift});
}
SlidingDft<double, 4, 250> bank(std::type_identity<SlidingDft<double, 4, 250>>) {
  return *SlidingDft<double, 4, 250>::create(
      {.sample_rate_hz = kRate, .window_samples = 250, .frequency_hz = kLines, .window = DftWindow::hann});
}
ChirpTracker<double> bank(std::type_identity<ChirpTracker<double>>) {
  return *ChirpTracker<double>::create(
      {.sample_rate_hz = kRate, .from_hz = 5.0, .to_hz = 80.0, .duration_s = 6.0, .offset = true});
}
struct LogarithmicChirp : ChirpTracker<double> {
  explicit LogarithmicChirp(const ChirpTracker<double>& t) : ChirpTracker<double>(t) {}
};
LogarithmicChirp bank(std::type_identity<LogarithmicChirp>) {
  return LogarithmicChirp(*ChirpTracker<double>::create({.sample_rate_hz = kRate,
                                                         .from_hz = 80.0,
                                                         .to_hz = 5.0,
                                                         .duration_s = 6.0,
                                                         .sweep = Sweep::logarithmic}));
}

double signal(std::uint64_t k, double scale = 1.0) {
  const double t = static_cast<double>(k) / kRate;
  double x = 0.3;
  for (std::size_t i = 0; i < kLines.size(); ++i)
    x += scale / static_cast<double>(i + 1) * std::cos(kTwoPi * kLines[i] * t + static_cast<double>(i));
  const std::uint64_t hash = (k + 1) * 0x9E3779B97F4A7C15ULL;
  return x + 0.05 * (static_cast<double>((hash ^ (hash >> 29U)) % 1000) / 500.0 - 1.0);
}

template <class Tracker>
class MissedBy : public testing::Test {
 public:
  static void run(Tracker& t, std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t k = from; k < to; ++k) t.step(signal(k));
  }
  static void expect_equal(const Tracker& a, const Tracker& b, double tolerance) {
    EXPECT_EQ(a.samples(), b.samples());
    EXPECT_EQ(a.skipped_samples(), b.skipped_samples());
    for (std::size_t i = 0; i < a.lines(); ++i) {
      EXPECT_LE(std::abs(a.phasor(i) - b.phasor(i)), tolerance) << "line " << i;
      EXPECT_LE(std::abs(a.amplitude(i) - b.amplitude(i)), tolerance) << "line " << i;
      EXPECT_EQ(a.frequency_hz(i), b.frequency_hz(i));
      EXPECT_EQ(a.settled(i), b.settled(i));
    }
  }
};
using Trackers = testing::Types<KalmanBank<double, 4>, FullKalmanBank<double, 4>, SlidingDft<double, 4, 250>,
                                ChirpTracker<double>, LogarithmicChirp>;
TYPED_TEST_SUITE(MissedBy, Trackers);

TYPED_TEST(MissedBy, EqualsSoManySamplesThatAreNotFinite) {
  for (const std::uint64_t before : {0U, 1U, 777U, 5900U})
    for (const std::uint64_t count : {0U, 1U, 2U, 16U, 17U, 200U, 250U, 1000U, 20011U}) {
      SCOPED_TRACE(testing::Message() << count << " missing after " << before);
      auto stepped = bank(std::type_identity<TypeParam>());
      this->run(stepped, 0, before);
      auto missed = stepped;
      missed.miss(count);
      for (std::uint64_t k = 0; k < count; ++k) stepped.step(std::nan(""));
      this->expect_equal(missed, stepped, 1e-9);
      this->run(missed, before + count, before + count + 300);
      this->run(stepped, before + count, before + count + 300);
      this->expect_equal(missed, stepped, 1e-9);
    }
}

TYPED_TEST(MissedBy, AHugeGapTakesNoTimeAndLeavesTheStateFinite) {
  auto t = bank(std::type_identity<TypeParam>());
  this->run(t, 0, 3000);
  t.miss(kHuge);
  EXPECT_EQ(t.samples(), 3000 + kHuge);
  EXPECT_EQ(t.skipped_samples(), kHuge);
  for (std::size_t i = 0; i < t.lines(); ++i) {
    EXPECT_TRUE(std::isfinite(std::abs(t.phasor(i))));
    EXPECT_LT(std::abs(t.phasor(i)), 100.0);
  }
}

TEST(MissedSamples, AConstantLineStandsStillInAmplitudeOverAGapOfAnHour) {
  auto t = bank(std::type_identity<KalmanBank<double, 4>>());
  for (std::uint64_t k = 0; k < 4000; ++k) t.step(std::cos(kTwoPi * 20.0 * static_cast<double>(k) / kRate));
  const auto before = t.amplitude(1);
  t.miss(3'600'123);
  EXPECT_LT(std::abs(t.amplitude(1) - before), 1e-8);
  EXPECT_NEAR(std::abs(t.amplitude(1)), 1.0, 1e-6);
  t.step(std::cos(kTwoPi * 20.0 * 3'604'123 / kRate));
  EXPECT_LT(std::abs(t.innovation()), 1e-6);
}

TEST(MissedSamples, TheCovarianceOfTheFullBankGrowsAsIfStepped) {
  auto stepped = bank(std::type_identity<FullKalmanBank<double, 4>>());
  for (std::uint64_t k = 0; k < 500; ++k) stepped.step(signal(k));
  auto missed = stepped;
  missed.miss(5000);
  for (int k = 0; k < 5000; ++k) stepped.step(std::nan(""));
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT((missed.covariance(i) - stepped.covariance(i)).norm(), 1e-9 * stepped.covariance(i).norm());
  // E|p(t) - p(0)|^2 = drift^2 t, by definition, on top of what it was.
  auto later = missed;
  later.miss(1'000'000);
  const double grown = std::pow(later.standard_deviation(1), 2) - std::pow(missed.standard_deviation(1), 2);
  EXPECT_NEAR(grown, 0.05 * 0.05 * 1000.0, 1e-6);
}

TEST(MissedSamples, LineBankInBothPrecisions) {
  const auto check = [](auto zero, double tolerance) {
    using Real = decltype(zero);
    LineBankConfig config;
    config.bank = {.sample_rate_hz = kRate, .frequency_hz = kLines, .lambda = 50.0};
    auto stepped = *LineBank<Real, 4>::create(config);
    for (std::uint64_t k = 0; k < 900; ++k)
      stepped.step(static_cast<Real>(signal(k)), static_cast<Real>(signal(k, 2.0)));
    for (const std::uint64_t count : {1U, 16U, 17U, 3000U}) {
      auto missed = stepped, slow = stepped;
      missed.miss(count);
      for (std::uint64_t k = 0; k < count; ++k) slow.step({std::numeric_limits<Real>::quiet_NaN(), Real(0)});
      EXPECT_EQ(missed.samples(), slow.samples());
      EXPECT_EQ(missed.skipped_samples(), slow.skipped_samples());
      EXPECT_EQ(missed.innovation(0), Real(0));
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t c = 0; c < 2; ++c)
          EXPECT_LE(
              std::abs(std::complex<double>(missed.phasor(c, i)) - std::complex<double>(slow.phasor(c, i))),
              count <= 16 ? 0.0 : tolerance);
    }
    stepped.miss(kHuge);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(std::abs(stepped.phasor(0, i)), Real(1.2));
  };
  check(0.0, 1e-9);
  check(0.0F, 2e-4);  // 3000 roundings of a float turn
}

/// The noise of the response is neither forgotten nor taken for smaller in a gap.
template <class Tracker>
void expect_noise_kept() {
  const auto tracker = bank(std::type_identity<Tracker>());
  auto t = *ResponseTracker<Tracker>::create(tracker, {});
  std::mt19937_64 generator(3);
  std::normal_distribution<double> noise(0.0, 0.1);
  const auto run = [&](std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t k = from; k < to; ++k) {
      const double u = signal(k);
      t.step(u, 2.0 * u + noise(generator));
    }
  };
  run(0, 8000);
  const auto scalar = [&](std::size_t line) { return t.standard_deviation(line); };
  const double before = scalar(1);
  ASSERT_TRUE(std::isfinite(before));
  auto stepped = t;
  t.miss(5003);
  for (int k = 0; k < 5003; ++k) stepped.step(std::nan(""), 0.0);
  EXPECT_NEAR(t.standard_deviation(1), stepped.standard_deviation(1), 1e-9 * before);
  EXPECT_EQ(t.samples(), stepped.samples());
  EXPECT_EQ(t.skipped_samples(), 5003U);
  EXPECT_NEAR(scalar(1), before, 0.02 * before);
  t.miss(kHuge);
  EXPECT_NEAR(scalar(1), before, 0.02 * before);
}
TEST(MissedSamples, NoiseOfTheResponseIsKeptByAKalmanBank) { expect_noise_kept<KalmanBank<double, 4>>(); }
TEST(MissedSamples, NoiseOfTheResponseIsKeptByASlidingDft) {
  expect_noise_kept<SlidingDft<double, 4, 250>>();
}

/// 45 % of the samples missing at random must not make the error bars of windows smaller.
TEST(MissedSamples, ScatteredOnesDoNotShrinkTheErrorBarsOfWindows) {
  using Tracker = SlidingDft<double, 4, 250>;
  const auto spread = [](bool holes) {
    auto t = *ResponseTracker<Tracker>::create(bank(std::type_identity<Tracker>()), {});
    std::mt19937_64 generator(11);
    std::normal_distribution<double> noise(0.0, 0.1);
    std::bernoulli_distribution hole(0.45);
    for (std::uint64_t k = 0; k < 50000; ++k) {
      double u = 0.0;
      for (const double f : kLines) u += std::cos(kTwoPi * f * static_cast<double>(k) / kRate);
      const double y = 2.0 * u + noise(generator);
      t.step(u, hole(generator) && holes ? std::nan("") : y);
    }
    return t.standard_deviation(1);
  };
  EXPECT_NEAR(spread(true) / spread(false), 1.0, 0.15);
}

}  // namespace
}  // namespace resonid::online
