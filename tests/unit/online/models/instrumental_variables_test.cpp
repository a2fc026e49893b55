// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <golden.hpp>
#include <limits>
#include <random>
#include <resonid/online/models/instrumental_variables.hpp>
#include <resonid/online/models/modes.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "allocation_counter.hpp"

namespace resonid::online {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Tooth belt at 4 ms with the controller and the start of tests/golden/e_expected.json.
struct Belt {
  nlohmann::json expected = test::golden_json("e_expected.json");
  std::vector<double> ru = test::golden_column("e_tooth.csv", "ru"),
                      u = test::golden_column("e_tooth.csv", "u"),
                      y = test::golden_column("e_tooth.csv", "y");
  std::array<double, 3> numerator{}, denominator{1.0, -2.0, 1.0};
  InstrumentalVariablesConfig<3> config;

  Belt() {
    for (std::size_t i = 0; i < 3; ++i) {
      config.start.a[i] = expected.at("theta0")[i].get<double>();
      config.start.b[i] = expected.at("theta0")[i + 3].get<double>();
    }
    const auto number = [&](const char* name) { return expected.at(name).get<double>(); };
    const double ts = number("Ts"), kp = number("Kp");
    const std::array<double, 2> pi{kp * (1.0 + ts / number("Ti")), -kp},
        outer{1.0 + number("Kpc") * ts, -1.0};
    numerator = {pi[0] * outer[0], pi[0] * outer[1] + pi[1] * outer[0], pi[1] * outer[1]};
    config.controller_numerator = numerator;
    config.controller_denominator = denominator;
    config.delay_samples = 1;
  }
  Belt(const Belt&) = delete;

