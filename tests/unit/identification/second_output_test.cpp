// SPDX-License-Identifier: MIT
// identify() with what was measured at the load, on simulated drives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <loop_of_two_masses.hpp>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/plant/experiment.hpp>

namespace resonid::identification {
namespace {

using data::SecondOutput;
using diagnostics::Severity;

plant::ExperimentConfig belt(SecondOutput kind, std::uint64_t seed) {
  auto c = test::loop_of_two_masses(0.032, 0.05, 400.0, 0.4, 1.0, 0.15);
  c.measurement.delay_s = 0.002;
  c.measurement.noise_rms = 0.05;
  c.measurement.second_output = kind;
  c.measurement.second_noise = kind == SecondOutput::load_encoder ? 3e-4 : 2.0;
  c.excitation.kind = online::Kind::multisine;
  c.excitation.amplitude = 0.5;
  std::vector<double> lines;
  for (int f = 1; f <= 40; ++f) lines.push_back(f);
  c.excitation.lines_hz.assign(lines);
  c.run.sample_rate_hz = 500.0;
  c.run.duration_s = 8.0;
  c.run.seed = seed;
  return c;
}

data::Record recorded(const plant::ExperimentConfig& c) {
  return plant::simulate_closed_loop(c).value().record;
}

Options told() {
  Options o;
  o.delay_s = 0.002;
  o.model = ModelChoice::two_mass;
  return o;
}

Result identified(const data::Record& record, const Options& options = told()) {
  auto result = identify(record, options);
  EXPECT_TRUE(result) << (result ? "" : result.error().requirement.str());
  return std::move(*result);
}

const diagnostics::Finding* finding(const Result& result, std::string_view id) {
  const auto found =
      std::find_if(result.findings.begin(), result.findings.end(), [&](const auto& f) { return f.id == id; });
  return found == result.findings.end() ? nullptr : &*found;
}

data::Record without_second(data::Record record) {
  record.second_output = {};
  record.second_output_kind = SecondOutput::none;
  return record;
}

TEST(IdentifySecondOutput, ErrorsAreWithinSmallerBars) {
  double squares = 0.0, count = 0.0;
  for (const auto kind : {SecondOutput::load_encoder, SecondOutput::load_accelerometer})
    for (const std::uint64_t seed : {2, 3}) {
      const auto c = belt(kind, seed);
      const auto record = recorded(c);
      const auto both = identified(record), one = identified(without_second(record));
      ASSERT_TRUE(both.second_output && both.model && one.model);
      EXPECT_FALSE(one.second_output);
      EXPECT_TRUE(both.trusted);
      EXPECT_TRUE(both.second_output->fitted);
      EXPECT_FALSE(both.second_output->gain);
      EXPECT_FALSE(both.second_output->delay_s);
      EXPECT_EQ(both.second_output->unit, "(rad/s)/Nm");
      for (const char* id : {"second-output-scale", "second-output-late", "second-output-differs"})
        EXPECT_EQ(finding(both, id), nullptr) << id;
      const std::pair<fit::Parameter, double> truth[] = {{fit::kDrivenInertia, c.drive.driven_inertia},
                                                         {fit::kLoadInertia, c.drive.load_inertia},
                                                         {fit::kStiffness, c.drive.stiffness},
                                                         {fit::kDamping, c.drive.damping}};
      for (const auto& [p, value] : truth) {
        const auto e = both.model->drive.estimate(p);
        EXPECT_LT(e.std, 1.02 * one.model->drive.estimate(p).std) << p;
        EXPECT_LT(std::abs(e.value - value), 4.0 * e.std) << p;
        squares += std::pow((e.value - value) / e.std, 2);
        count += 1.0;
      }
      // What stiffness and load inertia do shows at the load as well as at the motor.
      EXPECT_LT(both.model->drive.estimate(fit::kStiffness).std,
                0.9 * one.model->drive.estimate(fit::kStiffness).std);
    }
  EXPECT_GT(squares / count, 0.3);
  EXPECT_LT(squares / count, 2.3);
}

TEST(IdentifySecondOutput, MeasuresTheResponseOfTheLoad) {
  const auto c = belt(SecondOutput::load_encoder, 1);
  const auto result = identified(recorded(c));
  const auto& g = result.second_output->response;
  ASSERT_EQ(g.lines(), result.response.lines());
  ASSERT_EQ(g.coherence.size(), g.lines());
  const auto& d = c.drive;
  double squares = 0.0;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    EXPECT_EQ(g.frequency_hz[i], result.response.frequency_hz[i]);
    // (D s + K)/(s (J1 J2 s^2 + (J1 + J2)(D s + K))), held over a sample.
    const std::complex<double> s(0.0, kTwoPi * g.frequency_hz[i]);
    const auto coupling = d.damping * s + d.stiffness;
    const auto truth =
        coupling /
        (s * (d.driven_inertia * d.load_inertia * s * s + (d.driven_inertia + d.load_inertia) * coupling)) *
        std::exp(-0.5 * s / c.run.sample_rate_hz);
    squares += std::norm((g.value[i] - truth) / std::hypot(g.std[i], 0.02 * std::abs(truth)));
  }
  EXPECT_LT(squares / static_cast<double>(g.lines()), 2.0);
}

TEST(IdentifySecondOutput, NamesTheFactorOfAWrongScale) {
  for (const double scale : {-1.0, 180.0 / kPi, 3.2}) {
    auto record = recorded(belt(SecondOutput::load_encoder, 4));
    for (double& v : record.second_output.samples) v *= scale;
    const auto result = identified(record);
    EXPECT_FALSE(result.trusted);
    const auto* found = finding(result, "second-output-scale");
    ASSERT_NE(found, nullptr) << scale;
    EXPECT_EQ(found->severity, Severity::error);
    ASSERT_TRUE(result.second_output->gain);
    EXPECT_NEAR(result.second_output->gain->value / scale, 1.0, 0.01);
  }
}

TEST(IdentifySecondOutput, EstimatesTheCalibrationOfAnAccelerometer) {
  auto record = recorded(belt(SecondOutput::load_accelerometer, 5));
  for (double& v : record.second_output.samples) v *= 0.95;
  const auto result = identified(record);
  EXPECT_TRUE(result.trusted);
  const auto* found = finding(result, "second-output-scale");
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->severity, Severity::info);
  EXPECT_NEAR(result.second_output->gain->value, 0.95, 4.0 * result.second_output->gain->std);
  const auto stiffness = result.model->drive.estimate(fit::kStiffness);
  EXPECT_LT(std::abs(stiffness.value - 400.0), 4.0 * stiffness.std);
}

