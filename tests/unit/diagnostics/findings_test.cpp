// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <resonid/diagnostics/detail/data_findings.hpp>

namespace resonid::diagnostics {
namespace {

bool has(const std::vector<Finding>& findings, const char* id) {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding& f) { return f.id == id; });
}

data::Record sine_record(double limit) {
  data::Record record;
  record.sample_rate_hz = 100.0;
  for (int k = 0; k < 1000; ++k) {
    const double s = std::sin(0.07 * k);
    record.input.samples.push_back(std::clamp(s, -limit, limit));
    record.output.samples.push_back(std::cos(0.07 * k));
  }
  return record;
}

TEST(RecordFindings, SoundRecordHasNone) { EXPECT_TRUE(inspect(sine_record(2.0)).empty()); }

TEST(RecordFindings, SaturationIsFound) {
  const auto findings = inspect(sine_record(0.8));
  ASSERT_TRUE(has(findings, "saturation"));
  EXPECT_EQ(findings[0].severity, Severity::error);
}

TEST(RecordFindings, TwoLevelExcitationIsNotSaturation) {
  auto record = sine_record(2.0);
  for (std::size_t k = 0; k < record.input.samples.size(); ++k)
    record.input.samples[k] = (k / 7) % 2 == 0 ? 1.0 : -1.0;
  EXPECT_FALSE(has(inspect(record), "saturation"));
}

TEST(RecordFindings, OneWildSampleIsAnError) {
  auto record = sine_record(2.0);
  record.output.samples[400] = 1e6;
  const auto findings = inspect(record);
  ASSERT_TRUE(has(findings, "outlier"));
  EXPECT_EQ(findings[0].severity, Severity::error);
  EXPECT_NE(findings[0].meaning.find("400"), std::string::npos);
}

TEST(RecordFindings, DeadSignalsGapsAndJitter) {
  auto record = sine_record(2.0);
  record.output.samples.assign(record.output.samples.size(), 3.0);
  record.sampling.measured = true;
  record.sampling.gaps = 2;
  record.sampling.jitter_rms_s = 0.002;
  const auto findings = inspect(record);
  EXPECT_TRUE(has(findings, "dead-output"));
  EXPECT_TRUE(has(findings, "gaps"));
  EXPECT_TRUE(has(findings, "jitter"));
  record.input.samples.assign(record.input.samples.size(), 0.0);
  EXPECT_TRUE(has(inspect(record), "no-excitation"));
}

/// A counter that is set anew at marks, one that counts on, one that toggles between two counts, and a step.
TEST(RecordFindings, JumpsOfAPosition) {
  auto record = sine_record(2.0);
  record.output_quantity = data::OutputQuantity::position;
  auto& y = record.output.samples;
  EXPECT_FALSE(has(inspect(record), "position-jumps"));
  const auto count_to = [&](std::size_t even, std::size_t odd) {
    std::size_t at = 0, turn = 0;
    for (double& x : y) {
      x = static_cast<double>(at++);
      if (at == (turn % 2 == 0 ? even : odd)) at = 0, ++turn;
    }
  };
  count_to(120, 80);
  const auto findings = inspect(record);
  ASSERT_TRUE(has(findings, "position-jumps"));
  EXPECT_NE(findings[0].meaning.find("jumps 9 times by 79 ... 119"), std::string::npos)
      << findings[0].meaning;
  record.output_quantity = data::OutputQuantity::velocity;
  EXPECT_FALSE(has(inspect(record), "position-jumps"));
  record.output_quantity = data::OutputQuantity::position;
  count_to(700, 700);
  EXPECT_TRUE(has(inspect(record), "position-jumps"));
  count_to(2000, 2000);
  EXPECT_FALSE(has(inspect(record), "position-jumps"));
  for (std::size_t k = 0; k < y.size(); ++k) y[k] = k % 7 == 0 ? 1.0 : 0.0;
  EXPECT_FALSE(has(inspect(record), "position-jumps"));
  for (std::size_t k = 0; k < y.size(); ++k) y[k] = (k / 100) % 2 == 0 ? 0.0 : 40.0;
  EXPECT_FALSE(has(inspect(record), "position-jumps"));
}

