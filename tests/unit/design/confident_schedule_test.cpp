// SPDX-License-Identifier: MIT
// Gains over position that keep their bounds with a stated probability wherever the position stands: counted
// again by other draws, between the positions that were looked at, on a plain grid of frequencies.
#include "design/confident_schedule.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <random>
#include <resonid/base/constants.hpp>

#include "design/largest_gain.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

using test::tooth_belt_at;
constexpr Stroke kBelt = test::kBeltStroke;
/// Inertias and stiffness known to 2 %, the delay to 0.1 ms.
constexpr std::array kUncertain = {fit::kDrivenInertia, fit::kLoadInertia, fit::kStiffness, fit::kDamping,
                                   fit::kDelay};
constexpr std::array kStd = {0.02, 0.02, 0.02, 0.2, 1e-4};

Posterior posterior_of(const fit::DriveModel& model) {
  Eigen::VectorXd variances(kStd.size());
  for (std::size_t i = 0; i < kStd.size(); ++i) variances(static_cast<Eigen::Index>(i)) = kStd[i] * kStd[i];
  return {model, {kUncertain.begin(), kUncertain.end()}, variances.asDiagonal()};
}

/// Another machine of the same error bars, by numbers of the standard library.
fit::DriveModel another(const fit::DriveModel& nominal, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  fit::DriveModel model = nominal;
  for (std::size_t i = 0; i < kStd.size(); ++i) {
    const double by = kStd[i] * normal(random), from = nominal.value(kUncertain[i]);
    model.set(kUncertain[i], kUncertain[i] == fit::kDelay ? from + by : from * std::exp(by));
  }
  return model;
}

/// Whether |S| or |T_load| exceeds its bound on a plain grid, the loop by its definition.
bool exceeds(const fit::DriveModel& model, const FilteredPi& pi, const Bounds& bounds) {
  const fit::SampledResponse plant(model);
  const double step = model.sample_time_s;
  constexpr std::size_t kLines = 500;
  std::vector<double> lines_hz;
  for (std::size_t i = 0; i < kLines; ++i)
    lines_hz.push_back(0.5 * std::pow(0.4 / step / 0.5, static_cast<double>(i) / (kLines - 1.0)));
  const auto values = plant.at(lines_hz);
  for (std::size_t i = 0; i < kLines; ++i) {
    const double frequency_hz = lines_hz[i];
    const auto& value = values[i];
    const auto z = std::polar(1.0, kTwoPi * frequency_hz * step);
    const auto c = pi.kp + pi.ki * step * z / (z - 1.0);
    const auto sensitivity = 1.0 / (1.0 + c * value.measured);
    if (std::abs(sensitivity) > *bounds.sensitivity ||
        std::abs(c * value.load * sensitivity) > *bounds.load_transfer)
      return true;
  }
  return false;
}

double share_that_exceeds(const fit::DriveModel& nominal, const FilteredPi& pi, const Bounds& bounds) {
  std::mt19937_64 random(20);
  constexpr int kMachines = 2000;
  int count = 0;
  for (int i = 0; i < kMachines; ++i) count += exceeds(another(nominal, random), pi, bounds) ? 1 : 0;
  return count / static_cast<double>(kMachines);
}

ConfidentScheduleOptions calm() {
  ConfidentScheduleOptions options;
  options.bounds.sensitivity = 1.4;
  options.bounds.load_transfer = 1.3;
  options.confidence.draws = 2000;
  options.count = 13;
  return options;
}

TEST(ConfidentSchedule, KeepsItsConfidenceAtEveryPosition) {
  const auto options = calm();
  const PosteriorAt posterior_at = [](double position) { return posterior_of(tooth_belt_at(position)); };
  const auto design = confident_schedule(posterior_at, kBelt, options);
  ASSERT_TRUE(design) << design.error().requirement;
  ASSERT_EQ(design->checks.size(), options.count);
  for (const FrozenCheck& here : design->checks) {
    EXPECT_LE(here.check.probability(), 0.05) << here.position;
    EXPECT_EQ(here.check.unstable, 0U);
  }
  EXPECT_GT(design->worst().check.probability(), 0.025);  // not by being slack
  // By other machines, half of the positions between those that were looked at. 5 % of 2000: +-1.5 %.
  for (const double position : {0.38, 0.43, 0.6, 0.75, 0.9, 1.33, 1.65}) {
    const double share =
        share_that_exceeds(tooth_belt_at(position), design->schedule.at(position), options.bounds);
    EXPECT_LT(share, 0.065) << position;
    EXPECT_GT(share, 0.005) << position;
  }
}

/// A load whose inertia grows twelvefold: what suits its beginning does not suit its end.
fit::DriveModel loaded(double position) {
  fit::DriveModel model = tooth_belt_at(1.0);
  model.parameters.load_inertia *= std::pow(12.0, position);
  return model;
}

