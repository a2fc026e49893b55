// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <golden.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <resonid/fit/black_box.hpp>
#include <resonid/fit/detail/order_selection.hpp>

namespace resonid::fit {
namespace {

constexpr double kPi = std::numbers::pi;

/// A plant as a sum of simple sections: simulated and evaluated without the digits that polynomials of high
/// order lose.
struct Plant {
  std::vector<data::TransferFunction> sections;

  [[nodiscard]] std::complex<double> response(double f) const {
    std::complex<double> sum = 0.0;
    for (const auto& s : sections) sum += s.response(f);
    return sum;
  }
  [[nodiscard]] std::vector<double> simulate(const std::vector<double>& u) const {
    std::vector<double> y(u.size(), 0.0);
    for (const auto& s : sections) {
      const auto part = s.simulate(u);
      for (std::size_t k = 0; k < y.size(); ++k) y[k] += part[k];
    }
    return y;
  }
};

constexpr double kRate = 200.0;

/// Lightly damped modes from 3 Hz upwards, an odd order with a slow real pole.
Plant modal_plant(int order) {
  Plant plant;
  if (order % 2 == 1) plant.sections.push_back({{0.0, 0.02}, {1.0, -0.98}, 1.0 / kRate});
  for (int j = 0; j < order / 2; ++j) {
    const double angle = 2.0 * kPi * 3.0 * std::pow(1.33, j) / kRate, radius = std::exp(-0.03 * angle);
    const double gain = 0.05 * std::pow(1.33, j);
    plant.sections.push_back(
        {{0.0, gain, 0.8 * gain}, {1.0, -2.0 * radius * std::cos(angle), radius * radius}, 1.0 / kRate});
  }
  return plant;
}

data::Record record_of(const Plant& plant, std::size_t samples, double noise, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  data::Record record;
  record.sample_rate_hz = kRate;
  for (std::size_t k = 0; k < samples; ++k) record.input.samples.push_back(normal(engine) > 0.0 ? 1.0 : -1.0);
  record.output.samples = plant.simulate(record.input.samples);
  for (double& v : record.output.samples) v += noise * normal(engine);
  return record;
}

std::vector<double> grid() {
  std::vector<double> f;
  for (int i = 1; i <= 60; ++i) f.push_back(1.5 * i);
  return f;
}

double worst_error(const BlackBoxModel& model, const Plant& plant) {
  const auto f = grid();
  const auto g = model.response(f);
  double worst = 0.0;
  for (std::size_t i = 0; i < f.size(); ++i)
    worst = std::max(worst, std::abs(g.value[i] / plant.response(f[i]) - 1.0));
  return worst;
}

BlackBoxConfig config_of(int order) {
  BlackBoxConfig c;
  c.order = order;
  return c;
}

TEST(BlackBox, NoiseFreePlantsOfOrdersOneToTwelveAreFoundExactly) {
  for (const int order : {1, 2, 3, 4, 5, 6, 7, 8, 12}) {
    const Plant plant = modal_plant(order);
    const auto fit = fit_black_box(record_of(plant, 3000, 0.0, 1), config_of(order));
    ASSERT_TRUE(fit.has_value());
    EXPECT_TRUE(fit->stable);
    EXPECT_LT(worst_error(fit->model, plant), 1e-9) << order;
    EXPECT_GT(fit->fit_percent, 99.9999);
  }
}

TEST(BlackBox, PolesAndZerosAreThoseOfThePlant) {
  const Plant plant = modal_plant(2);
  const auto fit = fit_black_box(record_of(plant, 3000, 0.02, 2), config_of(2)).value();
  const auto poles = fit.model.poles();
  ASSERT_EQ(poles.size(), 2U);
  for (const auto& pole : poles) {
    double nearest = 1.0;
    for (const auto& truth : plant.sections[0].poles())
      nearest = std::min(nearest, std::abs(pole.value - truth));
    EXPECT_LT(nearest, 4.0 * std::sqrt(pole.covariance.trace()));
    EXPECT_LT(std::sqrt(pole.covariance.trace()), 1e-3);
  }
  const auto zeros = fit.model.zeros();
  ASSERT_EQ(zeros.size(), 1U);
  EXPECT_NEAR(zeros[0].value.real(), -0.8, 4.0 * std::sqrt(zeros[0].covariance(0, 0)));
  EXPECT_GT(zeros[0].covariance(0, 0), 0.0);
  // The same from the polynomials alone.
  BlackBoxModel plain = fit.model;
  plain.realisation = {};
  EXPECT_NEAR(plain.zeros()[0].value.real(), zeros[0].value.real(), 1e-9);
  EXPECT_NEAR(plain.zeros()[0].covariance(0, 0) / zeros[0].covariance(0, 0), 1.0, 1e-6);
  const double f = 3.0;
  EXPECT_NEAR(plain.response({&f, 1}).std[0] / fit.model.response({&f, 1}).std[0], 1.0, 1e-6);
}

/// Normalised squared error of [b, a] over seeds: its mean is the number of parameters when the covariance is
/// right.
TEST(BlackBox, CovarianceIsTheScatter) {
  const Plant plant = modal_plant(2);
  const auto& truth = plant.sections[0];
  double sum = 0.0;
  constexpr int kSeeds = 60;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const auto fit = fit_black_box(record_of(plant, 1000, 0.1, seed), config_of(2)).value();
    const auto& g = fit.model.transfer_function;
    Eigen::Vector4d e(g.numerator[1] - truth.numerator[1], g.numerator[2] - truth.numerator[2],
                      g.denominator[1] - truth.denominator[1], g.denominator[2] - truth.denominator[2]);
    const Eigen::Matrix4d c = fit.model.covariance.bottomRightCorner<4, 4>();
    sum += e.dot(c.inverse() * e);
    EXPECT_EQ(fit.model.covariance.row(0).norm(), 0.0);  // no direct term
  }
  // chi squared with 240 degrees of freedom: 4 +- 0.37 (1 sigma)
  EXPECT_NEAR(sum / kSeeds, 4.0, 1.1);
}

TEST(BlackBox, ColouredNoiseIsWhitenedAndItsErrorBarsAreRight) {
  const Plant plant = modal_plant(3);
  double told = 0.0, made = 0.0, unweighted = 0.0;
  const auto f = grid();
  for (unsigned seed = 1; seed <= 25; ++seed) {
    auto record = record_of(plant, 2000, 0.0, seed);
    std::mt19937_64 engine(seed + 1000);
    std::normal_distribution<double> normal;
    double noise = 0.0;
    for (double& v : record.output.samples) v += noise = 0.97 * noise + 0.05 * normal(engine);
    auto config = config_of(3);
    const auto fit = fit_black_box(record, config).value();
    EXPECT_GE(fit.noise.order(), 1U);
    config.noise_model = false;
    const auto plain = fit_black_box(record, config).value();
    const auto g = fit.model.response(f), p = plain.model.response(f);
    for (std::size_t i = 0; i < f.size(); ++i) {
      const auto truth = plant.response(f[i]);
      told += std::norm(g.std[i] / truth);
      made += std::norm(g.value[i] / truth - 1.0);
      unweighted += std::norm(p.value[i] / truth - 1.0);
    }
  }
  EXPECT_NEAR(std::sqrt(made / told), 1.0, 0.25);
  EXPECT_GT(std::sqrt(unweighted / made), 1.2);
}

TEST(BlackBox, OffsetInitialStateIntegratorAndDirectTermDoNoHarm) {
  const Plant plant = modal_plant(4);
  auto record = record_of(plant, 4000, 0.0, 3);
  for (auto* x : {&record.input.samples, &record.output.samples}) x->erase(x->begin(), x->begin() + 37);
  for (double& v : record.output.samples) v += 12.0;
  EXPECT_LT(worst_error(fit_black_box(record, config_of(4))->model, plant), 1e-9);

  // Behind an integrator a constant torque is a ramp.
  Plant drive;
  drive.sections = {{{0.0, 0.01}, {1.0, -1.0}, 1.0 / kRate}, modal_plant(2).sections[0]};
  auto torque = record_of(drive, 4000, 0.0, 4);
  double load = 3.0;
  for (double& v : torque.output.samples) v += load += 0.02;
  for (const bool integrator : {false, true}) {
    auto config = config_of(3);
    config.integrator = integrator;
    const auto fit = fit_black_box(torque, config).value();
    if (integrator) {
      EXPECT_LT(worst_error(fit.model, drive), 1e-9);
    }
    EXPECT_TRUE(fit.stable || !integrator);
  }

  Plant direct = modal_plant(2);
  direct.sections.push_back({{0.3}, {1.0}, 1.0 / kRate});
  auto config = config_of(2);
  config.direct_term = true;
  const auto fit = fit_black_box(record_of(direct, 3000, 0.0, 5), config).value();
  EXPECT_LT(worst_error(fit.model, direct), 1e-9);
  EXPECT_NEAR(fit.model.transfer_function.numerator[0], 0.3, 1e-9);
}

TEST(BlackBox, AGivenStartNeedNotBeNear) {
  const Plant plant = modal_plant(2);
  auto config = config_of(2);
  config.initial = data::TransferFunction{{0.0, 1.0}, {1.0, -1.2, 0.5}, 1.0 / kRate};
  EXPECT_LT(worst_error(fit_black_box(record_of(plant, 2000, 0.0, 6), config)->model, plant), 1e-9);
}

/// Truth: scipy 1.10.1 on tests/golden/f_prbs_sys2.csv, u_noisy to y_noisy, delay 2 samples, at rest, no
/// offset:
///   yh(b, a) = r_[0, 0, lfilter(r_[0, b], r_[1, a], u)[:-2]], least_squares(y - yh, x0, method="lm",
///   xtol=1e-15, ftol=1e-15, x_scale="jac", jac by lfilter), x0: the zero-order-hold model of oe_ml in
///   f_expected.json. tests/reference/black_box_least_squares.py does it from a start nearby.
TEST(BlackBox, MeetsScipyLeastSquares) {
  data::Record record;
  record.sample_rate_hz = 500.0;
  record.input.samples = test::golden_column("f_prbs_sys2.csv", "u_noisy");
  record.output.samples = test::golden_column("f_prbs_sys2.csv", "y_noisy");
  auto config = config_of(3);
  config.delay_samples = 2;
  config.initial_state = config.offset = config.noise_model = false;
  const auto fit = fit_black_box(record, config).value();
  EXPECT_TRUE(fit.converged);
  const auto& g = fit.model.transfer_function;
  const std::array<double, 6> scipy = {0.0617013682766, -0.121111509502, 0.0605099524376,
                                       -2.92819479465,  2.89169510603,   -0.963510154936};
  double squares = 0.0;
  for (const double e : fit.residual) squares += e * e;
  EXPECT_NEAR(squares / 49.738277386, 1.0, 1e-9);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(g.numerator[i + 1] / scipy[i], 1.0, 1e-5);
    EXPECT_NEAR(g.denominator[i + 1] / scipy[i + 3], 1.0, 1e-6);
  }
}

