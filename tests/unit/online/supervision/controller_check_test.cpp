// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <resonid/online/supervision/detail/controller_check.hpp>
#include <vector>

namespace resonid::online {
namespace {

constexpr double kRate = 250.0, kTs = 1.0 / kRate;

/// White noise of standard deviation 1 by the sum of uniform numbers; good enough, and the same everywhere.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed * 2654435761U + 1U) {}
  double step() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }
  double uniform() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state_ >> 11U) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

struct Law {
  std::vector<double> numerator, denominator;
};
/// KP (1 + Ts/TI z/(z-1)).
Law pi(double gain, double integral_s) { return {{gain * (1.0 + kTs / integral_s), -gain}, {1.0, -1.0}}; }
/// The same behind a position loop: C_pi (1 + kv Ts z/(z-1)).
Law cascade(double gain, double integral_s, double kv) {
  const double p = gain * (1.0 + kTs / integral_s), outer = 1.0 + kv * kTs;
  return {{p * outer, -p - gain * outer, gain}, {1.0, -2.0, 1.0}};
}

/// An inertia with friction and a sample of delay under `running`, whose reference is a slow sine; white
/// noise on its output.
template <class Real>
ControllerCheck<Real> checked(const Law& running, const Law& told, std::uint64_t seed, double noise,
                              double seconds) {
  ControllerCheckConfig config;
  config.sample_rate_hz = kRate;
  config.numerator = told.numerator;
  config.denominator = told.denominator;
  config.low_hz = 1.0;
  config.high_hz = 60.0;
  auto check = ControllerCheck<Real>::create(config).value();
  Noise random(seed);
  double velocity = 0.0, seen = 0.0;
  std::array<double, 3> error{}, input{};  // newest first; input without ru
  for (int k = 0; k < static_cast<int>(seconds * kRate); ++k) {
    const double y = seen + noise * random.step();
    error = {5.0 * std::sin(0.6 * k * kTs) - y, error[0], error[1]};
    double u = 0.0;
    for (std::size_t i = 0; i < running.numerator.size(); ++i) u += running.numerator[i] * error[i];
    for (std::size_t i = 1; i < running.denominator.size(); ++i) u -= running.denominator[i] * input[i - 1];
    input = {u, input[0], input[1]};
    const double ru = random.uniform() < 0.5 ? -1.0 : 1.0;
    check.step(static_cast<Real>(ru), static_cast<Real>(u + ru), static_cast<Real>(y));
    seen = velocity;
    velocity += kTs * (u + ru - 0.01 * velocity) / 0.0055;
  }
  return check;
}

template <class Real>
class ControllerCheckOf : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(ControllerCheckOf, Reals);

TYPED_TEST(ControllerCheckOf, TheRightOneIsNeverAccused) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto law = cascade(0.12, 0.2, 5.0);
    const auto check = checked<TypeParam>(law, law, seed, 0.1, 30.0);
    EXPECT_TRUE(check.ready()) << seed;
    EXPECT_FALSE(check.differs()) << seed;
  }
}

TYPED_TEST(ControllerCheckOf, AnotherOneIsFound) {
  const auto running = cascade(0.12, 0.2, 5.0);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    EXPECT_TRUE(checked<TypeParam>(running, pi(0.12, 0.2), seed, 0.1, 30.0).differs()) << seed;
    EXPECT_TRUE(checked<TypeParam>(running, cascade(0.132, 0.2, 5.0), seed, 0.1, 30.0).differs()) << seed;
    EXPECT_TRUE(checked<TypeParam>(pi(0.12, 0.2), running, seed, 0.1, 30.0).differs()) << seed;
  }
}

// C*/C of a cascade behind which a bare PI was told: 1 + kv Ts z/(z - 1).
TEST(ControllerCheck, TheRatioIsThatOfTheControllers) {
  const auto check = checked<double>(cascade(0.12, 0.2, 5.0), pi(0.12, 0.2), 3, 0.1, 120.0);
  for (std::size_t i = 0; i < check.kLines; ++i) {
    const std::complex<double> z = std::polar(1.0, kTwoPi * check.frequency_hz(i) * kTs);
    const auto ratio = 1.0 + 5.0 * kTs * z / (z - 1.0);
    constexpr double kCurved = 0.02;  // the ratio is no straight line over the width of a window
    EXPECT_LT(std::abs(check.ratio(i) - ratio), 4.0 * check.standard_deviation(i) + kCurved * std::abs(ratio))
        << check.frequency_hz(i);
    EXPECT_LT(check.standard_deviation(i), 0.03) << check.frequency_hz(i);
  }
}

TEST(ControllerCheck, WithoutExcitationNothingIsSaid) {
  auto check = ControllerCheck<double>::create(
      {.sample_rate_hz = kRate, .numerator = {}, .denominator = {}, .low_hz = 1.0, .high_hz = 60.0});
  ASSERT_FALSE(check);
  EXPECT_EQ(check.error().field, "numerator");
  const std::array<double, 1> one{1.0};
  check = ControllerCheck<double>::create(
      {.sample_rate_hz = kRate, .numerator = one, .denominator = one, .low_hz = 1.0, .high_hz = 60.0});
  ASSERT_TRUE(check);
  for (int k = 0; k < 20000; ++k) check->step(0.0, std::sin(0.1 * k), std::cos(0.1 * k));
  EXPECT_FALSE(check->ready());
  EXPECT_FALSE(check->differs());
}

TEST(ControllerCheck, LostSamplesAreCountedAndLeftOut) {
  const std::array<double, 2> n{0.2, -0.1}, d{1.0, -1.0};
  auto check =
      ControllerCheck<double>::create(
          {.sample_rate_hz = kRate, .numerator = n, .denominator = d, .low_hz = 2.0, .high_hz = 60.0})
          .value();
  Noise random(5);
  std::array<double, 2> y{};
  double own = 0.0;
  for (int k = 0; k < 20000; ++k) {
    y = {random.step(), y[0]};
    own += -n[0] * y[0] - n[1] * y[1];
    const double ru = random.step();
    if (k % 1000 == 999)
      check.step(ru, std::numeric_limits<double>::quiet_NaN(), y[0]);
    else
      check.step(ru, own + ru, y[0]);
    y[0] += 0.1 * ru;  // what the excitation does to the output
  }
  EXPECT_EQ(check.skipped_samples(), 20U);
  EXPECT_EQ(check.samples(), 20000U);
  check.miss(7);
  EXPECT_EQ(check.skipped_samples(), 27U);
  check.reset();
  EXPECT_EQ(check.samples(), 0U);
  EXPECT_FALSE(check.ready());
}

}  // namespace
}  // namespace resonid::online
