// SPDX-License-Identifier: MIT
// Pole placement against an independent implementation (tests/golden/e_tune_structures.json).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <tuple>

#include "design/figures.hpp"
#include "design/polynomial.hpp"
#include "design/rst.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

void expect_coefficients(const std::vector<double>& found, const std::vector<double>& golden, double room) {
  ASSERT_EQ(found.size(), golden.size());
  double largest = 0.0;
  for (const double x : golden) largest = std::max(largest, std::abs(x));
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], golden[i], room * largest) << i;
}

TEST(GoldenRst, PlantInPowersOfTheDelay) {
  test::for_each_rst_and_lqg([](const auto& c, const Machine& machine) {
    const auto plant = sampled_plant(machine.model());
    expect_coefficients(plant.numerator, c.at("rst").at("plant_b"), 1e-8);
    expect_coefficients(plant.denominator, c.at("rst").at("plant_a"), 1e-8);
  });
}

/// A S + B R.
std::vector<double> closed_polynomial(const data::TransferFunction& plant, const std::vector<double>& r,
                                      const std::vector<double>& s) {
  auto sum = polynomial_product(plant.denominator, s);
  const auto other = polynomial_product(plant.numerator, r);
  sum.resize(std::max(sum.size(), other.size()), 0.0);
  for (std::size_t i = 0; i < other.size(); ++i) sum[i] += other[i];
  return sum;
}

/// The golden poles have ten digits, of which the system, whose condition is 2e7, leaves three to R and S:
/// those were worked out before the poles were rounded. So: the golden R and S give the golden poles, from
/// what they give they come back in full, and from the rounded poles to those three digits.
TEST(GoldenRst, CoefficientsAtTheGivenPoles) {
  test::for_each_rst_and_lqg([](const auto& c, const Machine& machine) {
    const auto& g = c.at("rst");
    const auto plant = sampled_plant(machine.model());
    const std::vector<double> poles = g.at("poles");
    const FixedParts plain, no_nyquist{{1.0, 1.0}, {1.0, -1.0}};
    for (const auto& [fixed, r, s] :
         {std::tuple(plain, "R", "S"),
          std::tuple(no_nyquist, "R_with_zero_at_nyquist", "S_with_zero_at_nyquist")}) {
      const auto exact = closed_polynomial(plant, g.at(r), g.at(s));
      ASSERT_GE(exact.size(), poles.size());
      for (std::size_t i = 0; i < exact.size(); ++i)
        EXPECT_NEAR(exact[i], i < poles.size() ? poles[i] : 0.0, 2e-8);
      const auto from_exact = place_poles(plant, exact, fixed),
                 from_rounded = place_poles(plant, poles, fixed);
      ASSERT_TRUE(from_exact && from_rounded);
      expect_coefficients(from_exact->r, g.at(r), 1e-6);
      expect_coefficients(from_exact->s, g.at(s), 1e-6);
      expect_coefficients(from_rounded->r, g.at(r), 5e-4);
      expect_coefficients(from_rounded->s, g.at(s), 5e-4);
      const auto placed = closed_polynomial(plant, from_rounded->r, from_rounded->s);
      for (std::size_t i = 0; i < placed.size(); ++i)
        EXPECT_NEAR(placed[i], i < poles.size() ? poles[i] : 0.0, 1e-12);
      EXPECT_LT(from_rounded->residual, 1e-13);
    }
    EXPECT_NEAR(place_poles(plant, poles)->condition / g.at("condition").template get<double>(), 1.0, 1e-3);
  });
}