TEST(BlackBox, AnIntegratorIsNotUnstableButAGrowingModeIs) {
  Plant drive;
  drive.sections = {{{0.0, 0.01}, {1.0, -1.0}, 1.0 / kRate}};
  int outside = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const auto fit = fit_black_box(record_of(drive, 1500, 0.05, seed), config_of(1)).value();
    EXPECT_TRUE(fit.stable) << seed;
    outside += std::abs(fit.model.poles()[0].value) > 1.0 ? 1 : 0;
  }
  EXPECT_GT(outside, 3);  // otherwise this tells nothing

  Plant growing;
  const double radius = 1.001, angle = 0.1;
  growing.sections = {{{0.0, 0.05}, {1.0, -2.0 * radius * std::cos(angle), radius * radius}, 1.0 / kRate}};
  for (unsigned seed = 1; seed <= 3; ++seed)
    EXPECT_FALSE(fit_black_box(record_of(growing, 1500, 0.05, seed), config_of(2)).value().stable) << seed;
}

TEST(BlackBox, OrderIsChosenOnTheHeldBackPart) {
  OrderSelectionConfig config;
  config.highest = 6;
  for (const int order : {2, 4}) {
    const auto chosen = select_order(record_of(modal_plant(order), 4000, 0.1, 7), config).value();
    EXPECT_EQ(chosen.order, order);
    ASSERT_GT(chosen.trials.size(), static_cast<std::size_t>(order));
    EXPECT_GT(chosen.trials[0].excess, chosen.trials[0].standard_error);
    EXPECT_LT(worst_error(chosen.fit.model, modal_plant(order)), 0.1);
  }
  for (const auto seed : {7U, 8U, 9U}) {
    config.highest = 8;
    const auto chosen = select_order(record_of(modal_plant(2), 600, 0.5, seed), config).value();
    const auto& t = chosen.trials;
    if (std::any_of(t.begin(), t.end(), [](const OrderTrial& o) { return o.converged && o.stable; })) {
      const auto of_choice = [&](const OrderTrial& o) { return o.order == chosen.order; };
      const auto found = std::find_if(t.begin(), t.end(), of_choice);
      ASSERT_NE(found, t.end());
      EXPECT_TRUE(found->converged && found->stable) << seed;
    }
  }
  config.lowest = 5;
  config.highest = 4;
  EXPECT_EQ(select_order(record_of(modal_plant(2), 1000, 0.1, 7), config).error().field, "highest");
}

