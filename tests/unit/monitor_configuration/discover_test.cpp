// SPDX-License-Identifier: MIT
#include "monitor/service/discover.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/plant/experiment.hpp>

#include "configurations.hpp"

namespace resonid::monitor::test {
namespace {

/// A simulated drive as a stream: its true rate, columns and signs are known.
StreamFacts simulated(double output_sign) {
  auto config = io::shipped_experiment("demo");
  config.run.duration_s = 4.0;
  auto simulation = plant::simulate_closed_loop(config);
  EXPECT_TRUE(simulation.has_value());
  auto& record = simulation->record;
  for (auto& y : record.output.samples) y *= output_sign;
  return {"line",
          "drives/x",
          {"ru", "act_torque_Nm", "speed_rad_s"},
          499.7,
          {record.excitation.samples, record.input.samples, record.output.samples}};
}

std::string text_of(const std::vector<Proposal>& proposals) {
  return proposal_text({{"line", SourceConfig{}}}, proposals);
}

/// What was proposed, read as it is.
ConfigurationFile as_configuration(const TemporaryFolder& folder, const std::string& text) {
  return parse_configuration(text, "m.toml", folder.path());
}

TEST(Discover, ProposesWhatTheStreamIs) {
  const TemporaryFolder folder;
  for (const double sign : {1.0, -1.0}) {
    const std::vector<StreamFacts> streams = {simulated(sign)};
    const auto proposals = propose(streams);
    ASSERT_EQ(proposals.size(), 1U);
    const auto file = as_configuration(folder, text_of(proposals));
    EXPECT_EQ(messages(file.findings.errors), std::vector<std::string>{});
    ASSERT_TRUE(file.configuration.axes.tables.contains("drives-x"));
    const auto& axis = file.configuration.axes.tables.at("drives-x");
    EXPECT_EQ(axis.source, "line");
    EXPECT_EQ(axis.channel, "drives/x");
    EXPECT_EQ(axis.sample_rate_hz, 500.0);
    EXPECT_EQ(axis.excitation, "ru");
    EXPECT_EQ(axis.input, "act_torque_Nm");
    EXPECT_EQ(axis.output, "speed_rad_s");
    EXPECT_EQ(axis.output_scale, sign);
    EXPECT_EQ(axis.output_quantity, data::OutputQuantity::velocity);
  }
}

/// Files tell no rate but in a column of times.
TEST(Discover, TakesTheRateOfAColumnOfTimes) {
  auto facts = simulated(1.0);
  facts.sample_rate_hz = 0.0;
  EXPECT_FALSE(propose(std::vector{facts}).front().complete());
  std::vector<double> time;
  for (std::size_t k = 0; k < facts.samples[0].size(); ++k) time.push_back(static_cast<double>(k) / 500.0);
  facts.columns.insert(facts.columns.begin(), "time_s");
  facts.samples.insert(facts.samples.begin(), time);
  const auto proposals = propose(std::vector{facts});
  EXPECT_TRUE(proposals.front().complete());
  EXPECT_EQ(proposals.front().axis.sample_rate_hz, 500.0);
  facts.arrival_rate_hz = 250.0;  // however fast they come
  const std::string text = text_of(propose(std::vector{facts}));
  EXPECT_NE(text.find("sample_rate_hz = 500\n"), std::string::npos) << text;
  EXPECT_EQ(text.find("by arrival"), std::string::npos) << text;
}

TEST(Discover, TakesTheRateOfArrivalLastAndSaysSo) {
  auto facts = simulated(1.0);
  facts.arrival_rate_hz = 250.1;
  EXPECT_NE(text_of(propose(std::vector{facts})).find("sample_rate_hz = 500\n"), std::string::npos);
  facts.sample_rate_hz = 0.0;
  const std::string text = text_of(propose(std::vector{facts}));
  EXPECT_NE(text.find("sample_rate_hz = 250\n"), std::string::npos) << text;
  EXPECT_NE(text.find("# sample rate measured by arrival: 250.1 Hz; check it\n"), std::string::npos) << text;
}

/// A time of the samples is no column: what becomes of it stands in the proposal.
TEST(Discover, SaysWhatATimeOfTheSamplesIs) {
  auto facts = simulated(1.0);
  EXPECT_EQ(text_of(propose(std::vector{facts})).find("come with their time"), std::string::npos);
  facts.timed = true;
  EXPECT_NE(text_of(propose(std::vector{facts})).find("# samples come with their time, which is followed"),
            std::string::npos);
  facts.timed = false;
  facts.sample_rate_hz = 0.0;
  EXPECT_NE(text_of(propose(std::vector{facts})).find("'timestamp' tells it as UNIX time or ISO 8601"),
            std::string::npos);
}

TEST(Discover, PrintsTheDigitsOfARateThatAreKnown) {
  auto facts = simulated(1.0);
  for (const auto& [measured, printed] :
       std::initializer_list<std::pair<double, const char*>>{{510.2, "510.2"},
                                                             {510.2384, "510.2"},
                                                             {2001.0, "2000"},
                                                             {0.03704, "0.03704"},
                                                             {73126.0, "73130"}}) {
    facts.sample_rate_hz = measured;
    const std::string text = text_of(propose(std::vector{facts}));
    EXPECT_NE(text.find(std::string("sample_rate_hz = ") + printed + '\n'), std::string::npos) << text;
  }
}

TEST(Discover, LeavesToPeopleWhatDoesNotShow) {
  const TemporaryFolder folder;
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise;
  std::vector<double> a(400), b(400), c(400);
  for (auto* column : {&a, &b, &c})
    for (double& x : *column) x = noise(random);
  const std::vector<StreamFacts> streams = {{"line", "", {"torque_1", "torque_2", "speed"}, 0.0, {a, b, c}},
                                            {"line", "\x01 odd\nname", {"u", "y"}, 100.0, {a, b}},
                                            {"line", "", {}, 0.0, {}}};
  const auto proposals = propose(streams);
  ASSERT_EQ(proposals.size(), 3U);
  EXPECT_EQ(proposals[0].name, "line");
  EXPECT_EQ(proposals[1].name, "--odd-name");
  EXPECT_EQ(proposals[2].name, "line-2");
  EXPECT_EQ(proposals[0].axis.input, "");
  EXPECT_EQ(proposals[0].axis.sample_rate_hz, 0.0);
  const auto said = [&](std::size_t i, const char* words) {
    return std::any_of(proposals[i].notes.begin(), proposals[i].notes.end(),
                       [&](const std::string& note) { return note.find(words) != note.npos; });
  };
  EXPECT_TRUE(said(0, "torque_1, torque_2")) << text_of(proposals);
  EXPECT_TRUE(said(0, "sample rate is not known"));
  EXPECT_TRUE(said(1, "sign of the output does not show")) << "noise has none";
  EXPECT_EQ(proposals[1].axis.output_scale, 1.0);
  const auto file = as_configuration(folder, text_of(proposals));
  EXPECT_EQ(messages(file.findings.errors), std::vector<std::string>{});
  EXPECT_EQ(file.configuration.axes.tables.size(), 1U) << "the others are comments";
  EXPECT_NE(text_of(proposals).find("#[axis.line-2]\n#source = \"line\"\n"), std::string::npos);
  EXPECT_EQ(file.configuration.axes.tables.at("--odd-name").channel, "\x01 odd\nname");
}

}  // namespace
}  // namespace resonid::monitor::test
