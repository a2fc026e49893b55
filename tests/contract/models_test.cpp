// SPDX-License-Identifier: MIT
// What holds for every estimator of a discrete model, beside the contract of all estimators
// (contract_test.cpp), and what each of them is for.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/output_error.hpp>
#include <tooth_belt.hpp>
#include <type_traits>
#include <vector>

namespace resonid::online {
namespace {

/// The constant tooth belt at 0.8 m in its loop: friction and load act beside u.
struct Loop {
  double noise = 0.02, load = 0.0, coulomb = 0.0, reference = 0.0;
  std::vector<double> ru, u, y;
  DiscreteModel<double, 3> machine = test::tooth_belt(0.8, 0.004);
  ControllerCoefficients controller = test::tooth_belt_controller(0.004);

  Loop& run(std::size_t samples, unsigned seed = 5) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    auto c = DiscreteFilter<double, 4>::create(controller.numerator, controller.denominator).value();
    Regression<double, 3> past(0, false);
    Regression<double, 3>::Vector f;
    double delayed = 0.0;
    for (std::size_t k = 0; k < samples; ++k) {
      past.fill(f);
      double velocity = 0.0;
      for (std::size_t i = 0; i < 3; ++i) velocity += machine.b[i] * f[i] + machine.a[i] * f[3 + i];
      const double direction = (velocity > 0.0) - (velocity < 0.0);
      y.push_back(delayed + noise * normal(generator));
      delayed = velocity;
      ru.push_back(normal(generator) > 0.0 ? 1.0 : -1.0);
      const double wanted = reference * std::sin(0.01 * static_cast<double>(k));
      u.push_back(ru.back() + c.step(wanted - y.back()));
      past.push(u.back() + load - coulomb * direction, velocity);
    }
    return *this;
  }
};

const Loop& plain() {
  static const Loop loop = Loop{}.run(6000);
  return loop;
}

ModelEstimatorConfig common() {
  static const DiscreteModel<double, 3> start = test::tooth_belt(0.85, 0.004);
  ModelEstimatorConfig c;
  c.sample_rate_hz = 250.0;
  c.delay_samples = 1;
  c.start_b = start.b;
  c.start_a = start.a;
  c.adaptation.start_variance = 0.01;
  c.adaptation.factor = 0.995;
  return c;
}
template <class Real>
Arx<Real, 3> make(std::type_identity<Arx<Real, 3>>, const ModelEstimatorConfig& c) {
  return Arx<Real, 3>::create({c}).value();
}
template <class Real>
OutputError<Real, 3> make(std::type_identity<OutputError<Real, 3>>, const ModelEstimatorConfig& c) {
  OutputErrorConfig o;
  o.common = c;
  o.controller_numerator = plain().controller.numerator;
  o.controller_denominator = plain().controller.denominator;
  return OutputError<Real, 3>::create(o).value();
}
template <class Real>
ClosedLoopOutputError<Real, 3> make(std::type_identity<ClosedLoopOutputError<Real, 3>>,
                                    const ModelEstimatorConfig& c) {
  ClosedLoopOutputErrorConfig o;
  o.common = c;
  o.controller_numerator = plain().controller.numerator;
  o.controller_denominator = plain().controller.denominator;
  o.gradient = ClosedLoopGradient::damped_filter;
  return ClosedLoopOutputError<Real, 3>::create(o).value();
}

template <class Estimator>
class EstimatorContract : public testing::Test {
 public:
  using Scalar = typename Estimator::Scalar;
  static Estimator fresh(const ModelEstimatorConfig& c = common()) {
    return make(std::type_identity<Estimator>(), c);
  }
  static void run(Estimator& e, const Loop& loop) {
    for (std::size_t k = 0; k < loop.y.size(); ++k)
      e.step(static_cast<Scalar>(loop.ru[k]), static_cast<Scalar>(loop.u[k]), static_cast<Scalar>(loop.y[k]));
  }
  /// Largest error of a parameter.
  static double error(const Estimator& e, const Loop& loop) {
    double worst = 0.0;
    const auto m = e.model();
    for (std::size_t i = 0; i < 3; ++i)
      worst = std::max({worst, std::abs(static_cast<double>(m.a[i]) - loop.machine.a[i]),
                        std::abs(static_cast<double>(m.b[i]) - loop.machine.b[i])});
    return worst;
  }
};
using Estimators =
    testing::Types<Arx<double, 3>, Arx<float, 3>, OutputError<double, 3>, OutputError<float, 3>,
                   ClosedLoopOutputError<double, 3>, ClosedLoopOutputError<float, 3>>;
TYPED_TEST_SUITE(EstimatorContract, Estimators);

TYPED_TEST(EstimatorContract, FindsTheMachineWithItsErrorBars) {
  auto e = this->fresh();
  EXPECT_FALSE(e.ready());
  this->run(e, plain());
  EXPECT_TRUE(e.ready());
  EXPECT_EQ(e.samples(), plain().y.size());
  EXPECT_LT(this->error(e, plain()), 0.03);
  const auto covariance = e.covariance();
  for (int i = 0; i < 6; ++i) {
    const double std = std::sqrt(static_cast<double>(covariance(i, i)));
    EXPECT_GT(std, 1e-5);
    EXPECT_LT(std, 0.03);
  }
  EXPECT_GT(e.lag_samples(), -30.0);
  EXPECT_LT(e.lag_samples(), 230.0);
  EXPECT_LT(std::abs(static_cast<double>(e.residual())), 0.5);
}

/// The sum of 16 squared errors in units of their bars is chi-square distributed: an rms of 0.5 ... 1.5 is
/// left by chance once in 250 times. What ARX leaves of an output with noise is no white residual: its bars,
/// which take it for one, are up to four times too wide, never too narrow.
TYPED_TEST(EstimatorContract, ErrorsAreOfTheSizeOfTheErrorBars) {
  constexpr bool kWhite =
      !std::is_same_v<TypeParam, Arx<double, 3>> && !std::is_same_v<TypeParam, Arx<float, 3>>;
  constexpr unsigned kLoops = 16;
  std::array<double, 6> squares{};
  for (unsigned seed = 1; seed <= kLoops; ++seed) {
    const Loop loop = Loop{}.run(2000, seed);
    auto e = this->fresh();
    this->run(e, loop);
    const auto m = e.model();
    const auto covariance = e.covariance();
    for (std::size_t i = 0; i < 6; ++i) {
      const double error = i < 3 ? static_cast<double>(m.b[i]) - loop.machine.b[i]
                                 : static_cast<double>(m.a[i - 3]) - loop.machine.a[i - 3];
      const auto at = static_cast<Eigen::Index>(i);
      squares[i] += error * error / static_cast<double>(covariance(at, at));
    }
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const double rms = std::sqrt(squares[i] / kLoops);
    EXPECT_LT(rms, 1.5) << i;
    EXPECT_GT(rms, kWhite ? 0.5 : 0.25) << i;
  }
}

TYPED_TEST(EstimatorContract, AFixedIntegratorStays) {
  ModelEstimatorConfig c = common();
  c.fixed_integrator = true;
  auto e = this->fresh(c);
  this->run(e, plain());
  const auto m = e.model();
  EXPECT_NEAR(1.0 + static_cast<double>(m.a[0] + m.a[1] + m.a[2]), 0.0, 1e-5);
  EXPECT_LT(this->error(e, plain()), 0.03);
  const Eigen::Matrix<double, 6, 6> covariance = e.covariance().template cast<double>();
  const Eigen::Matrix3d of_a = covariance.template bottomRightCorner<3, 3>();
  EXPECT_NEAR(of_a.sum(), 0.0, 1e-4 * of_a.trace());
}

TYPED_TEST(EstimatorContract, OffsetsAreRemovedAlike) {
  Loop shifted = plain();
  for (std::size_t k = 0; k < shifted.y.size(); ++k) {
    shifted.y[k] += 30.0;
    shifted.u[k] += 2.0;
    shifted.ru[k] -= 1.0;
  }
  ModelEstimatorConfig c = common();
  c.high_pass_hz = 1.0;
  c.freeze_below = 0.0;
  auto e = this->fresh(c);
  this->run(e, shifted);
  EXPECT_LT(this->error(e, plain()), 0.04);
}

TYPED_TEST(EstimatorContract, HoldsWithoutExcitation) {
  auto e = this->fresh();
  this->run(e, plain());
  const auto before = e.model();
  std::mt19937_64 generator(9);
  std::normal_distribution<double> normal;
  using Number = typename TypeParam::Scalar;
  for (int k = 0; k < 20000; ++k)
    e.step(Number(0), static_cast<Number>(1e-3 * normal(generator)),
           static_cast<Number>(0.02 * normal(generator)));
  EXPECT_FALSE(e.excited());
  EXPECT_FALSE(e.ready());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(e.model().a[i], before.a[i], 0.1);
}

TEST(Arx, ToldOfFrictionAndLoadFindsThemAndTheMachine) {
  Loop loop;
  loop.noise = 0.002;
  loop.load = 0.5;
  loop.coulomb = 0.4;
  loop.run(6000);
  ArxConfig c;
  c.common = common();
  c.load_torque = c.coulomb = true;
  auto e = Arx<double, 3>::create(c).value();
  c.load_torque = c.coulomb = false;
  auto ignorant = Arx<double, 3>::create(c).value();
  for (std::size_t k = 0; k < loop.y.size(); ++k) {
    e.step(loop.ru[k], loop.u[k], loop.y[k]);
    ignorant.step(loop.ru[k], loop.u[k], loop.y[k]);
  }
  using Contract = EstimatorContract<Arx<double, 3>>;
  EXPECT_NEAR(e.load_torque(), 0.5, 0.05);
  EXPECT_NEAR(e.coulomb_torque(), 0.4, 0.1);
  EXPECT_LT(2.0 * Contract::error(e, loop), Contract::error(ignorant, loop));
}

TEST(OutputError, ToldOfALoadFindsIt) {
  Loop loop;
  loop.load = 0.5;
  loop.run(6000);
  OutputErrorConfig c;
  c.common = common();
  c.load_torque = true;
  auto e = OutputError<double, 3>::create(c).value();
  for (std::size_t k = 0; k < loop.y.size(); ++k) e.step(loop.ru[k], loop.u[k], loop.y[k]);
  EXPECT_NEAR(e.load_torque(), 0.5, 0.05);
  EXPECT_LT((EstimatorContract<OutputError<double, 3>>::error(e, loop)), 0.05);
}

TEST(ClosedLoopOutputError, NeedsNoReferenceWhenTheInputIsMeasured) {
  Loop loop;
  loop.reference = 5.0;
  loop.run(6000);
  ClosedLoopOutputErrorConfig c;
  c.common = common();
  c.controller_numerator = loop.controller.numerator;
  c.controller_denominator = loop.controller.denominator;
  c.input = PredictorInput::measured;
  auto e = ClosedLoopOutputError<double, 3>::create(c).value();
  for (std::size_t k = 0; k < loop.y.size(); ++k) e.step(loop.ru[k], loop.u[k], loop.y[k]);
  EXPECT_LT((EstimatorContract<ClosedLoopOutputError<double, 3>>::error(e, loop)), 0.04);
}

TEST(ModelEstimators, RefuseWhatCannotWork) {
  const std::array<double, 2> two{1.0, 1.0};
  const auto field = [](const ModelEstimatorConfig& c) { return Arx<double, 3>::create({c}).error().field; };
  const auto with = [](auto change) {
    ModelEstimatorConfig c = common();
    change(c);
    return c;
  };
  EXPECT_EQ(field(with([](auto& c) { c.sample_rate_hz = 0.0; })), "sample_rate_hz");
  EXPECT_EQ(field(with([](auto& c) { c.delay_samples = 64; })), "delay_samples");
  EXPECT_EQ(field(with([&](auto& c) { c.start_b = two; })), "start_b");
  EXPECT_EQ(field(with([&](auto& c) { c.start_a = two; })), "start_a");
  EXPECT_EQ(field(with([](auto& c) { c.high_pass_hz = 125.0; })), "high_pass_hz");
  EXPECT_EQ(field(with([](auto& c) { c.freeze_below = 1.0; })), "freeze_below");
  EXPECT_EQ(field(with([&](auto& c) { c.adaptation.start = two; })), "adaptation.start");
  EXPECT_EQ(field(with([](auto& c) { c.adaptation.factor = 2.0; })), "factor");
  OutputErrorConfig o;
  o.common = common();
  o.filter_contraction = 0.0;
  EXPECT_EQ((OutputError<double, 3>::create(o).error().field), "filter_contraction");
  ClosedLoopOutputErrorConfig c;
  c.common = common();
  EXPECT_EQ((ClosedLoopOutputError<double, 3>::create(c).error().field), "controller_numerator");
  c.controller_numerator = two;
  EXPECT_EQ((ClosedLoopOutputError<double, 3>::create(c).error().field), "controller_denominator");
  c.controller_denominator = two;
  c.gradient = ClosedLoopGradient::fixed_filter;
  c.common.start_a = {};
  EXPECT_EQ((ClosedLoopOutputError<double, 3>::create(c).error().field), "start_a");
}

}  // namespace
}  // namespace resonid::online