TEST(GoldenRst, Figures) {
  test::for_each_rst_and_lqg([](const auto& c, const Machine& machine) {
    const auto& g = c.at("rst");
    const auto plant = sampled_plant(machine.model());
    const auto rst = place_poles(plant, closed_polynomial(plant, g.at("R"), g.at("S"))).value();
    const auto f = figures_of(machine, LinearController(rst.controller(machine.sample_time_s())));
    const auto expect = [&](double found, const auto& golden, double room) {
      EXPECT_NEAR(found / golden.template get<double>(), 1.0, room) << golden;
    };
    expect(f.peak(Transfer::sensitivity).value, g.at("sensitivity"), 1e-5);
    expect(f.peak(Transfer::complementary).value, g.at("complementary"), 1e-5);
    expect(f.peak(Transfer::controller_sensitivity).value, g.at("controller_sensitivity"), 1e-5);
    expect(f.peak(Transfer::load_transfer).value, g.at("load_transfer"), 1e-5);
    expect(f.noise_gain, g.at("noise_gain"), 1e-3);
    expect(f.load_step.iae, g.at("load_step").at("iae"), 1e-5);
    expect(f.load_step.ie, g.at("load_step").at("ie"), 1e-5);
    expect(f.load_step.peak, g.at("load_step").at("peak"), 1e-5);
    EXPECT_NEAR(f.load_step.rebound, g.at("load_step").at("rebound").template get<double>(), 1e-5);
    EXPECT_NEAR(f.spectral_radius, g.at("spectral_radius").template get<double>(), 1e-3);
  });
}

TEST(GoldenRst, SearchIsBetterThanTheGoldenOne) {
  test::for_each_rst_and_lqg([](const auto& c, const Machine& machine) {
    Machines machines({machine}, 0.5);
    const auto found = search_rst(machines, test::golden_bounds(c.at("bounds")));
    ASSERT_TRUE(found);
    EXPECT_LT(found->exceeded, 2e-3);
    EXPECT_LT(found->iae, c.at("rst").at("load_step").at("iae").template get<double>());
    const auto f = figures_of(machine, LinearController(found->rst.controller(machine.sample_time_s())));
    EXPECT_TRUE(f.stable);
    EXPECT_NEAR(f.load_step.iae / found->iae, 1.0, 1e-9);
    const Bounds bounds = test::golden_bounds(c.at("bounds"));
    for (const Transfer transfer : kTransfers)
      if (const auto bound = bound_of(bounds, transfer)) {
        EXPECT_LT(f.peak(transfer).value, *bound * (1.0 + 2e-3));
      }
  });
}

/// Every structure, with a fraction of a sample in its delay, torque lag and filter of the measured velocity.
TEST(SampledPlant, HasTheResponseOfTheMachine) {
  for (const auto structure : {fit::Structure::rigid, fit::Structure::two_mass, fit::Structure::three_mass}) {
    fit::DriveModel model;
    model.structure = structure;
    model.sample_time_s = 0.002;
    model.known_delay_s = 0.0047;
    model.torque_lag_s = 0.001;
    model.output_filter_s = 0.0015;
    model.parameters = {0.03, 0.03, 140.0, 0.3, 0.01};
    model.parameters.middle_inertia = 0.01;
    model.parameters.stiffness_2 = 900.0;
    model.parameters.damping_2 = 0.2;
    const Machine machine(model);
    const LinearController plant(sampled_plant(model));
    const std::array<double, 4> frequencies_hz = {1.0, 11.0, 60.0, 200.0};
    const auto found = plant.at(frequencies_hz);
    const auto expected = machine.response().at(frequencies_hz);
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_LT(std::abs(found[i] / expected[i].measured - 1.0), 1e-7) << frequencies_hz[i];
  }
}

TEST(PlacePoles, AnIntegratorUnderAPiIsThePiItself) {
  const auto machine = test::golden_machine({0.02, 0.0}, 0.001, 0.0);  // J and no friction
  const auto plant = sampled_plant(machine.model());
  const auto rst = place_poles(plant, {1.0, -1.8, 0.81});
  ASSERT_TRUE(rst);
  ASSERT_EQ(rst->s.size(), 2U);
  // (1 - z^-1)^2 + b z^-1 (r0 + r1 z^-1), b = Ts/J
  EXPECT_NEAR(rst->r[0], 0.2 / 0.05, 1e-9);
  EXPECT_NEAR(rst->r[1], -0.19 / 0.05, 1e-9);
  EXPECT_NEAR(rst->t(), 0.01 / 0.05, 1e-9);
  EXPECT_FALSE(place_poles(plant, {1.0, 0.1, 0.1, 0.1, 0.1, 0.1}));  // more than R and S can place
}

}  // namespace
}  // namespace resonid::design