/// y(k) = x((k - d + m) T) of sum g/(s + a) behind a hold: with p = exp(-a T) each part of it has the direct
/// term g (1 - p^m)/a and the residue g p^m (1 - p)/a (modified z-transform, Jury 1958).
TEST(BlackBox, AFractionOfASampleInTheDelayIsAParameter) {
  constexpr std::size_t kDelay = 3;
  for (const double m : {0.1, 0.5, 0.93}) {
    Plant plant;
    for (const auto& [a, g] : {std::pair(9.0, 1.0), std::pair(60.0, 3.0)}) {
      const double p = std::exp(-a / kRate), h = g * (1.0 - std::pow(p, m)) / a,
                   r = g * std::pow(p, m) * (1.0 - p) / a;
      plant.sections.push_back({{0.0, 0.0, 0.0, h, r - h * p}, {1.0, -p}, 1.0 / kRate});
    }
    auto config = config_of(2);
    config.delay_samples = kDelay;
    config.direct_term = true;
    const auto clean = fit_black_box(record_of(plant, 3000, 0.0, 1), config).value();
    ASSERT_TRUE(clean.model.delay());
    EXPECT_NEAR(clean.model.delay()->value * kRate, 3.0 - m, 1e-7);
    int within = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const auto delay = fit_black_box(record_of(plant, 3000, 0.002, seed), config)->model.delay().value();
      EXPECT_LT(delay.std * kRate, 0.1);
      within += std::abs(delay.value * kRate - (3.0 - m)) < 2.0 * delay.std * kRate ? 1 : 0;
    }
    EXPECT_GE(within, 16);  // of 20, 95 % each: less with probability 3e-3
  }
}

