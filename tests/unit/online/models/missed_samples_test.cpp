// SPDX-License-Identifier: MIT
// miss(count) of the recursions: as so many samples that are not finite, in a bounded time.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <live_machine.hpp>
#include <memory>
#include <random>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/detail/missed_samples.hpp>
#include <resonid/online/models/instrumental_variables.hpp>
#include <resonid/online/models/output_error.hpp>
#include <resonid/online/models/physical_tracker.hpp>
#include <resonid/online/models/recursive_response_fit.hpp>
#include <tooth_belt.hpp>
#include <type_traits>
#include <vector>

namespace resonid::online {
namespace {

constexpr std::uint64_t kHuge = 1'000'000'000'000'000;
const double kNan = std::nan("");

/// The constant tooth belt in its loop at 4 ms.
struct Loop {
  std::vector<double> ru, u, y;
  DiscreteModel<double, 3> machine = test::tooth_belt(0.8, 0.004), start = test::tooth_belt(0.85, 0.004);
  ControllerCoefficients controller = test::tooth_belt_controller(0.004);

  Loop() {
    std::mt19937_64 generator(5);
    std::normal_distribution<double> normal;
    auto c = DiscreteFilter<double, 4>::create(controller.numerator, controller.denominator).value();
    Regression<double, 3> past(0, false);
    Regression<double, 3>::Vector f;
    double delayed = 0.0;
    for (std::size_t k = 0; k < 6000; ++k) {
      past.fill(f);
      double velocity = 0.0;
      for (std::size_t i = 0; i < 3; ++i) velocity += machine.b[i] * f[i] + machine.a[i] * f[3 + i];
      y.push_back(delayed + 0.02 * normal(generator));
      delayed = velocity;
      ru.push_back(normal(generator) > 0.0 ? 1.0 : -1.0);
      u.push_back(ru.back() + c.step(-y.back()));
      past.push(u.back(), velocity);
    }
  }
};
const Loop& loop() {
  static const Loop l;
  return l;
}

ModelEstimatorConfig common() {
  ModelEstimatorConfig c;
  c.sample_rate_hz = 250.0;
  c.delay_samples = 1;
  c.start_b = loop().start.b;
  c.start_a = loop().start.a;
  c.adaptation.start_variance = 0.01;
  c.adaptation.factor = 0.995;
  return c;
}
Arx<double, 3> make(std::type_identity<Arx<double, 3>>) { return Arx<double, 3>::create({common()}).value(); }
OutputError<double, 3> make(std::type_identity<OutputError<double, 3>>) {
  OutputErrorConfig o;
  o.common = common();
  return OutputError<double, 3>::create(o).value();
}
ClosedLoopOutputError<double, 3> make(std::type_identity<ClosedLoopOutputError<double, 3>>) {
  ClosedLoopOutputErrorConfig o;
  o.common = common();
  o.controller_numerator = loop().controller.numerator;
  o.controller_denominator = loop().controller.denominator;
  o.gradient = ClosedLoopGradient::damped_filter;
  return ClosedLoopOutputError<double, 3>::create(o).value();
}
InstrumentalVariables<double, 3> make(std::type_identity<InstrumentalVariables<double, 3>>) {
  InstrumentalVariablesConfig<3> c;
  c.start = loop().start;
  c.controller_numerator = loop().controller.numerator;
  c.controller_denominator = loop().controller.denominator;
  c.delay_samples = 1;
  return InstrumentalVariables<double, 3>::create(c).value();
}

template <class Estimator>
class MissedBy : public testing::Test {
 public:
  static void run(Estimator& e, std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) e.step(loop().ru[k], loop().u[k], loop().y[k]);
  }
  static double error(const Estimator& e) {
    double worst = 0.0;
    const auto m = e.model();
    for (std::size_t i = 0; i < 3; ++i)
      worst =
          std::max({worst, std::abs(m.a[i] - loop().machine.a[i]), std::abs(m.b[i] - loop().machine.b[i])});
    return worst;
  }
};
using Estimators = testing::Types<Arx<double, 3>, OutputError<double, 3>, ClosedLoopOutputError<double, 3>,
                                  InstrumentalVariables<double, 3>>;
TYPED_TEST_SUITE(MissedBy, Estimators);

TYPED_TEST(MissedBy, EqualsSoManySamplesThatAreNotFiniteBitForBit) {
  for (const std::uint64_t count : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{5}, kMostMissedSteps}) {
    auto stepped = make(std::type_identity<TypeParam>());
    this->run(stepped, 0, 2000);
    auto missed = stepped;
    missed.miss(count);
    for (std::uint64_t i = 0; i < count; ++i) stepped.step(kNan, kNan, kNan);
    for (std::size_t to = 2100; to <= 2500; to += 100) {
      this->run(missed, to - 100, to);
      this->run(stepped, to - 100, to);
      EXPECT_EQ(missed.model().a, stepped.model().a);
      EXPECT_EQ(missed.model().b, stepped.model().b);
      EXPECT_EQ(missed.residual(), stepped.residual());
    }
    EXPECT_EQ(missed.samples(), stepped.samples());
    EXPECT_EQ(missed.skipped_samples(), stepped.skipped_samples());
  }
}