TEST(ConfidentSchedule, FollowsALoadThatGrows) {
  auto options = calm();
  options.bounds.sensitivity = 1.25;
  options.bounds.load_transfer = 1.05;
  const Stroke stroke{0.0, 1.0};
  const PosteriorAt posterior_at = [](double position) { return posterior_of(loaded(position)); };
  const auto design = confident_schedule(posterior_at, stroke, options);
  ASSERT_TRUE(design) << design.error().requirement;
  EXPECT_LE(design->worst().check.probability(), 0.05);
  EXPECT_LT(share_that_exceeds(loaded(0.29), design->schedule.at(0.29), options.bounds), 0.065);
  EXPECT_GT(share_that_exceeds(loaded(1.0), design->schedule.at(0.0), options.bounds), 0.9);
  options.bounds.sensitivity = 1.0001;
  EXPECT_EQ(confident_schedule(posterior_at, stroke, options).error().field, "bounds");
}

TEST(ConfidentSchedule, KeepsTheWholeEllipsoid) {
  auto options = calm();
  options.confidence.guarantee = Guarantee::ellipsoid;
  options.count = 9;
  const PosteriorAt posterior_at = [](double position) { return posterior_of(tooth_belt_at(position)); };
  const auto design = confident_schedule(posterior_at, kBelt, options);
  ASSERT_TRUE(design) << design.error().requirement;
  for (const FrozenCheck& here : design->checks) {
    EXPECT_NEAR(here.radius, 3.327, 0.001);  // chi-square with five degrees of freedom
    for (const WorstCase& worst : here.worst) EXPECT_LE(worst.peak.value, 1.003 * worst.peak.bound);
  }
}

TEST(ConfidentSchedule, LimitsTheNoiseEverywhere) {
  auto options = calm();
  const PosteriorAt posterior_at = [](double position) { return posterior_of(tooth_belt_at(position)); };
  const auto loud = confident_schedule(posterior_at, kBelt, options);
  ASSERT_TRUE(loud);
  // White noise of variance 1 through a PI is more than that through its proportional part by little.
  options.most_noise_gain = 0.7 * loud->schedule.at(1.0).kp;
  const auto quiet = confident_schedule(posterior_at, kBelt, options);
  ASSERT_TRUE(quiet) << quiet.error().requirement;
  for (const FrozenCheck& here : quiet->checks) {
    EXPECT_LE(here.noise_gain, *options.most_noise_gain);
    EXPECT_LT(quiet->schedule.at(here.position).kp, *options.most_noise_gain);
    EXPECT_LE(here.check.probability(), 0.05);
  }
}

TEST(ConfidentSchedule, TellsHowQuicklyThePositionMayMove) {
  const MachineAt same = [](double) { return tooth_belt_at(1.0); };
  const Stroke stroke{0.0, 1.0};
  Machines one({Machine(tooth_belt_at(1.0))});
  const auto gains = largest_integral_gain(one, {}, calm().bounds);
  ASSERT_TRUE(gains);
  // One machine and one controller everywhere: motion does nothing at all.
  const GainSchedule level({{0.0, gains->kp, gains->ki}});
  const auto moving = run_through(same, level, stroke, 3.0), resting = run_at_rest(same, level, stroke, 3.0);
  EXPECT_NEAR(moving.iae / resting.iae, 1.0, 1e-9);
  EXPECT_NEAR(moving.peak / resting.peak, 1.0, 1e-9);
  EXPECT_EQ(largest_speed_of(same, level, stroke, 4.0), 4.0);
  // Stiff where the torque changes, ten times softer on the way to the next change: a slow run is over the
  // change before it comes there, a fast one is not.
  std::vector<ScheduleNode> nodes;
  for (int i = 0; i < 8; ++i)
    for (const auto& [way, times] : {std::pair{0.0, 1.0}, {0.4, 1.0}, {0.45, 0.1}, {0.9, 0.1}})
      nodes.push_back({(i + way) / 8.0, times * gains->kp, times * gains->ki});
  nodes.push_back({1.0, gains->kp, gains->ki});
  const GainSchedule dipping(nodes);
  const double speed = largest_speed_of(same, dipping, stroke, 20.0);
  EXPECT_GT(speed, 0.25);
  EXPECT_LT(speed, 10.0);
  const auto fast = run_through(same, dipping, stroke, 1.1 * speed),
             rest = run_at_rest(same, dipping, stroke, 1.1 * speed);
  EXPECT_TRUE(fast.iae > 1.1 * rest.iae || fast.peak > 1.1 * rest.peak);
}