TEST(BlackBox, AMovedModelIsTheOneThatTheCovarianceSpeaksOf) {
  const Plant plant = modal_plant(3);
  for (const bool integrator : {false, true})
    for (const bool direct : {false, true}) {
      auto config = config_of(3);
      config.integrator = integrator;
      config.direct_term = direct;
      const auto model = fit_black_box(record_of(plant, 2000, 0.05, 9), config)->model;
      const double f = 4.0;
      const auto size = [&](const BlackBoxModel& m) { return std::abs(m.response({&f, 1}).value[0]); };
      const auto angle = [&](const BlackBoxModel& m) { return std::arg(m.response({&f, 1}).value[0]); };
      const double both =
          std::hypot(model.standard_deviation_of(size), size(model) * model.standard_deviation_of(angle));
      EXPECT_NEAR(both / model.response({&f, 1}).std[0], 1.0, 1e-3) << integrator << direct;
    }
}

TEST(BlackBox, SamplesHeldBackAreNotSeen) {
  auto config = config_of(2);
  auto record = record_of(modal_plant(2), 2000, 0.1, 10);
  config.holdout = holdout_parts(2000);
  ASSERT_EQ(config.holdout.size(), 10U);
  EXPECT_EQ(config.holdout.front(), std::pair(std::size_t{140}, std::size_t{200}));
  const auto before = fit_black_box(record, config).value();
  EXPECT_EQ(before.samples, 1400U);
  EXPECT_EQ(
      std::count_if(before.holdout.begin(), before.holdout.end(), [](double e) { return std::isfinite(e); }),
      600);
  for (const auto& [from, to] : config.holdout)
    for (std::size_t k = from; k < to; ++k) record.output.samples[k] += 5.0;
  const auto after = fit_black_box(record, config).value();
  for (std::size_t i = 0; i <= 2; ++i)
    EXPECT_NEAR(before.model.transfer_function.denominator[i], after.model.transfer_function.denominator[i],
                1e-6);
  EXPECT_NEAR(after.holdout[150] - before.holdout[150], 5.0, 1e-9);
}

TEST(BlackBox, RefusesWhatItCannotFit) {
  const auto good = record_of(modal_plant(2), 300, 0.1, 8);
  const auto field = [](const data::Record& record, const BlackBoxConfig& config) {
    const auto fit = fit_black_box(record, config);
    return fit ? std::string() : std::string(fit.error().field);
  };
  EXPECT_EQ(field(good, config_of(2)), "");
  EXPECT_EQ(field(good, config_of(0)), "order");
  EXPECT_EQ(field(good, config_of(21)), "order");
  auto bad = good;
  bad.output.samples[7] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(field(bad, config_of(2)), "record");
  bad = good;
  bad.input.samples[7] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(field(bad, config_of(2)), "record");
  bad = good;
  bad.input.samples.assign(300, 1.0);
  EXPECT_EQ(field(bad, config_of(2)), "record");
  bad = good;
  bad.output.samples.assign(300, 1.0);
  EXPECT_EQ(field(bad, config_of(2)), "record");
  EXPECT_EQ(field(record_of(modal_plant(2), 40, 0.1, 8), config_of(2)), "record");
  auto config = config_of(2);
  config.predictor = Predictor::joint;
  EXPECT_EQ(field(good, config), "record");  // nothing to project on
  config.predictor = Predictor::closed_loop;
  EXPECT_EQ(field(good, config), "controller");
  config = config_of(1);
  config.initial = data::TransferFunction{{0.0, 1.0}, {1.0, -1.2, 0.5}, 1.0 / kRate};
  EXPECT_EQ(field(good, config), "initial");
  config = config_of(2);
  config.delay_samples = 290;
  EXPECT_EQ(field(good, config), "record");
}

}  // namespace
}  // namespace resonid::fit
