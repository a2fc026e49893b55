// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <resonid/base/error_text.hpp>
#include <resonid/io/experiment.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace resonid::reproduction {
namespace {

TEST(ShippedExperiments, AreValidAndRun) {
  const auto all = io::shipped_experiments();
  ASSERT_GE(all.size(), 9U);
  EXPECT_TRUE(
      std::is_sorted(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; }));
  for (const auto& shipped : all) {
    auto config = io::parse_experiment(shipped.text, shipped.name);
    ASSERT_TRUE(config) << shipped.name << ": " << message_of(config.error());
    config->run.duration_s = 0.5;
    const auto simulation = plant::simulate_closed_loop(*config);
    ASSERT_TRUE(simulation) << shipped.name << ": " << simulation.error().field << ": "
                            << simulation.error().requirement;
  }
}

TEST(ShippedExperiments, AreFoundByName) {
  EXPECT_EQ(io::shipped_experiment("iv_multisine_a").drive.damping, 100.0);  // Pub. IV, Table 1
  EXPECT_EQ(io::shipped_experiment("iv_multisine_b").drive.stiffness, 3.1e4);
  EXPECT_EQ(io::shipped_experiment("iv_multisine_a").excitation.lines_hz.count, 8U);
}

/// Lines of an experiment file without comments and blanks.
std::vector<std::string> settings(std::string_view name) {
  for (const auto& shipped : io::shipped_experiments()) {
    if (shipped.name != name) continue;
    std::istringstream text{std::string(shipped.text)};
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) {
      line = line.substr(0, line.find('#'));
      line.erase(line.find_last_not_of(' ') + 1);
      if (!line.empty()) lines.push_back(line);
    }
    return lines;
  }
  return {};
}

// Nevaranta 2016, Pub. VI, Figures 4, 5 and 9: what a variation changes, and nothing else.
TEST(ShippedExperiments, VariationsOfASweepChangeNothingElse) {
  const struct {
    const char* name;
    const char* base;
    std::vector<std::string> changed;
  } cases[] = {{"vi_chirp_a_5s", "vi_chirp_a", {"duration_s = 5.0"}},
               {"vi_chirp_a_10s", "vi_chirp_a", {"duration_s = 10.0"}},
               {"vi_chirp_a_34s", "vi_chirp_a", {"duration_s = 34.0"}},
               {"vi_chirp_a_ascending", "vi_chirp_a", {"from_hz = 1.5", "to_hz = 35.0"}},
               {"vi_chirp_a_literal_ascending", "vi_chirp_a_literal", {"from_hz = 1.5", "to_hz = 35.0"}},
               {"vi_chirp_a_literal",
                "vi_chirp_a",
                {"gain = 1.0", "integral_time_s = 0.1", "sample_rate_hz = 1000.0"}},
               {"vi_chirp_tensioner_b_50hz", "vi_chirp_tensioner_b", {"from_hz = 50.0", "seed = 3"}}};
  for (const auto& c : cases) {
    const auto found = settings(c.name), base = settings(c.base);
    ASSERT_EQ(found.size(), base.size()) << c.name;
    std::vector<std::string> changed;
    for (std::size_t i = 0; i < base.size(); ++i)
      if (found[i] != base[i]) changed.push_back(found[i]);
    EXPECT_EQ(changed, c.changed) << c.name;
  }
}

}  // namespace
}  // namespace resonid::reproduction
