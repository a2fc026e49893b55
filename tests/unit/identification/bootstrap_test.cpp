// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <resonid/identification/compare.hpp>
#include <resonid/identification/detail/figures.hpp>
#include <set>

#include "experiments.hpp"

namespace resonid::identification {
namespace {

/// A PRBS on the published drive, so long and at such noise.
plant::ExperimentConfig experiment(double duration_s, double noise, std::uint64_t seed = 1) {
  auto c = test::published_drive(noise, 10.0, seed);
  test::prbs(c);
  c.run.duration_s = duration_s;
  return c;
}

Result bootstrapped(const plant::ExperimentConfig& c, std::size_t replicas, std::size_t jobs = 2) {
  auto options = test::known(c);
  options.model = ModelChoice::two_mass;
  options.bootstrap = replicas;
  options.jobs = jobs;
  auto result = identify(test::simulated(c).record, options);
  if (!result) throw std::runtime_error(result.error().requirement.str());
  return std::move(*result);
}

const BootstrapInterval& interval(const Result& result, const std::string& name) {
  for (const auto& i : result.bootstrap->intervals)
    if (i.name == name) return i;
  throw std::runtime_error("no interval of " + name);
}

TEST(Bootstrap, AgreesWithTheCovarianceWhereTheProblemIsNearlyLinear) {
  const auto result = bootstrapped(experiment(10.0, 0.05), 120);
  ASSERT_TRUE(result.bootstrap);
  EXPECT_EQ(result.bootstrap->replicas + result.bootstrap->failed, 120U);
  EXPECT_LE(result.bootstrap->failed, 2U);
  const auto told = figures(result);
  std::set<std::string> compared;
  for (const auto& i : result.bootstrap->intervals) {
    const auto* figure = find(told, i.name);
    ASSERT_NE(figure, nullptr) << i.name;
    if (!figure->std) continue;
    compared.insert(i.name);
    // 120 replicas tell a standard deviation to 6.5 %; 3.5 of that.
    EXPECT_NEAR(i.std / *figure->std, 1.0, 0.23) << i.name;
    EXPECT_NEAR(0.5 * (i.low + i.high), figure->value, 1.0 * *figure->std) << i.name;
    EXPECT_NEAR((i.high - i.low) / (2.0 * 1.96 * *figure->std), 1.0, 0.35) << i.name;
  }
  for (const char* name : {"antiresonance_hz", "resonance_hz", "antiresonance_damping_ratio",
                           "resonance_damping_ratio", "driven_inertia", "load_inertia", "stiffness",
                           "damping", "crossover_hz", "phase_margin_deg", "modulus_margin", "gain_margin_db"})
    EXPECT_TRUE(compared.count(name)) << name;
}

/// What v-gap noise alone makes: pairs of experiments on one machine are the truth.
TEST(Bootstrap, ForetellsTheGapThatNoiseMakes) {
  const auto first = bootstrapped(experiment(3.0, 0.1, 1), 100),
             second = bootstrapped(experiment(3.0, 0.1, 2), 100);
  CompareOptions options;
  options.weight = test::known(experiment(3.0, 0.1)).controller;
  const auto changes = compare(first, second, options).value();
  ASSERT_TRUE(changes.model_gap_bootstrap);
  const auto& told = *changes.model_gap_bootstrap;
  EXPECT_GE(told.pairs, 95U);
  std::vector<data::TransferFunction> loops;
  constexpr int kSeeds = 60;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    fit::OutputErrorConfig config;
    config.initial = first.model->drive;
    config.known_delay_s = first.known_delay_s;
    const auto record = test::simulated(experiment(3.0, 0.1, static_cast<std::uint64_t>(10 + seed))).record;
    const auto repeated = fit::fit_output_error(record, config);
    ASSERT_TRUE(repeated && repeated->converged);
    loops.push_back(diagnostics::weighted(*options.weight, repeated->model.transfer_function()));
  }
  std::vector<double> gaps;
  for (std::size_t i = 0; i + 1 < loops.size(); i += 2)
    gaps.push_back(diagnostics::nu_gap(loops[i], loops[i + 1]).value().gap);
  const auto above = std::count_if(gaps.begin(), gaps.end(), [&](double g) { return g > told.noise; });
  EXPECT_LE(above, 5);  // 1.5 of 30 expected
  // The median of a distance that noise makes lies at about half of what 95 % stay below.
  std::nth_element(gaps.begin(), gaps.begin() + 15, gaps.end());
  EXPECT_GT(gaps[15], 0.3 * told.noise);
  EXPECT_LT(gaps[15], 0.9 * told.noise);
}

/// Repetitions of the experiment itself are the truth that the bootstrap imitates.
TEST(Bootstrap, ForetellsTheScatterOfRepeatedExperiments) {
  const auto result = bootstrapped(experiment(3.0, 0.1), 60);
  std::vector<double> stiffness;
  constexpr int kSeeds = 30;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    fit::OutputErrorConfig config;
    config.initial = result.model->drive;
    config.known_delay_s = result.known_delay_s;
    const auto record = test::simulated(experiment(3.0, 0.1, static_cast<std::uint64_t>(seed))).record;
    const auto repeated = fit::fit_output_error(record, config);
    ASSERT_TRUE(repeated && repeated->converged);
    stiffness.push_back(repeated->model.parameters.stiffness);
  }
  double mean = 0.0, sum = 0.0;
  for (const double k : stiffness) mean += k / kSeeds;
  for (const double k : stiffness) sum += (k - mean) * (k - mean);
  const double scatter = std::sqrt(sum / (kSeeds - 1));
  // 30 seeds and 60 replicas: 16 % of standard deviation; 3 of that.
  EXPECT_NEAR(interval(result, "stiffness").std / scatter, 1.0, 0.5);
}

TEST(Bootstrap, LeavesTheCovarianceWhereTheRecordIsShortAndNoisy) {
  const auto result = bootstrapped(experiment(1.0, 0.5, 3), 120);
  ASSERT_TRUE(result.bootstrap);
  double largest = 0.0;
  for (const auto& figure : figures(result)) {
    if (!figure.std) continue;
    for (const auto& i : result.bootstrap->intervals)
      if (i.name == figure.name)
        largest = std::max(largest, std::abs((i.high - i.low) / (2.0 * 1.96 * *figure.std) - 1.0));
  }
  EXPECT_GT(largest, 0.4);
}

TEST(Bootstrap, DoesNotDependOnTheNumberOfThreads) {
  const auto one = bootstrapped(experiment(2.0, 0.1), 20, 1);
  const auto two = bootstrapped(experiment(2.0, 0.1), 20, 3);
  ASSERT_EQ(one.bootstrap->intervals.size(), two.bootstrap->intervals.size());
  for (std::size_t i = 0; i < one.bootstrap->intervals.size(); ++i) {
    EXPECT_EQ(one.bootstrap->intervals[i].low, two.bootstrap->intervals[i].low);
    EXPECT_EQ(one.bootstrap->intervals[i].high, two.bootstrap->intervals[i].high);
  }
}

TEST(Bootstrap, DependsOnTheSeed) {
  const auto c = experiment(2.0, 0.1);
  auto options = test::known(c);
  options.bootstrap = 20;
  const auto record = test::simulated(c).record;
  const auto one = identify(record, options);
  options.seed = 2;
  const auto two = identify(record, options);
  ASSERT_TRUE(one && two && one->bootstrap && two->bootstrap);
  EXPECT_NE(interval(*one, "stiffness").low, interval(*two, "stiffness").low);
}

}  // namespace
}  // namespace resonid::identification