  template <class Estimator>
  void feed(Estimator& iv, std::size_t from, std::size_t to) const {
    using Real = typename Estimator::Scalar;
    for (std::size_t k = from; k < to; ++k)
      iv.step(static_cast<Real>(ru[k]), static_cast<Real>(u[k]), static_cast<Real>(y[k]));
  }
};

template <class Real>
double resonance(const InstrumentalVariables<Real, 3>& iv) {
  const auto modes = SampledModes<3>(iv.model(), 250.0).resonances();
  return modes.empty() ? 0.0 : modes[0].frequency_hz;
}

using Iv = InstrumentalVariables<double, 3>;

static_assert(std::is_trivially_copyable_v<Iv>);
static_assert(std::is_trivially_copyable_v<InstrumentalVariables<float, 3>>);

// The published recursion, as an independent implementation has it.
TEST(InstrumentalVariables, FollowsTheGoldenTrajectories) {
  Belt belt;
  for (const std::string name : {"iv_refined", "iv_refined_0.1s"}) {
    const auto& want = belt.expected.at(name);
    belt.config.terms.basis = Basis::powers;
    belt.config.terms.offsets = false;
    belt.config.memory_samples = 1.0 / (1.0 - want.at("lam").get<double>());
    belt.config.noise_rms = 1.0;
    belt.config.start_deviation = std::sqrt(want.at("p0").get<double>());
    belt.config.largest_deviation = 1e6;
    belt.config.refresh_samples = 10;
    auto iv = Iv::create(belt.config).value();
    std::size_t row = 0;
    for (std::size_t k = 0; k < belt.y.size(); ++k) {
      iv.step(belt.ru[k], belt.u[k], belt.y[k]);
      if (row == belt.expected.at("k").size() || k != belt.expected.at("k")[row].get<std::size_t>()) continue;
      const auto model = iv.model();
      for (std::size_t i = 0; i < 3; ++i) {
        const double a = want.at("theta")[row][i].get<double>();
        const double b = want.at("theta")[row][i + 3].get<double>();
        EXPECT_NEAR(model.a[i], a, 1e-6 * std::abs(a)) << name << k;
        EXPECT_NEAR(model.b[i], b, 1e-6 * std::abs(b)) << name << k;
      }
      const double fres = want.at("fres")[row].get<double>();
      EXPECT_NEAR(resonance(iv), fres, 1e-6 * fres) << name << k;
      ++row;
    }
    EXPECT_EQ(row, belt.expected.at("k").size());
  }
}

TEST(InstrumentalVariables, SinglePrecisionAgrees) {
  const Belt belt;
  auto exact = Iv::create(belt.config).value();
  auto coarse = InstrumentalVariables<float, 3>::create(belt.config).value();
  for (std::size_t k = 0; k + 100 <= belt.y.size(); k += 100) {
    belt.feed(exact, k, k + 100);
    belt.feed(coarse, k, k + 100);
    if (k >= 300) {
      EXPECT_NEAR(resonance(coarse) / resonance(exact), 1.0, 2e-4) << k;
    }
  }
}

TEST(InstrumentalVariables, StepsWithoutHeapAndRepeatsAfterReset) {
  const Belt belt;
  auto iv = Iv::create(belt.config).value();
  const auto before = test::allocations();
  belt.feed(iv, 0, 1000);
  const auto first = iv.model();
  (void)iv.covariance();
  (void)iv.lag_samples();
  EXPECT_EQ(test::allocations(), before);
  iv.reset();
  EXPECT_EQ(iv.samples(), 0u);
  belt.feed(iv, 0, 1000);
  EXPECT_EQ(iv.model().a, first.a);
  EXPECT_EQ(iv.model().b, first.b);
}

TEST(InstrumentalVariables, MissingSamplesAreSkipped) {
  const Belt belt;
  auto whole = Iv::create(belt.config).value(), holed = whole;
  for (std::size_t k = 0; k < 3000; ++k) {
    whole.step(belt.ru[k], belt.u[k], belt.y[k]);
    // One signal at a time; a missing excitation or torque costs more than a missing output.
    const double lost = k % 97 == 50 ? kNaN : 1.0;
    holed.step(belt.ru[k], belt.u[k], belt.y[k] * lost);
  }
  EXPECT_EQ(holed.skipped_samples(), 31u);
  EXPECT_EQ(holed.samples(), 3000u);
  EXPECT_NEAR(resonance(holed) / resonance(whole), 1.0, 0.01);
  for (std::size_t k = 3000; k < 3500; ++k)
    holed.step(k % 50 == 0 ? std::numeric_limits<double>::infinity() : belt.ru[k], belt.u[k], belt.y[k]);
  EXPECT_TRUE(std::isfinite(resonance(holed)));
  belt.feed(holed, 3500, 4500);
  belt.feed(whole, 3000, 4500);
  EXPECT_NEAR(resonance(holed) / resonance(whole), 1.0, 1e-3);
}

TEST(InstrumentalVariables, KnowsWhenItsStartNoLongerMatters) {
  const Belt belt;
  auto iv = Iv::create(belt.config).value();
  EXPECT_FALSE(iv.ready());
  EXPECT_TRUE(std::isinf(static_cast<double>(iv.covariance()(0, 0))));
  belt.feed(iv, 0, 10);
  EXPECT_FALSE(iv.ready());
  belt.feed(iv, 10, 500);
  EXPECT_TRUE(iv.ready());
  EXPECT_TRUE(iv.excited());
  // Age of the forgetting, delay, half a sample, and 0.75/(zeta w) of the oscillation: zeta 0.05, 84 Hz.
  const double memory = default_memory_samples(belt.config.start);
  EXPECT_NEAR(iv.lag_samples(), memory - 1.0 + 1.5 + 0.75 / (0.05 * kTwoPi * 84.4 / 250.0), 3.0);
}

// Excitation off half of the time, noise always: no blow-up, the estimate held, the flag raised.
template <class Real>
void rest_and_run(std::size_t updates) {
  const Belt belt;
  auto iv = InstrumentalVariables<Real, 3>::create(belt.config).value();
  AuxiliaryLoop<double, 3> machine = AuxiliaryLoop<double, 3>::create(belt.config.controller_numerator,
                                                                      belt.config.controller_denominator, 1)
                                         .value();
  machine.set_model(belt.config.start);
  const double truth = SampledModes<3>(belt.config.start, 250.0).resonances()[0].frequency_hz;
  std::mt19937_64 random(1);
  constexpr std::size_t kPhase = 20000;
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < updates; ++k) {
    if (k % 32 == 0) bits = random();
    const bool on = k / kPhase % 2 == 0;
    const double excitation = on ? ((bits >> (k % 32) & 1) != 0 ? 1.0 : -1.0) : 0.0;
    machine.step(excitation);
    const double noise = 0.2 * (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5);
    iv.step(static_cast<Real>(excitation), static_cast<Real>(machine.input().at(0)),
            static_cast<Real>(machine.output().at(0) + noise));
    if (k % kPhase != kPhase - 1) continue;
    ASSERT_EQ(iv.excited(), on) << k;
    ASSERT_NEAR(resonance(iv), truth, 0.02 * truth) << k;
    ASSERT_TRUE(iv.covariance().allFinite()) << k;
  }
}
TEST(InstrumentalVariables, SurvivesRestsInTenMillionUpdates) { rest_and_run<double>(10'000'000); }
TEST(InstrumentalVariables, SurvivesRestsInSinglePrecision) { rest_and_run<float>(1'000'000); }

