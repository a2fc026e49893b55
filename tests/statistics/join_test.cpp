// SPDX-License-Identifier: MIT
// Whether joined records that say little alone are estimated at the Cramer-Rao bound of all together, with
// error bars that are right: system 2 of Nevaranta 2016, Publication VI, noise 0.1 rad/s, 40 seeds.
#include <gtest/gtest.h>

#include <algorithm>
#include <joined_records.hpp>

namespace resonid {
namespace {

constexpr int kSeeds = 40;
constexpr int kParameters = 4;

struct Outcome {
  int two_masses = 0;  ///< Joint estimates of the right structure.
  int alone = 0;       ///< Records that show it by themselves.
  int alarms = 0;      ///< Seeds with a record that is said to disagree.
  double squares = 0.0;
  Eigen::Array4d bars = Eigen::Array4d::Zero();    ///< Sum of stated standard deviations over the bound.
  Eigen::Array4d errors = Eigen::Array4d::Zero();  ///< Sum of squared errors over the bound's variance.
  Eigen::Array4d best = Eigen::Array4d::Constant(1e300);  ///< Smallest bound of one record over that of all.
};

template <class Records>
Outcome outcome(Records&& records) {
  Outcome sum;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    test::JoinedRecords bench = records(seed);
    const auto joint = bench.joined();
    for (const auto& r : bench.results)
      if (r.model && r.model->drive.structure == fit::Structure::two_mass) ++sum.alone;
    if (std::any_of(joint.records.begin(), joint.records.end(), [](const auto& r) { return !r.agrees; }))
      ++sum.alarms;
    if (!joint.result.model || joint.result.model->drive.structure != fit::Structure::two_mass) continue;
    ++sum.two_masses;
    const auto& model = joint.result.model->drive;
    const auto& truth = bench.experiments.front();
    const Eigen::Array4d bound = bench.bound().diagonal().array();
    sum.squares += test::normalised_error(model, truth);
    sum.bars += (test::logarithmic_covariance(model).diagonal().array() / bound).sqrt();
    sum.errors += test::logarithmic_error(model, truth).array().square() / bound;
    for (std::size_t i = 0; i < bench.records.size(); ++i)
      sum.best = sum.best.min((bench.bound_of(i).diagonal().array() / bound).sqrt());
  }
  return sum;
}

void tell(const Outcome& o) {
  const auto property = [](const std::string& name, double value) {
    testing::Test::RecordProperty(name, std::to_string(value));
  };
  property("records that show two masses alone", o.alone);
  property("seeds with an alarm", o.alarms);
  property("mean normalised error squared", o.squares / o.two_masses);
  for (int i = 0; i < kParameters; ++i) {
    const std::string name = test::kFigureNames[static_cast<std::size_t>(i)];
    property(name + ", bar over bound", o.bars(i) / o.two_masses);
    property(name + ", rmse over bound", std::sqrt(o.errors(i) / o.two_masses));
    property(name + ", best record's bound over that of all", o.best(i));
  }
}

void expect_at_the_bound(const Outcome& o) {
  tell(o);
  EXPECT_EQ(o.two_masses, kSeeds);
  // Mean of 40 chi-squares of four degrees of freedom: 4 +- 3 sqrt(2*4/40).
  EXPECT_NEAR(o.squares / o.two_masses, 4.0, 3.0 * std::sqrt(8.0 / kSeeds));
  for (int i = 0; i < kParameters; ++i)
    EXPECT_NEAR(o.bars(i) / o.two_masses, 1.0, 0.1) << test::kFigureNames[static_cast<std::size_t>(i)];
  // An alarm in 5 % of the seeds: binomial(40, 0.05) exceeds 6 with a probability of 0.3 %.
  EXPECT_LE(o.alarms, 6);
}

TEST(JoinedRecords, NarrowBandsReachTheBoundTogether) {
  const auto o = outcome([](std::uint64_t seed) { return test::narrow_bands(seed); });
  expect_at_the_bound(o);
  EXPECT_LT(o.alone, 2 * kSeeds);
  for (int i = 0; i < kParameters; ++i)
    EXPECT_GT(o.best(i), 2.5) << test::kFigureNames[static_cast<std::size_t>(i)];
}

TEST(JoinedRecords, HalvesOfASecondReachTheBoundTogether) {
  const auto o = outcome([](std::uint64_t seed) { return test::short_records(seed); });
  expect_at_the_bound(o);
}

}  // namespace
}  // namespace resonid