TEST(IdentifySecondOutput, EstimatesItsDelay) {
  auto record = recorded(belt(SecondOutput::load_encoder, 6));
  auto& samples = record.second_output.samples;
  std::rotate(samples.rbegin(), samples.rbegin() + 1, samples.rend());
  samples.front() = samples[1];
  const auto result = identified(record);
  EXPECT_TRUE(result.trusted);
  ASSERT_NE(finding(result, "second-output-late"), nullptr);
  EXPECT_NEAR(result.second_output->delay_s->value, 0.002, 4.0 * result.second_output->delay_s->std);
}

TEST(IdentifySecondOutput, WhatIsNotOfThisLoadIsRefused) {
  const auto right = recorded(belt(SecondOutput::load_encoder, 7));
  auto noise = right, filtered = right;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  double state = right.second_output.samples.front();
  for (std::size_t k = 0; k < right.samples(); ++k) {
    noise.second_output.samples[k] = 0.1 * normal(random);
    state += 0.05 * (right.second_output.samples[k] - state);
    filtered.second_output.samples[k] = state;
  }
  const auto alone = identified(without_second(right));
  for (const auto* record : {&noise, &filtered}) {
    const auto result = identified(*record);
    EXPECT_FALSE(result.trusted);
    const auto* found = finding(result, "second-output-differs");
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(found->severity, Severity::error);
    EXPECT_FALSE(result.second_output->fitted);
    EXPECT_EQ(result.model->drive.parameters.stiffness, alone.model->drive.parameters.stiffness);
  }
}

TEST(IdentifySecondOutput, BootstrapIsRefused) {
  auto options = told();
  options.bootstrap = 20;
  const auto result = identify(recorded(belt(SecondOutput::load_encoder, 1)), options);
  ASSERT_FALSE(result);
  EXPECT_EQ(std::string(result.error().field), "bootstrap");
}

}  // namespace
}  // namespace resonid::identification
