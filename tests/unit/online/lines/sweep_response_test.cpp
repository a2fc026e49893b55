// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <resonid/online/lines/sweep_response.hpp>

#include "sweep_errors.hpp"

namespace resonid::test {
namespace {

using online::SweepQuantity;
using online::SweepResponse;

// Damping ratio 2.5 %, in 5 s. What remains is the prior's at the beginning.
TEST(SweepResponse, HasNoErrorOfItsOwnHoweverFastTheSweep) {
  const auto errors = sweep_errors(belt(5.75e4, 30.0), {.duration_s = 5.0}, 1e-6, 1);
  EXPECT_GT(errors.uncorrected_rms(), 0.15);
  EXPECT_LT(errors.relative_rms(), 0.005);
  EXPECT_GT(errors.values(), 60U);
}

// Seeds 1 ... 6; 30 of them and more machines: make statistics.
TEST(SweepResponse, BarsHoldTheTruth) {
  for (const double damping : {120.0, 30.0}) {
    const auto errors = sweep_errors(belt(5.75e4, damping), {}, kNoise, 6);
    EXPECT_GE(errors.ratio(), 0.8) << damping;
    EXPECT_LE(errors.ratio(), 1.3) << damping;
    EXPECT_LE(errors.worst_band(), 2.5) << damping;
    EXPECT_GT(errors.uncorrected_ratio(), 1.3) << damping;
    EXPECT_LT(errors.relative_rms(), 0.7 * errors.uncorrected_rms()) << damping;
  }
}

TEST(SweepResponse, BarsHoldTheTruthUpwardsAndLogarithmically) {
  const auto up = sweep_errors(system_a(), {.from_hz = 1.5, .to_hz = 35.0}, kNoise, 6);
  EXPECT_GE(up.ratio(), 0.8);
  EXPECT_LE(up.ratio(), 1.3);
  const auto logarithmic = sweep_errors(system_a(), {.sweep = online::Sweep::logarithmic}, kNoise, 6);
  EXPECT_GE(logarithmic.ratio(), 0.8);
  EXPECT_LE(logarithmic.ratio(), 1.3);
}

TEST(SweepResponse, ResonanceHasATrueBar) {
  const auto errors = sweep_errors(system_a(), {}, kNoise, 6);
  EXPECT_GT(errors.resonances(), 6U * 120U);
  EXPECT_GE(errors.resonance_ratio(), 0.3);  // 6 seeds are 6 values, each seen along the sweep
  EXPECT_LE(errors.resonance_ratio(), 2.5);
}

TEST(SweepResponse, NeedsNoDoublePrecision) {
  const auto errors = sweep_errors<float>(system_a(), {}, kNoise, 6);
  EXPECT_GE(errors.ratio(), 0.8);
  EXPECT_LE(errors.ratio(), 1.3);
  EXPECT_GT(errors.resonances(), 6U * 120U);
}

/// The published sweep with a torque beside it, the output made of the velocity by `output`.
template <class Output>
SweepErrors swept(SweepQuantity quantity, double noise, Output&& output) {
  constexpr double kRate = 1.0 / kSampleTime, kTorque = 0.7;
  auto config = Sweeping{}.config();
  config.quantity = quantity;
  const auto pattern = SweepResponse<double>::create(config).value();
  const auto ru = Sweeping{}.excitation();
  auto record = run_loop(system_a(), ru, 0.0, 1);
  for (double& u : record.u) u += kTorque;
  SweepErrors errors;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal(0.0, noise);
    std::vector<double> y;
    double before = 0.0, sum = 3.0;
    for (const double velocity : record.y) {
      y.push_back(output(velocity, before, sum) + normal(generator));
      before = velocity;
    }
    const auto truth = [&](double f) {
      const auto difference = (1.0 - std::polar(1.0, -kTwoPi * f * kSampleTime)) * kRate;
      return true_response(system_a(), f) *
             (quantity == SweepQuantity::position ? 1.0 / difference : difference);
    };
    errors.run(pattern, ru, record.u, y, truth, undamped_resonance_hz(system_a()));
  }
  return errors;
}

TEST(SweepResponse, TakesPositionAndAcceleration) {
  const auto position = swept(SweepQuantity::position, 1e-4,
                              [](double y, double, double& sum) { return sum += y * kSampleTime; });
  const auto acceleration = swept(SweepQuantity::acceleration, 5.0, [](double y, double before, double&) {
    return (y - before) / kSampleTime;
  });
  for (const auto* errors : {&position, &acceleration}) {
    SCOPED_TRACE(errors == &position ? "position" : "acceleration");
    EXPECT_GE(errors->ratio(), 0.8);
    EXPECT_LE(errors->ratio(), 1.3);
    EXPECT_LT(errors->relative_rms(), 0.1);
    EXPECT_GT(errors->resonances(), 6U * 120U);
    EXPECT_LE(errors->resonance_ratio(), 2.5);
  }
}

TEST(SweepResponse, GoesOnAfterMissingSamples) {
  const auto ru = Sweeping{}.excitation();
  const auto record = run_loop(system_a(), ru, kNoise, 3);
  auto whole = SweepResponse<double>::create(Sweeping{}.config()).value();
  auto broken = whole, stepped = whole;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < ru.size(); ++k) {
    whole.step(ru[k], record.u[k], record.y[k]);
    if (k == 4000) broken.miss(40);
    if (k >= 4000 && k < 4040) {
      stepped.step(ru[k], kNone, record.y[k]);
    } else {
      broken.step(ru[k], record.u[k], record.y[k]);
      stepped.step(ru[k], record.u[k], record.y[k]);
    }
    if (k == 4100) {
      EXPECT_FALSE(broken.settled());
    }
  }
  EXPECT_EQ(broken.samples(), whole.samples());
  EXPECT_EQ(broken.skipped_samples(), 40U);
  EXPECT_EQ(stepped.skipped_samples(), 40U);
  const auto truth = true_response(system_a(), broken.described_hz());
  for (const auto* tracker : {&broken, &stepped}) {
    EXPECT_LT(std::abs(tracker->response() - truth), 4.0 * tracker->standard_deviation());
    EXPECT_NEAR(tracker->resonance().frequency_hz, whole.resonance().frequency_hz,
                4.0 * whole.resonance().std_hz);
  }
}

