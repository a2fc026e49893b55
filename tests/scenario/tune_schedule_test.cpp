// SPDX-License-Identifier: MIT
// The source's tooth belt, 54 ... 91 Hz over its stroke: simulated, identified at one position, tracked along
// the stroke, and the gains that `tune` schedules over the tracked rows put on the true machine: at rest, and
// in the drive's controller while the cart moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/online/control.hpp>
#include <resonid/plant/detail/drive.hpp>
#include <resonid/plant/detail/measurement.hpp>
#include <string>
#include <utility>
#include <vector>

#include "design/figures.hpp"
#include "design/schedule.hpp"
#include "experiments.hpp"
#include "track_errors.hpp"

namespace resonid {
namespace {

using identification::Result;

struct Belt {
  const char* standstill;  ///< Where it is identified.
  const char* stroke;      ///< Where it is tracked.
};
void PrintTo(const Belt& belt, std::ostream* out) { *out << belt.stroke; }

class ScheduledToothBelt : public ::testing::TestWithParam<Belt> {};

/// The machine of the simulation with its cart at a position, by which that simulation's own response is met.
fit::DriveModel true_machine(plant::ExperimentConfig config, double position) {
  config.motion = {};
  config.motion.kind = plant::MotionKind::standstill;
  config.motion.from = position;
  config.excitation = {};
  config.run.duration_s = 0.1;
  const std::vector<double> lines = {10.0, 40.0, 60.0, 100.0};
  const auto simulation = plant::simulate_closed_loop(config, lines);
  if (!simulation) throw std::runtime_error(message_of(simulation.error()));
  fit::DriveModel model;
  model.sample_time_s = 1.0 / config.run.sample_rate_hz;
  model.delay_s = simulation->truth.delay_s;
  static_cast<data::TwoMassParameters&>(model.parameters) = simulation->truth.two_mass.value();
  const auto values = model.values(lines);
  for (std::size_t i = 0; i < lines.size(); ++i)
    EXPECT_LT(std::abs(values[i] / simulation->truth.response.value[i] - 1.0), 1e-6) << position;
  return model;
}

/// Largest |S| and |T_load| of gains on the true machine at 121 positions.
struct Largest {
  double sensitivity = 0.0, load_transfer = 0.0;
  bool stable = true;
};
Largest on_the_true_machine(const plant::ExperimentConfig& config, const design::GainSchedule& schedule,
                            double from, double to) {
  Largest largest;
  constexpr int kPositions = 121;
  for (int i = 0; i < kPositions; ++i) {
    const double position = from + (to - from) * i / (kPositions - 1.0);
    const auto figures =
        design::figures_of(design::Machine(true_machine(config, position)), schedule.at(position));
    largest.stable = largest.stable && figures.stable;
    largest.sensitivity = std::max(largest.sensitivity, figures.peak(design::Transfer::sensitivity).value);
    largest.load_transfer =
        std::max(largest.load_transfer, figures.peak(design::Transfer::load_transfer).value);
  }
  return largest;
}

/// A way of the cart; torques on it, of one size and none in turn, change every `stretch` samples.
struct Ride {
  double from = 0.0;   ///< m
  double speed = 0.0;  ///< m/s; at rest the gains are those of `from`.
  std::size_t changes = 0, stretch = 0, samples = 0;
};
constexpr std::size_t kFirstChange = 4;  // samples after the start

/// [sample] Velocity of the load at the driven shaft (rad/s): the true machine, its dry friction left out,
/// under the controller as it runs in the drive.
std::vector<double> ridden(const plant::ExperimentConfig& config, const std::vector<online::GainNode>& nodes,
                           const Ride& ride) {
  constexpr double kLoad = 0.1;  // Nm
  const double rate = config.run.sample_rate_hz;
  plant::MachineConfig machine;
  machine.drive = config.drive;
  machine.torque_lag_s = config.actuator.lag_s;
  for (std::size_t i = 0; i < ride.changes; ++i) {
    machine.disturbance.load_step.push_back(i % 2 == 0 ? -kLoad : kLoad);
    machine.disturbance.load_step_at_s.push_back(static_cast<double>(kFirstChange + i * ride.stretch) / rate);
  }
  const auto delay = plant::split_delay(config.measurement.delay_s, rate);
  const auto drive =
      plant::make_drive(machine, rate, delay.fraction, static_cast<double>(ride.samples) / rate).value();
  const double turning = ride.speed / config.drive.radius_m;
  drive->settle(turning, ride.from);
  plant::MotionSensor sensor(delay, plant::VelocitySource::sensor, 0.0, 1.0 / rate);
  sensor.settle(drive->motions().front());
  online::DriveControlConfig scheduled;
  scheduled.sample_rate_hz = rate;
  scheduled.schedule = nodes;
  auto control = online::DriveControl<double>::create(scheduled).value();
  std::vector<double> velocity;
  for (std::size_t k = 0; k < ride.samples; ++k) {
    online::ControlInputs<double> now;
    now.reference = turning;
    now.velocity = sensor.read().velocity;
    now.position = ride.speed == 0.0 ? ride.from : drive->place();
    velocity.push_back(drive->motions().back().velocity);
    sensor.push(drive->advance(control.step(now)));
  }
  return velocity;
}

/// What the torques on the load do to its velocity, from each change of them on.
struct LoadStep {
  double peak = 0.0, iae = 0.0;
  double left = 0.0;  ///< Before the next change.
};
std::vector<LoadStep> load_steps(const plant::ExperimentConfig& config,
                                 const std::vector<online::GainNode>& nodes, Ride ride) {
  const auto disturbed = ridden(config, nodes, ride);
  const std::size_t changes = std::exchange(ride.changes, 0);
  const auto undisturbed = ridden(config, nodes, ride);
  std::vector<LoadStep> steps(changes);
  for (std::size_t k = kFirstChange; k < kFirstChange + changes * ride.stretch; ++k) {
    LoadStep& step = steps[(k - kFirstChange) / ride.stretch];
    step.left = std::abs(disturbed.at(k) - undisturbed.at(k));
    step.peak = std::max(step.peak, step.left);
    step.iae += step.left / config.run.sample_rate_hz;
  }
  return steps;
}

/// At the largest speed that is promised, what a load step does lies within what the loops do that stand
/// still at the positions that are passed meanwhile: the worst and the best of both ends of the way and its
/// middle. The room is for what a step leaves to the next one: a stroke takes at least five settling times,
/// so that a quarter of it leaves less than 2 % of the slowest pole; it lies within the tenth that `tune`
/// allows a run at that speed.
void expect_as_frozen(const plant::ExperimentConfig& config, const std::vector<online::GainNode>& nodes,
                      double speed) {
  constexpr std::size_t kStretches = 4;
  constexpr double kRoom = 1.05, kLeft = 0.05;
  const double from = nodes.front().position, to = nodes.back().position;
  Ride ride{from, speed, kStretches, 0, 0};
  ride.stretch = static_cast<std::size_t>((to - from) / speed * config.run.sample_rate_hz) / kStretches;
  ride.samples = kFirstChange + kStretches * ride.stretch;
  const auto moving = load_steps(config, nodes, ride);
  for (std::size_t i = 0; i < kStretches; ++i) {
    LoadStep worst, best{1e9, 1e9, 0.0};
    for (const double share : {0.0, 0.5, 1.0}) {
      const double position = from + (to - from) * (static_cast<double>(i) + share) / kStretches;
      const auto frozen =
          load_steps(config, nodes, {position, 0.0, 1, ride.stretch, kFirstChange + ride.stretch}).front();
      worst.peak = std::max(worst.peak, frozen.peak);
      worst.iae = std::max(worst.iae, frozen.iae);
      best.peak = std::min(best.peak, frozen.peak);
      best.iae = std::min(best.iae, frozen.iae);
    }
    EXPECT_LT(moving[i].peak, kRoom * worst.peak) << i;
    EXPECT_LT(moving[i].iae, kRoom * worst.iae) << i;
    EXPECT_GT(kRoom * moving[i].peak, best.peak) << i;
    EXPECT_GT(kRoom * moving[i].iae, best.iae) << i;
    EXPECT_LT(moving[i].left, kLeft * moving[i].peak) << i;  // it settles: the loop is stable in motion
  }
}

TEST_P(ScheduledToothBelt, MeetsItsBoundsOnTheTrueMachineOverTheStroke) {
  const auto standstill = io::shipped_experiment(GetParam().standstill),
             stroke = io::shipped_experiment(GetParam().stroke);
  identification::Options options;
  options.delay_s = standstill.measurement.delay_s;
  const auto result = identification::identify(test::simulated(standstill).record, options);
  ASSERT_TRUE(result) << message_of(result.error());
  identification::TrackOptions tracking;
  tracking.common.delay_s = stroke.measurement.delay_s;
  tracking.method = identification::TrackMethod::physical;
  const auto track = test::tracked(test::simulated(stroke).record, tracking);
  const auto over = identification::results_over_position(*result, track);
  ASSERT_TRUE(over) << message_of(over.error());
  EXPECT_LT(over->positions.front(), 0.45);
  EXPECT_GT(over->positions.back(), 1.58);
  // Each result's machine is the true one there, as far as its error bars say.
  for (std::size_t k = 0; k < over->positions.size(); ++k) {
    const auto& found = over->results[k].model->drive;
    const auto truth = true_machine(stroke, over->positions[k]);
    EXPECT_NEAR(found.parameters.stiffness / truth.parameters.stiffness, 1.0,
                4.0 * found.estimate(fit::kStiffness).std / found.parameters.stiffness)
        << over->positions[k];
  }

  identification::TuneOptions wanted;
  wanted.structure = identification::ControllerStructure::pi;
  wanted.draws = 1000;
  wanted.positions = over->positions;
  const auto tuning = identification::tune(over->results, wanted);
  ASSERT_TRUE(tuning) << message_of(tuning.error());
  ASSERT_TRUE(tuning->schedule);
  EXPECT_TRUE(tuning->schedule->within);
  std::vector<design::ScheduleNode> nodes;
  for (const auto& node : tuning->schedule->nodes) nodes.push_back({node.position, node.kp, node.ki});
  EXPECT_GE(nodes.size(), 3U);

  const auto largest = on_the_true_machine(stroke, design::GainSchedule(nodes), 0.4, 1.63);
  EXPECT_TRUE(largest.stable);
  EXPECT_LT(largest.sensitivity, 1.4);
  EXPECT_LT(largest.load_transfer, 1.3);
  EXPECT_GT(std::max(largest.sensitivity / 1.4, largest.load_transfer / 1.3), 0.9);  // not by being slack
  EXPECT_LT(*tuning->schedule->scheduled_iae, *tuning->schedule->fixed_iae);

  ASSERT_TRUE(tuning->schedule->largest_speed);
  const double speed = *tuning->schedule->largest_speed;
  ASSERT_GT(speed, 0.03);  // m/s: not so slow that it is as good as at rest
  std::vector<online::GainNode> in_the_drive;
  for (const auto& node : nodes) in_the_drive.push_back({node.position, node.kp, node.ki});
  expect_as_frozen(stroke, in_the_drive, speed);
  ::testing::Test::RecordProperty("largest_speed", std::to_string(speed));
  ::testing::Test::RecordProperty("largest_sensitivity", std::to_string(largest.sensitivity));
  ::testing::Test::RecordProperty("largest_load_transfer", std::to_string(largest.load_transfer));
  ::testing::Test::RecordProperty("nodes", std::to_string(nodes.size()));
  ::testing::Test::RecordProperty("scheduled_iae", std::to_string(*tuning->schedule->scheduled_iae));
  ::testing::Test::RecordProperty("fixed_iae", std::to_string(*tuning->schedule->fixed_iae));
}

INSTANTIATE_TEST_SUITE_P(Source, ScheduledToothBelt,
                         ::testing::Values(Belt{"v_tooth_chirp_middle", "v_tooth_multisine"},
                                           Belt{"ii_tooth_standstill", "ii_iii_tooth_prbs"}));

}  // namespace
}  // namespace resonid
