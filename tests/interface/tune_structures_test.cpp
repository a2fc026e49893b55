// SPDX-License-Identifier: MIT
// Structures whose design takes seconds: what `tune --export json` writes of them is judged as it was
// designed.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

class TuneStructures : public test::ProgramTest {};

TEST_F(TuneStructures, AreJudgedAsTheyWereDesigned) {
  write("run.toml",
        "drive = {driven_inertia = 0.032, load_inertia = 0.032, stiffness = 143.75, damping = 0.3}\n"
        "controller = {kind = 'pi', gain = 1.036, integral_time_s = 0.147}\n"
        "excitation = {kind = 'prbs', register_length = 12, amplitude = 2.1}\n"
        "measurement = {delay_s = 0.004, noise_rms = 0.1}\n"
        "run = {sample_rate_hz = 500, duration_s = 25, seed = 1}\n"
        "motion = {kind = 'constant', velocity = 10.0}\n");
  ASSERT_EQ(run("simulate run.toml --out run.csv -q").exit_code, 0);
  ASSERT_EQ(run("identify run.csv --controller pi:1.036,0.147 --delay 0.004 --json result.json -q").exit_code,
            0);
  for (const std::string structure : {"rst", "state-feedback"}) {
    SCOPED_TRACE(structure);
    auto done = run("tune result.json --draws 500 --structure " + structure +
                    " --json t.json -q --export json:c.json");
    ASSERT_EQ(done.exit_code, 0) << done.error;
    done = run("tune result.json --draws 500 --json - --evaluate c.json");
    ASSERT_EQ(done.exit_code, 0) << done.error;
    const auto designed = json::parse(text("t.json")).at("candidates").at(0);
    const auto judged = json::parse(done.out).at("candidates").at(0);
    const auto &was = designed.at("figures"), &is = judged.at("figures");
    ASSERT_EQ(is.size(), was.size());
    for (std::size_t i = 0; i < was.size(); ++i) {
      EXPECT_EQ(is[i].at("name"), was[i].at("name"));
      const double value = was[i].value("value", 0.0);
      EXPECT_NEAR(is[i].value("value", 0.0), value, 1e-4 * std::abs(value) + 1e-6) << was[i].at("name");
    }
  }
}

}  // namespace
}  // namespace resonid