TEST(InstrumentalVariables, RefusesWhatItCannotUse) {
  const auto field = [](auto change) {
    Belt belt;
    change(belt.config);
    const auto iv = Iv::create(belt.config);
    return iv ? std::string() : std::string(iv.error().field);
  };
  using Config = InstrumentalVariablesConfig<3>;
  EXPECT_EQ(field([](Config&) {}), "");
  EXPECT_EQ(field([](Config& c) { c.start.a[0] = kNaN; }), "start");
  EXPECT_EQ(field([](Config& c) { c.start.b = {10.0, 10.0, 10.0}; }), "start");
  EXPECT_EQ(field([](Config& c) { c.controller_numerator = {}; }), "controller_numerator");
  EXPECT_EQ(field([](Config& c) { c.controller_denominator = {}; }), "controller_denominator");
  EXPECT_EQ(field([](Config& c) { c.delay_samples = 1000; }), "delay_samples");
  EXPECT_EQ(field([](Config& c) { c.memory_samples = 1.0; }), "memory_samples");
  EXPECT_EQ(field([](Config& c) { c.start_deviation = 0.0; }), "start_deviation");
  EXPECT_EQ(field([](Config& c) { c.largest_deviation = kNaN; }), "largest_deviation");
  EXPECT_EQ(field([](Config& c) { c.noise_rms = -1.0; }), "noise_rms");
}

// The equations of both bases and both integrators are those of the same model.
TEST(InstrumentalRegressors, ParametersAndModelsConvertBothWays) {
  const Belt belt;
  const auto model = belt.config.start;
  for (const bool fixed : {true, false})
    for (const Basis basis : {Basis::powers, Basis::differences}) {
      const EquationTerms terms{fixed, true, false, basis};
      const InstrumentalRegressors<double, 3> equations(terms, 1, model);
      const auto back = equations.model(equations.parameters(model));
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(back.b[i], model.b[i], 1e-12);
        EXPECT_NEAR(back.a[i], model.a[i],
                    1e-8);  // the golden start has 9 digits, so its sum is not quite -1
      }
    }
}

// Coulomb friction is found as the torque that it takes.
TEST(InstrumentalVariables, EstimatesCoulombFriction) {
  Belt belt;
  belt.config.terms.coulomb = true;
  belt.config.memory_samples = std::numeric_limits<double>::infinity();
  auto iv = Iv::create(belt.config).value();
  const auto& m = belt.config.start;
  // The machine itself, with friction added to its torque, turning to and fro by the torque given.
  constexpr double kFriction = 0.3;
  SignalHistory<double> torque, velocity;
  DiscreteFilter<double, 2> controller =
      DiscreteFilter<double, 2>::create(belt.numerator, belt.denominator).value();
  std::mt19937_64 random(3);
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < 20000; ++k) {
    if (k % 64 == 0) bits = random();
    double v = 0.0;
    for (std::size_t i = 0; i < 3; ++i) v += m.b[i] * torque.at(i) - m.a[i] * velocity.at(i);
    const double y = velocity.at(0);  // one sample of delay
    const double reference = 20.0 * std::sin(kTwoPi * static_cast<double>(k) / 500.0);
    const double ru = (bits >> (k % 64) & 1) != 0 ? 1.0 : -1.0;
    const double u = ru + controller.step(reference - y);
    iv.step(ru, u, y);
    velocity.push(v);
    torque.push(u - kFriction * static_cast<double>((v > 0.0) - (v < 0.0)));
  }
  EXPECT_NEAR(iv.coulomb_torque(), kFriction, 0.05 * kFriction);
  EXPECT_NEAR(resonance(iv), SampledModes<3>(m, 250.0).resonances()[0].frequency_hz, 0.05);
}

}  // namespace
}  // namespace resonid::online