/// A velocity that repeats its last value while the torque goes on, and one that ends at a limit.
TEST(RecordFindings, StuckAndLimitedVelocities) {
  auto record = sine_record(2.0);
  auto& y = record.output.samples;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(5.0, 0.3);
  for (double& x : y) x += noise(random);
  EXPECT_FALSE(has(inspect(record), "stuck-output") || has(inspect(record), "limited-output"));
  auto stuck = record;
  for (std::size_t k = y.size() / 2; k < y.size() * 5 / 8; ++k) stuck.output.samples[k] = y[y.size() / 2];
  EXPECT_TRUE(has(inspect(stuck), "stuck-output"));
  auto at_rest = record;  // held by dry friction
  for (std::size_t k = y.size() / 2; k < y.size() * 5 / 8; ++k) at_rest.output.samples[k] = 0.0;
  EXPECT_FALSE(has(inspect(at_rest), "stuck-output"));
  auto limited = record;
  std::vector<double> sorted = y;
  std::sort(sorted.begin(), sorted.end());
  const double limit = sorted[sorted.size() * 4 / 5];
  for (double& x : limited.output.samples) x = std::min(x, limit);
  EXPECT_TRUE(has(inspect(limited), "limited-output"));
}

TEST(RecordFindings, InterpolatedSamplesAreAWarning) {
  auto record = sine_record(2.0);
  record.sampling.filled = {7, 40};
  const auto findings = inspect(record);
  ASSERT_TRUE(has(findings, "filled-samples"));
  EXPECT_EQ(findings[0].severity, Severity::warning);
}

data::FrequencyResponse response_with(double coherence, std::size_t from, std::size_t to, double there) {
  data::FrequencyResponse g;
  for (std::size_t i = 0; i < 100; ++i) {
    g.frequency_hz.push_back(0.1 * static_cast<double>(i + 1));
    g.value.emplace_back(1.0);
    g.coherence.push_back(i >= from && i < to ? there : coherence);
  }
  return g;
}

TEST(ResponseFindings, CollapseOfCoherenceIsNamedWithItsBand) {
  const auto findings = inspect(response_with(0.99, 78, 86, 0.3));
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].id, "low-coherence");
  EXPECT_DOUBLE_EQ(*findings[0].value, 0.3);
  EXPECT_NE(findings[0].meaning.find("7.9 to 8.6 Hz"), std::string::npos) << findings[0].meaning;
}

TEST(ResponseFindings, CoherenceAroundTheThresholdIsOneBand) {
  auto g = response_with(0.99, 0, 0, 0.0);
  for (std::size_t i = 50; i < 90; i += 3) g.coherence[i] = 0.75;
  ASSERT_EQ(inspect(g).size(), 1U);
  EXPECT_NE(inspect(g)[0].meaning.find("5.1 to 9 Hz"), std::string::npos) << inspect(g)[0].meaning;
}

TEST(ResponseFindings, AntiResonanceIsToldFromMissingExcitation) {
  auto g = response_with(0.99, 40, 44, 0.4);
  EXPECT_NE(inspect(g)[0].meaning.find("do not read"), std::string::npos);
  g.value[42] = 0.1;
  EXPECT_NE(inspect(g)[0].meaning.find("anti-resonance"), std::string::npos);
}

TEST(ResponseFindings, NoiseIsAnError) {
  const auto findings = inspect(response_with(0.1, 0, 0, 0.0));
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].severity, Severity::error);
}

TEST(ResponseFindings, UnsettledLinesAreReported) {
  auto g = response_with(0.99, 0, 0, 0.0);
  g.unsettled_hz = {0.3};
  EXPECT_TRUE(has(inspect(g), "unsettled-lines"));
}

}  // namespace
}  // namespace resonid::diagnostics