/// Standard deviation of the logarithm of the stiffness, by draws.
double stiffness_std(const Posterior& posterior) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  double squares = 0.0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    Eigen::VectorXd u(posterior.dimension());
    for (auto& x : u) x = normal(random);
    squares += std::pow(
        std::log(posterior.at(u).parameters.stiffness / posterior.nominal().parameters.stiffness), 2);
  }
  return std::sqrt(squares / kDraws);
}

TEST(Posterior, IsBlendedBetweenTwo) {
  const auto a = posterior_of(tooth_belt_at(0.5));
  const auto none = a.scaled(0.0, 0.0);
  // A quarter of the variance is half of every deviation.
  const auto quarter = none.blended(a, 0.25);
  EXPECT_EQ(quarter.dimension(), a.dimension());
  EXPECT_NEAR(stiffness_std(quarter), 0.01, 3e-4);
}

TEST(Schedule, TellsUpToWhichSpeedFrozenLoopsSpeakOfMotion) {
  // A rigid drive without delay under a PI: its slowest pole by hand.
  fit::DriveModel rigid;
  rigid.structure = fit::Structure::rigid;
  rigid.sample_time_s = 0.001;
  rigid.parameters.driven_inertia = 0.01;
  const auto settling = [&](double kp, double ki) {
    // By torque held for a sample: z^2 - (2 - b (kp + ki Ts)) z + 1 - b kp, b = Ts / J.
    const double b = 0.001 / 0.01;
    const std::complex<double> half = 0.5 * (2.0 - b * (kp + 0.001 * ki)),
                               root = std::sqrt(half * half - (1.0 - b * kp));
    const double radius = std::max(std::abs(half + root), std::abs(half - root));
    return std::log(50.0) * 0.001 / -std::log(radius);
  };
  const Stroke stroke{0.0, 2.0};
  const auto same = [&](double) { return rigid; };
  const GainSchedule level({{0.0, 0.5, 2.0}});
  EXPECT_NEAR(slow_speed_of(same, level, stroke), 2.0 / (5.0 * settling(0.5, 2.0)),
              0.01 * slow_speed_of(same, level, stroke));
  // Gains that grow by e: a tenth of that within a settling time.
  const GainSchedule growing({{0.0, 0.5, 2.0}, {2.0, 0.5 * std::exp(1.0), 2.0 * std::exp(1.0)}});
  const double steepest = (std::exp(1.0) - 1.0) / 2.0;
  const double speed = slow_speed_of(same, growing, stroke);
  EXPECT_LT(speed, 2.0 / (5.0 * settling(0.5, 2.0)));
  EXPECT_NEAR(speed, 0.1 / (steepest * settling(0.5, 2.0)), 0.05 * speed);
  // The machine changes as well as its gains.
  const auto heavier = [&](double position) {
    auto model = rigid;
    model.parameters.driven_inertia *= std::exp(position);
    return model;
  };
  EXPECT_LT(slow_speed_of(heavier, level, stroke), 0.5 * slow_speed_of(same, level, stroke));
  EXPECT_EQ(slow_speed_of(same, GainSchedule({{0.0, 50.0, 2.0}}), stroke), 0.0);  // unstable
}

TEST(Posterior, DoubtsTheCourseBetweenTwoPositions) {
  const auto stiffness = [](double position) { return tooth_belt_at(position).parameters.stiffness; };
  for (const double from : {0.4, 0.7, 1.0})
    for (const double to : {1.25 * from, 1.6 * from}) {
      // Known exactly at both ends: what is open in between is the course alone.
      const auto a = posterior_of(tooth_belt_at(from)).scaled(0.0, 0.0),
                 b = posterior_of(tooth_belt_at(to)).scaled(0.0, 0.0);
      const double change = std::log(stiffness(to) / stiffness(from));
      for (const double share : {0.25, 0.5, 0.75}) {
        const double straight = std::log(stiffness(from)) + share * change;
        const double off = std::log(stiffness(from + share * (to - from))) - straight;
        const double std = stiffness_std(a.between(b, share));
        EXPECT_NEAR(std, 0.5 * std::abs(change) * share * (1.0 - share), 0.02 * std) << from;
        EXPECT_LT(std::abs(off), 2.0 * std) << from << " to " << to;
        EXPECT_GT(std::abs(off), 0.0);
      }
      EXPECT_TRUE(a.between(b, 0.0).is_exact());
      EXPECT_TRUE(a.between(b, 1.0).is_exact());
    }
  // Beside what the results themselves leave open.
  const auto a = posterior_of(tooth_belt_at(0.5)), b = posterior_of(tooth_belt_at(0.6));
  const double change = std::log(stiffness(0.6) / stiffness(0.5));
  EXPECT_NEAR(stiffness_std(a.between(b, 0.5)), std::hypot(0.02, change / 8.0), 4e-4);
}

}  // namespace
}  // namespace resonid::design
