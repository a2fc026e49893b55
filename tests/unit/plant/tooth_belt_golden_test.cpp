// SPDX-License-Identifier: MIT
//
// The golden records of a moving tooth belt were made with the cart's position prescribed: rest at 0.38 m,
// then a constant velocity without any acceleration in between, the stiffness of a sample that at its start,
// and signals that are deviations from this motion. Here the cart is a state. What comes closest is a machine
// that has always moved at that velocity and passes 0.38 m when the golden one starts; the two agree as soon
// as the difference of the beginnings has died away, but for the excitation's own small way of the cart and
// the stiffness half a sample later.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <golden.hpp>

#include "machines.hpp"

namespace resonid::plant {
namespace {

using resonid::test::golden_column;
using test::LoopConfig;

/// C (1 + 5/s Ts z/(z-1)) of a PI with 0.12 and 0.2 s, on the velocity (tests/golden/README.md).
ControllerConfig golden_controller(double step_s) {
  const double a = 1.0 + step_s / 0.2;
  const double b = 1.0 + 5.0 * step_s;
  ControllerConfig c;
  c.kind = ControllerKind::transfer_function;
  c.numerator = {0.12 * a * b, -0.12 * (a + b), 0.12};
  c.denominator = {1.0, -2.0, 1.0};
  return c;
}

LoopConfig belt(double step_s, double velocity, double from) {
  LoopConfig c;
  c.machine.drive = test::tooth_belt();
  c.controller = golden_controller(step_s);
  c.sample_rate_hz = 1.0 / step_s;
  c.delay_s = step_s;
  c.motion.kind = velocity == 0.0 ? MotionKind::standstill : MotionKind::constant;
  c.motion.velocity = velocity;
  c.motion.from = from;
  return c;
}

/// Root mean square and greatest of a difference, over the rms and the greatest of the golden signal.
struct Agreement {
  double rms, peak;
};
Agreement agreement(const std::vector<double>& got, const std::vector<double>& golden, std::size_t from,
                    std::size_t to) {
  double error = 0.0, power = 0.0, worst = 0.0, largest = 0.0;
  for (std::size_t k = from; k < to; ++k) {
    error += std::pow(got[k] - golden[k], 2);
    power += std::pow(golden[k], 2);
    worst = std::max(worst, std::abs(got[k] - golden[k]));
    largest = std::max(largest, std::abs(golden[k]));
  }
  return {std::sqrt(error / power), worst / largest};
}

struct Signals {
  std::vector<double> x, u, y;
};
/// Deviations from the motion.
Signals run(const LoopConfig& config, const std::vector<double>& ru, std::size_t samples) {
  auto loop = test::make_loop(config);
  Signals result;
  for (std::size_t k = 0; k < samples; ++k) {
    const auto s = loop.step(ru[k], 0.0);
    result.x.push_back(s.place);
    result.u.push_back(s.input);
    result.y.push_back(s.output - s.reference);
  }
  return result;
}

/// Largest way of the cart by the excitation in a golden record: that of the pulley, the integral of y, less
/// the belt's stretch, in balance with the torque that the pulley's inertia leaves. `error`: a share of the
/// stretch, for the damping (1/10 at the resonance, of the belt's quality of 10).
struct Way {
  double largest, error;
};
Way way(const std::vector<double>& u, const std::vector<double>& y, std::size_t samples, double step_s) {
  const DriveConfig c = test::tooth_belt();
  const double stiffness = c.radius_m * c.radius_m * tooth_belt_stiffness(c, 0.38);
  double angle = 0.0, largest = 0.0, stretch = 0.0;
  for (std::size_t k = 0; k + 1 < samples; ++k) {
    const double twist = (u[k] - c.driven_inertia * (y[k + 1] - y[k]) / step_s) / stiffness;
    angle += 0.5 * step_s * (y[k] + y[k + 1]);
    largest = std::max(largest, c.radius_m * std::abs(angle - twist));
    stretch = std::max(stretch, c.radius_m * std::abs(twist));
  }
  return {largest, 0.1 * stretch};
}

constexpr std::size_t kRest = 1000;  // samples of d_tooth.csv

// The excitation moves the cart by up to 0.5 mm: 0.13 % of the stiffness at 0.38 m.
TEST(ToothBeltGolden, AtRest) {
  const auto ru = golden_column("d_tooth.csv", "ru");
  const Signals r = run(belt(0.0005, 0.0, 0.38), ru, kRest);
  const auto u = agreement(r.u, golden_column("d_tooth.csv", "u_clean"), 0, kRest);
  const auto y = agreement(r.y, golden_column("d_tooth.csv", "y_clean"), 0, kRest);
  EXPECT_LT(u.rms, 3e-4);
  EXPECT_LT(u.peak, 5e-4);
  EXPECT_LT(y.rms, 2e-3);
  EXPECT_LT(y.peak, 2e-3);
  const auto [low, high] = std::minmax_element(r.x.begin(), r.x.end());
  const Way golden =
      way(golden_column("d_tooth.csv", "u_clean"), golden_column("d_tooth.csv", "y_clean"), kRest, 0.0005);
  EXPECT_GT(golden.largest, 10.0 * golden.error);
  EXPECT_NEAR(std::max(0.38 - *low, *high - 0.38), golden.largest, golden.error);
}

TEST(ToothBeltGolden, Moving) {
  const auto x = golden_column("d_tooth.csv", "x");
  const auto ru = golden_column("d_tooth.csv", "ru");
  const Signals r = run(belt(0.0005, 0.38, 0.38 - kRest * 0.0005 * 0.38), ru, x.size());
  const std::size_t from = kRest + 200;  // 0.1 s after it has begun to move
  const auto u = agreement(r.u, golden_column("d_tooth.csv", "u_clean"), from, x.size());
  const auto y = agreement(r.y, golden_column("d_tooth.csv", "y_clean"), from, x.size());
  EXPECT_LT(u.rms, 1e-4);
  EXPECT_LT(u.peak, 2e-4);
  EXPECT_LT(y.rms, 5e-4);
  EXPECT_LT(y.peak, 7e-4);
  for (std::size_t k = kRest; k < x.size(); ++k) ASSERT_NEAR(r.x[k], x[k], 3e-4) << k;
}

// The golden record has noise and no clean columns. Its input, replayed through the machine with the
// stiffness of the golden cart's place, must leave nothing of its output but that noise: 0.1 rad/s, within
// four standard deviations of the estimate, and white. Replayed through the machine whose cart is a state,
// the cart must go the golden way and the excitation's own on top: to what the belt stretches (twice the
// static stretch under the largest torque) and what another stiffness on the own way makes of that way.
TEST(ToothBeltGolden, NoisyRecordUnderPrbs) {
  constexpr double kStep = 0.004;
  constexpr std::size_t kStart = 250;  // of the motion
  const auto x = golden_column("e_tooth.csv", "x");
  const auto ru = golden_column("e_tooth.csv", "ru");
  const auto u = golden_column("e_tooth.csv", "u");
  const auto y = golden_column("e_tooth.csv", "y");
  const DriveConfig c = test::tooth_belt();
  const auto stiffness = [&](double place) { return tooth_belt_stiffness(c, place); };
  auto controller = Controller::create(golden_controller(kStep), 1.0 / kStep).value();
  const auto machine = make_drive({c, {}, {}, 0.0}, 1.0 / kStep, 0.0).value();
  EXPECT_NEAR(machine->settle(0.06 / 0.0199, 0.38 - kStart * kStep * 0.06), 0.0, 1e-12);
  Eigen::VectorXd state = Eigen::VectorXd::Zero(4);
  std::vector<double> noise, own_way, difference;
  double before = 0.0, torque = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double command = controller.command({}, {0.0, y[k]});
    ASSERT_NEAR(command + ru[k], u[k], 2e-8) << k;  // y holds nine digits
    controller.commit(command);
    noise.push_back(y[k] - before);
    torque = std::max(torque, std::abs(u[k]));
    if (k >= kStart) {
      own_way.push_back(c.radius_m * state(3));
      difference.push_back(machine->place() - x[k] - own_way.back());
    }
    const SampledDrive step = machine->sampled(stiffness(x[k]) / stiffness(c.stroke_from_m));
    before = step.velocity * state;
    state = step.a * state + step.b * u[k];
    machine->advance(u[k]);
  }
  const auto n = static_cast<double>(noise.size());
  double square = 0.0, neighbours = 0.0;
  for (std::size_t k = 0; k < noise.size(); ++k) {
    square += noise[k] * noise[k];
    if (k > 0) neighbours += noise[k] * noise[k - 1];
  }
  EXPECT_NEAR(std::sqrt(square / n), 0.1, 4.0 * 0.1 / std::sqrt(2.0 * n));
  EXPECT_LT(std::abs(neighbours / square), 4.0 / std::sqrt(n));

  const auto largest = [](const std::vector<double>& values) {
    double most = 0.0;
    for (const double v : values) most = std::max(most, std::abs(v));
    return most;
  };
  const double stretch = torque / (c.radius_m * stiffness(x.back()));
  const double per_metre = std::abs(stiffness(0.381) - stiffness(0.379)) / (0.002 * stiffness(0.38));
  EXPECT_GT(largest(own_way), 0.005);
  EXPECT_LT(largest(difference), 2.0 * stretch + per_metre * std::pow(largest(own_way), 2));
}

}  // namespace
}  // namespace resonid::plant
