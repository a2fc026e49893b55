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

/// What was proposed, behind what a service needs besides.
ConfigurationFile as_configuration(const TemporaryFolder& folder, const std::string& text) {
  return parse_configuration("[monitor]\ndata = 'd'\n[source.line]\nkind = 'stdin'\n" + text, "m.toml",
                             folder.path());
}

TEST(Discover, ProposesWhatTheStreamIs) {
  const TemporaryFolder folder;
  for (const double sign : {1.0, -1.0}) {
    const std::vector<StreamFacts> streams = {simulated(sign)};
    const auto proposals = propose(streams);
    ASSERT_EQ(proposals.size(), 1U);
    const auto file = as_configuration(folder, proposal_text(proposals));
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
  EXPECT_TRUE(said(0, "torque_1, torque_2")) << proposal_text(proposals);
  EXPECT_TRUE(said(0, "sample rate is not known"));
  EXPECT_TRUE(said(1, "sign of the output does not show")) << "noise has none";
  EXPECT_EQ(proposals[1].axis.output_scale, 1.0);
  const auto file = as_configuration(folder, proposal_text(proposals));
  ASSERT_FALSE(file.usable());
  for (const auto& error : messages(file.findings.errors))
    EXPECT_TRUE(error.find("has no key") != error.npos || error.find("already") != error.npos) << error;
  EXPECT_EQ(file.configuration.axes.tables.at("--odd-name").channel, "\x01 odd\nname");
}

}  // namespace
}  // namespace resonid::monitor::test
