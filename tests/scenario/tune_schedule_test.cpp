// SPDX-License-Identifier: MIT
// The source's tooth belt, 54 ... 91 Hz over its stroke: simulated, identified at one position, tracked along
// the stroke, and the gains that `tune` schedules over the tracked rows put on the true machine.
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <string>

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
