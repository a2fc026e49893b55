// SPDX-License-Identifier: MIT
// What holds for every tracker alike, beside the contract of all estimators (contract_test.cpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/detail/full_kalman_bank.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <type_traits>
#include <vector>

namespace resonid::online {
namespace {

constexpr std::array<double, 2> kLines{12.0, 31.0};

// Trackers at 500 Hz that have settled long before kSettled samples.
constexpr std::size_t kSettled = 3000;

template <class Scalar>
KalmanBank<Scalar, 4> make(std::type_identity<KalmanBank<Scalar, 4>>) {
  return KalmanBank<Scalar, 4>::create({.sample_rate_hz = 500.0, .frequency_hz = kLines, .lambda = 50.0})
      .value();
}
template <class Scalar>
FullKalmanBank<Scalar, 4> make(std::type_identity<FullKalmanBank<Scalar, 4>>) {
  static constexpr std::array<double, 1> kDrift{0.5};
  return FullKalmanBank<Scalar, 4>::create(
             {.sample_rate_hz = 500.0, .frequency_hz = kLines, .drift = kDrift, .start_deviation = 10.0})
      .value();
}
template <class Scalar>
ChirpTracker<Scalar> make(std::type_identity<ChirpTracker<Scalar>>) {
  return ChirpTracker<Scalar>::create({.sample_rate_hz = 500.0,
                                       .from_hz = 12.0,
                                       .to_hz = 35.0,
                                       .duration_s = 20.0,
                                       .offset = true,
                                       .gain = GainRule::placed_poles})
      .value();
}
template <class Scalar>
SlidingDft<Scalar, 4, 500> make(std::type_identity<SlidingDft<Scalar, 4, 500>>) {
  return SlidingDft<Scalar, 4, 500>::create({.sample_rate_hz = 500.0,
                                             .window_samples = 500,
                                             .frequency_hz = kLines,
                                             .window = DftWindow::hann})
      .value();
}

std::vector<double> signal(std::uint64_t seed, std::size_t samples = kSettled) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / 500.0;
    x[k] = 1.0 + std::cos(kTwoPi * 12.0 * t) + 0.5 * std::sin(kTwoPi * 31.0 * t) + normal(generator);
  }
  return x;
}

template <class Tracker>
class TrackerContract : public testing::Test {
 public:
  using Scalar = typename Tracker::Scalar;
  static constexpr double kEpsilon = std::numeric_limits<Scalar>::epsilon();
  static Tracker fresh() { return make(std::type_identity<Tracker>()); }
  static void run(Tracker& tracker, const std::vector<double>& x) {
    for (const double value : x) tracker.step(static_cast<Scalar>(value));
  }
};

using Trackers = testing::Types<KalmanBank<double, 4>, KalmanBank<float, 4>, FullKalmanBank<double, 4>,
                                FullKalmanBank<float, 4>, ChirpTracker<double>, ChirpTracker<float>,
                                SlidingDft<double, 4, 500>, SlidingDft<float, 4, 500>>;
TYPED_TEST_SUITE(TrackerContract, Trackers);

TYPED_TEST(TrackerContract, IsLinear) {
  const auto x = signal(1), y = signal(2);
  std::vector<double> sum(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) sum[k] = 2.0 * x[k] - 3.0 * y[k];
  auto of_x = this->fresh(), of_y = of_x, of_sum = of_x;
  this->run(of_x, x);
  this->run(of_y, y);
  this->run(of_sum, sum);
  for (std::size_t i = 0; i < of_x.lines(); ++i) {
    const std::complex<double> a(of_x.amplitude(i)), b(of_y.amplitude(i)), c(of_sum.amplitude(i));
    EXPECT_LT(std::abs(2.0 * a - 3.0 * b - c), 200.0 * this->kEpsilon);
  }
}

TYPED_TEST(TrackerContract, SettlesAfterItsSettlingTimeOnly) {
  auto tracker = this->fresh();
  const std::size_t settling =
      std::max(tracker.settling_samples(0), tracker.settling_samples(tracker.lines() - 1));
  ASSERT_GT(settling, 10U);
  ASSERT_LT(settling, kSettled);
  for (std::size_t k = 0; k < settling; ++k) {
    ASSERT_FALSE(tracker.ready());
    tracker.step(0);
  }
  EXPECT_TRUE(tracker.ready());
  EXPECT_TRUE(tracker.settled(0));
  tracker.reset();
  EXPECT_FALSE(tracker.settled(0));
}

template <class Exact, class Single>
void expect_agreement(double bound) {
  const auto x = signal(3, 20000);
  Exact exact = make(std::type_identity<Exact>());
  Single single = make(std::type_identity<Single>());
  double worst = 0.0;
  for (const double value : x) {
    exact.step(value);
    single.step(static_cast<float>(value));
    for (std::size_t i = 0; i < exact.lines(); ++i)
      worst = std::max(worst, std::abs(exact.amplitude(i) - std::complex<double>(single.amplitude(i))));
  }
  EXPECT_LT(worst, bound);
}

// Signals of size 1. The recursions hold the frequency to single precision: an error of 6e-8 rad per sample
// that the gain corrects over the tracker's lag, of about 100 samples.
TEST(TrackerPrecision, FloatAgreesWithDouble) {
  expect_agreement<KalmanBank<double, 4>, KalmanBank<float, 4>>(1e-5);
  expect_agreement<ChirpTracker<double>, ChirpTracker<float>>(2e-5);
  expect_agreement<SlidingDft<double, 4, 500>, SlidingDft<float, 4, 500>>(5e-7);
}

}  // namespace
}  // namespace resonid::online