TEST(SweepResponse, ResetBeginsAnew) {
  const auto ru = Sweeping{.duration_s = 5.0}.excitation();
  const auto record = run_loop(system_a(), ru, kNoise, 1);
  auto tracker = SweepResponse<double>::create(Sweeping{.duration_s = 5.0}.config()).value();
  EXPECT_FALSE(tracker.settled());
  EXPECT_TRUE(std::isnan(tracker.response().real()));
  EXPECT_TRUE(std::isinf(tracker.standard_deviation()));
  const auto run = [&] {
    for (std::size_t k = 0; k < ru.size(); ++k) tracker.step(ru[k], record.u[k], record.y[k]);
    return tracker;
  };
  const auto first = run();
  EXPECT_TRUE(first.intact());
  tracker.reset();
  EXPECT_FALSE(tracker.settled());
  const auto second = run();
  EXPECT_EQ(first.response(), second.response());
  EXPECT_EQ(first.standard_deviation(), second.standard_deviation());
  EXPECT_EQ(first.resonance().frequency_hz, second.resonance().frequency_hz);
}

TEST(SweepResponse, RefusesWhatItCannotDo) {
  auto config = Sweeping{}.config();
  config.known_delay_s = 0.2;
  EXPECT_EQ(SweepResponse<double>::create(config).error().field, "known_delay_s");
  config = Sweeping{}.config();
  config.chirp.to_hz = 300.0;
  EXPECT_EQ(SweepResponse<double>::create(config).error().field, "to_hz");
}

}  // namespace
}  // namespace resonid::test