/// The estimate as it was before the gap, and right again after it.
TYPED_TEST(MissedBy, AHugeGapIsCountedAndHarmless) {
  auto e = make(std::type_identity<TypeParam>());
  this->run(e, 0, 3000);
  const auto before = e.model();
  const Eigen::Matrix<double, 6, 6> covariance = e.covariance();
  ASSERT_TRUE(covariance.allFinite());
  e.miss(kHuge);
  EXPECT_EQ(e.samples(), 3000 + kHuge);
  EXPECT_EQ(e.skipped_samples(), kHuge);
  EXPECT_EQ(e.residual(), 0.0);
  for (std::size_t i = 0; i < 3; ++i) {  // an instrumental-variable estimate settles where it is held
    EXPECT_NEAR(e.model().a[i], before.a[i],
                0.01 * std::sqrt(covariance(static_cast<int>(3 + i), static_cast<int>(3 + i))));
    EXPECT_NEAR(e.model().b[i], before.b[i],
                0.01 * std::sqrt(covariance(static_cast<int>(i), static_cast<int>(i))));
  }
  this->run(e, 3000, 6000);
  EXPECT_TRUE(e.ready());
  EXPECT_LT(this->error(e), 0.05);
}

TEST(MissedSamples, LeastSquaresCountsThem) {
  auto rls = RecursiveLeastSquares<double, 2>::create({}).value();
  rls.step({1.0, 2.0}, 3.0);
  auto missed = rls;
  missed.miss(kHuge);
  EXPECT_EQ(missed.samples(), 1 + kHuge);
  EXPECT_EQ(missed.skipped_samples(), kHuge);
  EXPECT_EQ(missed.parameters(), rls.parameters());
  EXPECT_EQ(missed.information_inverse(), rls.information_inverse());
}

TEST(MissedSamples, AResponseFitGoesOnWithTheRightLine) {
  const std::array<double, 5> lines{5.0, 10.0, 20.0, 30.0, 40.0};
  auto stepped =
      RecursiveResponseFit<double, 3, 8>::create({.sample_rate_hz = 250.0, .frequency_hz = lines}).value();
  for (int k = 0; k < 8; ++k) stepped.step({1.0 / (1.0 + k), -0.5});
  auto missed = stepped;
  missed.miss(13);
  for (int k = 0; k < 13; ++k) stepped.step({kNan, 0.0});
  EXPECT_EQ(missed.next_line(), stepped.next_line());
  EXPECT_EQ(missed.steps(), stepped.steps());
  EXPECT_EQ(missed.skipped_steps(), stepped.skipped_steps());
  missed.miss(kHuge);
  EXPECT_EQ(missed.next_line(), (21 + kHuge) % 5);
}

// The published belt drive, system 2, under its controller.
using Tracker = PhysicalTracker<double, 512>;
std::unique_ptr<Tracker> tracker(double stiffness_drift_per_s) {
  PhysicalTrackerConfig c;
  c.sample_rate_hz = test::LiveMachine::kRate;
  c.delay_s = 0.004;
  c.driven_inertia = {0.0352, 0.3};
  c.load_inertia = {0.0288, 0.3};
  c.stiffness = {158.0, 0.3};
  c.damping = {0.24, 0.3};
  c.stiffness_drift_per_s = stiffness_drift_per_s;
  return std::make_unique<Tracker>(Tracker::create(c).value());
}
struct Drive {
  test::LiveMachine machine;
  std::mt19937_64 generator{1};
  double reference = 0.0;
  void run(Tracker* t, int samples) {
    for (int k = 0; k < samples; ++k) {
      const double ru = (generator() & 1U) != 0 ? 1.0 : -1.0;
      const auto now = machine.measure(reference);
      if (t != nullptr) t->step(ru, now.torque + ru, now.velocity);
      machine.apply(ru);
    }
  }
};

TEST(MissedSamples, PhysicalTrackerBitForBitUpToSoManySteps) {
  for (const std::uint64_t count : {std::uint64_t{1}, std::uint64_t{20}, kMostMissedSteps}) {
    auto stepped = tracker(0.0);
    Drive drive;
    drive.run(stepped.get(), 1500);
    auto missed = std::make_unique<Tracker>(*stepped);
    missed->miss(count);
    for (std::uint64_t i = 0; i < count; ++i) stepped->step(kNan, kNan, kNan);
    EXPECT_EQ(missed->samples(), stepped->samples());
    EXPECT_EQ(missed->skipped_samples(), stepped->skipped_samples());
    EXPECT_EQ(missed->covariance(), stepped->covariance());
    EXPECT_EQ(missed->value(PhysicalParameter::stiffness), stepped->value(PhysicalParameter::stiffness));
  }
}

/// The machine turns elsewhere after the gap; what was known of it is still known.
TEST(MissedSamples, PhysicalTrackerFindsBackAfterALongGap) {
  for (const double drift : {0.0, 0.05})
    for (const std::uint64_t count : {std::uint64_t{3000}, kHuge}) {
      SCOPED_TRACE(testing::Message() << "drift " << drift << ", " << count);
      auto t = tracker(drift);
      Drive drive;
      drive.run(t.get(), 4000);
      ASSERT_TRUE(t->ready());
      const double before = t->standard_deviation(PhysicalParameter::stiffness);
      t->miss(count);
      EXPECT_EQ(t->samples(), 4000 + count);
      EXPECT_GE(t->standard_deviation(PhysicalParameter::stiffness), before);
      drive.reference = 12.0;
      drive.run(nullptr, 3000);
      drive.run(t.get(), 1500);
      EXPECT_TRUE(t->ready());
      EXPECT_NEAR(t->resonance_hz(), 15.0856, 4.0 * t->resonance_std_hz());
      EXPECT_NEAR(t->resonance_hz(), 15.0856, 0.3);
    }
}

}  // namespace
}  // namespace resonid::online
