// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <resonid/plant/experiment.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/detail/stepped_sine.hpp>

#include "bench_fixture.hpp"
#include "drive_fixture.hpp"

namespace resonid {
namespace {

const std::vector<double> kLines{2.0, 5.0, 8.0, 11.0, 13.0, 15.0, 17.0, 20.0, 25.0, 31.3};

plant::ExperimentConfig stepped_experiment(const std::vector<double>& lines_hz, double noise,
                                           double measure_periods) {
  plant::ExperimentConfig c;
  c.drive = {plant::Structure::two_mass, data::Motion::rotary, 0.032, 0.032, 5.75e4, 120.0, 0.05, 0.0};
  c.controller.kind = plant::ControllerKind::pi;
  c.controller.gain = 1.036;
  c.controller.integral_time_s = 0.147;
  c.excitation.kind = online::Kind::stepped_sine;
  c.excitation.lines_hz.assign(lines_hz);
  c.excitation.settle_periods = 5.0;
  c.excitation.measure_periods = measure_periods;
  c.measurement = {0.004, noise};
  c.motion = {plant::MotionKind::constant, 10.0};
  c.run = {500.0, 0.0, 1};
  return c;
}

data::Record simulated(const plant::ExperimentConfig& config) {
  return plant::simulate_closed_loop(config).value().record;
}

response::ResponseOptions options(Approach approach = Approach::joint) {
  response::ResponseOptions o;
  o.approach = approach;
  o.delay_s = 0.004;
  if (approach == Approach::indirect) o.controller = data::pi_controller(1.036, 0.147, 0.002);
  return o;
}

TEST(SteppedSine, FindsLinesAndResponseByItself) {
  // Longer dwells leave less of the transient: the error must go down with them.
  const test::BeltDrive drive;
  const struct { double periods, limit; } cases[] = {{10.0, 3e-4}, {60.0, 1e-7}};
  for (const auto& c : cases)
    for (const auto approach : {Approach::direct, Approach::indirect, Approach::joint}) {
      const auto record = simulated(stepped_experiment(kLines, 0.0, c.periods));
      const auto response = response::stepped_sine(record, {}, options(approach));
      ASSERT_TRUE(response) << response.error().requirement;
      ASSERT_EQ(response->lines(), kLines.size());
      EXPECT_TRUE(response->unsettled_hz.empty());
      for (std::size_t i = 0; i < kLines.size(); ++i) {
        EXPECT_NEAR(response->frequency_hz[i], kLines[i], 1e-9);
        EXPECT_LT(std::abs(response->value[i] / drive.response(kLines[i]) - 1.0), c.limit) << kLines[i];
      }
      EXPECT_EQ(response::detect_stepped_sine(record).size(), kLines.size());
    }
}

TEST(SteppedSine, RegionsHoldTheTruthAsOftenAsTheySay) {
  const test::BeltDrive drive;
  const struct {
    bool excitation;
    double periods;
  } cases[] = {{true, 4.0}, {true, 10.0}, {true, 30.0}, {false, 10.0}};
  for (const auto& c : cases) {
    auto config = stepped_experiment(kLines, 0.1, c.periods);
    int inside = 0;
    int all = 0;
    for (config.run.seed = 1; config.run.seed <= 30; ++config.run.seed) {
      auto record = simulated(config);
      if (!c.excitation) record.excitation.samples.clear();  // the dwells must be found in the noisy input
      response::SteppedSineConfig lines;
      lines.lines_hz = kLines;
      const auto response =
          response::stepped_sine(record, lines, options(c.excitation ? Approach::joint : Approach::direct));
      ASSERT_TRUE(response) << response.error().value << " Hz, seed " << config.run.seed;
      for (std::size_t i = 0; i < response->lines(); ++i, ++all)
        inside += std::abs(response->value[i] - drive.response(response->frequency_hz[i])) <
                  data::confidence_radius(response->std[i], 0.95);
    }
    EXPECT_GT(all, 290) << "a percent or so of the dwells looks unsettled by chance";
    EXPECT_NEAR(static_cast<double>(inside) / all, 0.95, 0.04) << c.periods << c.excitation;
  }
}

TEST(SteppedSine, DeviationFallsWithTheTimeSpent) {
  const auto deviation = [&](double periods) {
    auto config = stepped_experiment(kLines, 0.1, periods);
    double sum = 0.0;
    for (config.run.seed = 1; config.run.seed <= 5; ++config.run.seed) {
      const auto response = response::stepped_sine(simulated(config), {}, options()).value();
      for (const double s : response.std) sum += s;
    }
    return sum;
  };
  // Two thirds of 15 and of 95 periods are used: sqrt(6.3) = 2.5.
  EXPECT_NEAR(deviation(10.0) / deviation(90.0), 2.5, 0.4);
}

TEST(SteppedSine, OrderOffsetSilenceAndQuantityDoNotMatter) {
  // Falling frequencies, the operating point 10 rad/s, silence around, and the position as output.
  const std::vector<double> falling(kLines.rbegin(), kLines.rend());
  auto config = stepped_experiment(falling, 0.0, 60.0);
  const test::BeltDrive drive;
  auto record = simulated(config);
  const double speed = 10.0;
  for (std::size_t k = record.samples(); k-- > 0;)
    for (auto* channel : {&record.excitation, &record.input}) channel->samples[k] += 0.3;
  auto response = response::stepped_sine(record, {}, options());
  ASSERT_TRUE(response);
  ASSERT_EQ(response->lines(), kLines.size());
  EXPECT_LT(test::relative_rms(response->frequency_hz, response->value,
                               [&](double f) { return drive.response(f); }),
            1e-8);

  record.output_quantity = data::OutputQuantity::position;
  double angle = 0.0;  // its sum is the position of samples held: Ts z/(z - 1) of y
  for (double& y : record.output.samples) {
    angle += 0.002 * y;
    y = angle;
  }
  response = response::stepped_sine(record, {}, options());
  ASSERT_TRUE(response);
  ASSERT_EQ(response->lines(), kLines.size());
  EXPECT_GT(angle, 0.9 * speed * record.duration_s());
  for (std::size_t i = 0; i < kLines.size(); ++i) {
    // The bilinear velocity factor, times that sum: j (2/Ts) tan(a) Ts/(1 - e^{-2ja}), a = w Ts/2.
    const double a = kPi * kLines[i] * 0.002;
    const auto factor = std::polar(1.0 / std::cos(a), a);
    EXPECT_LT(std::abs(response->value[i] / (factor * drive.response(kLines[i])) - 1.0), 1e-6) << kLines[i];
  }
}

TEST(SteppedSine, NamesALineThatWasNotExcited) {
  const auto record = simulated(stepped_experiment(kLines, 0.01, 10.0));
  response::SteppedSineConfig config;
  config.lines_hz = {5.0, 8.0, 9.0};
  const auto missing = response::stepped_sine_lines(record, config, Approach::joint);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().field, "lines_hz");
  EXPECT_EQ(missing.error().value, 9.0);
  config.lines_hz = {20.0, 5.0};
  const auto some = response::stepped_sine_lines(record, config, Approach::joint);
  ASSERT_TRUE(some);
  ASSERT_EQ(some->lines.size(), 2u);
  EXPECT_EQ(some->lines[0].frequency_hz, 5.0);
  config.lines_hz = {300.0};
  EXPECT_EQ(response::stepped_sine_lines(record, config, Approach::joint).error().value, 300.0);
  config = {};
  config.settling_share = 1.0;
  EXPECT_EQ(response::stepped_sine_lines(record, config, Approach::joint).error().field, "settling_share");
}

TEST(SteppedSine, LeavesOutDwellsThatNeverSettle) {
  // Beside a resonance at 15.1 Hz that rings for seconds, 10 periods are not enough; far below it they are.
  auto config = stepped_experiment({5.0, 14.0}, 0.001, 5.0);
  config.drive.damping = 0.5;
  config.controller.gain = 0.3;
  const test::BeltDrive drive{.parameters = {0.032, 0.032, 5.75e4 * 0.0025, 0.5 * 0.0025, 0.0}};
  const auto response = response::stepped_sine(simulated(config), {}, options());
  ASSERT_TRUE(response);
  ASSERT_EQ(response->frequency_hz, std::vector<double>{5.0});
  EXPECT_EQ(response->unsettled_hz, std::vector<double>{14.0});
  EXPECT_LT(std::abs(response->value[0] / drive.response(5.0) - 1.0), 0.01);
}

TEST(SteppedSine, IsNotFoundInOtherExcitations) {
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  for (int seed = 0; seed < 30; ++seed) {
    data::Record record;
    record.sample_rate_hz = 500.0;
    record.excitation.samples = test::multisine(1000, 4, {3 + seed, 30 + seed, 90});
    record.output.samples.assign(4000, 0.0);
    EXPECT_TRUE(response::detect_stepped_sine(record).empty());
    for (double& x : record.excitation.samples) x = normal(engine);
    EXPECT_TRUE(response::detect_stepped_sine(record).empty());
    for (double& x : record.excitation.samples) x = x > 0.0 ? 1.0 : -1.0;
    EXPECT_TRUE(response::detect_stepped_sine(record).empty());
  }
}

}  // namespace
}  // namespace resonid
