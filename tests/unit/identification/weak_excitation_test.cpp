// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <resonid/identification/identify.hpp>
#include <resonid/plant/experiment.hpp>
#include <span>

namespace resonid::identification {
namespace {

constexpr ModelChoice kChoices[] = {ModelChoice::automatic, ModelChoice::none,       ModelChoice::rigid,
                                    ModelChoice::two_mass,  ModelChoice::three_mass, ModelChoice::black_box};

/// A two-mass drive at 500 Hz, 0.02 rad/s of noise on its velocity, a sweep of that amplitude.
data::Record swept(double amplitude, plant::ControllerKind controller) {
  plant::ExperimentConfig c;
  c.drive.driven_inertia = c.drive.load_inertia = 0.032;
  c.drive.stiffness = 143.75;
  c.drive.damping = 0.3;
  c.drive.viscous_friction = 0.05;
  c.measurement.noise_rms = 0.02;
  c.controller.kind = controller;
  c.controller.gain = 1.036;
  c.controller.integral_time_s = 0.147;
  c.run.sample_rate_hz = 500.0;
  c.excitation.kind = online::Kind::chirp;
  c.excitation.from_hz = 35.0;
  c.excitation.to_hz = 1.5;
  c.excitation.duration_s = 6.0;
  c.excitation.amplitude = amplitude;
  return plant::simulate_closed_loop(c).value().record;
}

std::size_t errors(const Result& result) {
  return static_cast<std::size_t>(
      std::count_if(result.findings.begin(), result.findings.end(),
                    [](const auto& f) { return f.severity == diagnostics::Severity::error; }));
}

void expect_weak(const data::Record& record, const char* words,
                 std::span<const ModelChoice> choices = kChoices) {
  for (const auto choice : choices) {
    Options options;
    options.model = choice;
    const auto result = identify(record, options);
    ASSERT_TRUE(result);
    SCOPED_TRACE(name_of(choice));
    EXPECT_FALSE(result->trusted);
    ASSERT_FALSE(result->findings.empty());
    EXPECT_EQ(result->findings.front().id, "weak-excitation");
    EXPECT_NE(result->findings.front().meaning.find(words), std::string::npos)
        << result->findings.front().meaning;
    EXPECT_EQ(errors(*result), 1U);
    EXPECT_FALSE(result->model || result->black_box || result->loop);
    EXPECT_TRUE(result->modes.empty());
    EXPECT_NE(result->method, "model");
  }
}

TEST(WeakExcitation, OfALoopThatAnswersNoise) {
  auto record = swept(0.001, plant::ControllerKind::pi);
  expect_weak(record, "of the input's power is the controller's answer to the noise of the output");
  record.excitation = {};
  expect_weak(record, "record the excitation (.excitation)", std::span(kChoices).first(1));
  expect_weak(record, "record the excitation (.excitation)", std::span(kChoices).last(1));
}

TEST(WeakExcitation, OfASweepThatHardlyMovesTheOutput) {
  auto record = swept(0.0002, plant::ControllerKind::none);
  record.excitation = {};
  expect_weak(record, "rise above twice their standard deviation");
}

TEST(WeakExcitation, IsNotWhatStrongOneIsBlamedFor) {
  for (const auto controller : {plant::ControllerKind::pi, plant::ControllerKind::none}) {
    auto record = swept(0.5, controller);
    record.excitation = {};
    for (const auto choice : {ModelChoice::automatic, ModelChoice::rigid}) {
      Options options;
      options.model = choice;  // a rigid model does not fit, which is another fault
      const auto result = identify(record, options);
      ASSERT_TRUE(result);
      EXPECT_TRUE(result->model);
      EXPECT_FALSE(result->trusted && choice == ModelChoice::rigid);
      EXPECT_TRUE(std::none_of(result->findings.begin(), result->findings.end(), [](const auto& f) {
        return f.id == "weak-excitation";
      })) << name_of(choice);
    }
  }
}

/// No model is shown of signals that have nothing to do with each other, whichever was asked for.
TEST(WeakExcitation, OfUnrelatedSignalsIsTheirIncoherence) {
  data::Record record;
  record.sample_rate_hz = 500.0;
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  for (int k = 0; k < 2000; ++k) {
    record.input.samples.push_back(noise(random));
    record.output.samples.push_back(noise(random));
  }
  for (const auto choice : kChoices) {
    Options options;
    options.model = choice;
    const auto result = identify(record, options);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->findings.front().id, "incoherent");
    EXPECT_EQ(errors(*result), 1U);
    EXPECT_FALSE(result->model || result->black_box);
    EXPECT_TRUE(result->modes.empty());
  }
}

}  // namespace
}  // namespace resonid::identification
