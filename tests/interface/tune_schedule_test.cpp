// SPDX-License-Identifier: MIT
// `resonid tune --schedule`: a list of positions, or rows of `track`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "program.hpp"

namespace resonid {
namespace {

class TuneSchedule : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    ASSERT_EQ(run("simulate ii_tooth_standstill --duration 6 --out run.csv -q").exit_code, 0);
    const auto done = run("identify run.csv --delay 0.004 --json result.json -q");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }

  /// Rows as `track` writes them, their stiffness falling by 15 % over the stroke.
  [[nodiscard]] static std::string rows(bool with_position = true, bool trusted = true) {
    std::ostringstream text;
    text << "time_s,driven_inertia,driven_inertia_std,load_inertia,load_inertia_std,stiffness,stiffness_std,"
            "damping,damping_std,resonance_hz"
         << (with_position ? ",position_m" : "") << ",trusted\n";
    for (int k = 0; k < 120; ++k) {
      const double way = k / 119.0;
      text << 0.1 * k << ",0.0028,1e-5,0.002653,1e-5," << 220.0 * std::exp(-0.15 * way) << ",0.5,0.054,5e-4,";
      if (k != 3) text << 61.0;  // a figure that was not known
      if (with_position) text << ',' << 0.8 + 0.4 * way;
      text << (trusted && k % 7 != 0 ? ",1" : ",0") << '\n';
    }
    return text.str();
  }
  [[nodiscard]] std::string refused(const std::string& arguments) const {
    const auto done = run("tune result.json " + arguments);
    EXPECT_EQ(done.exit_code, 2) << arguments;
    EXPECT_EQ(done.out, "");
    return done.error;
  }
};

TEST_F(TuneSchedule, TakesTheRowsOfATrack) {
  write("rows.csv", rows());
  const auto done =
      run("tune result.json --schedule rows.csv --structure pi --draws 400 --speed 0.05 --json tuned.json "
          "--export c:control.h");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto tuned = nlohmann::json::parse(text("tuned.json"));
  const auto& nodes = tuned.at("schedule").at("nodes");
  ASSERT_GE(nodes.size(), 2U);
  EXPECT_NEAR(nodes.front().at("position").get<double>(), 0.8, 0.01);  // the outermost trusted rows
  EXPECT_NEAR(nodes.back().at("position").get<double>(), 1.2, 0.01);
  // What is promised at every position that was looked at; the set-point weight is that of all.
  const auto& schedule = tuned.at("schedule");
  ASSERT_GE(schedule.at("places").size(), 41U);
  double most = 0.0;
  for (const auto& place : schedule.at("places"))
    most = std::max(most, place.at("probability").get<double>());
  EXPECT_GT(most, 0.0);
  EXPECT_LE(most, 0.05);
  EXPECT_GT(schedule.at("largest_speed").get<double>(), 0.0);
  EXPECT_EQ(schedule.at("looked_speed").get<double>(), 0.05);
  EXPECT_NE(done.out.find("with at least 95 % probability"), std::string::npos);
  EXPECT_NE(done.out.find("The position may move at up to"), std::string::npos);
  const auto& machines = tuned.at("machines");
  EXPECT_GE(machines.size(), 3U);  // 15 % in stretches of 5 % at most
  EXPECT_NE(text("control.h").find("position"), std::string::npos);
  EXPECT_NE(tuned.at("provenance").dump().find("rows.csv"), std::string::npos);
}

TEST_F(TuneSchedule, SaysWhatIsWrongWithTheRows) {
  EXPECT_NE(refused("--schedule none.csv").find("--schedule: none.csv: there is no such file"),
            std::string::npos);
  EXPECT_NE(refused("--schedule run.csv").find("required: rows of 'resonid track --out FILE'"),
            std::string::npos);
  write("rows.csv", rows(false));
  EXPECT_NE(refused("--schedule rows.csv").find("position_m"), std::string::npos);
  write("rows.csv", rows(true, false));
  EXPECT_NE(refused("--schedule rows.csv").find("must hold at least 10 that are trusted"), std::string::npos);
  write("rows.csv", rows());
  EXPECT_NE(refused("result.json --schedule rows.csv").find("required one"), std::string::npos);
  write("rows.csv", "time_s,b1,b1_std,position_m,trusted\n0,1,1,0.1,1\n1,1,1,0.2,1\n");
  EXPECT_NE(refused("--schedule rows.csv").find("track --method physical"), std::string::npos);
  // Its own output would overwrite it.
  EXPECT_NE(refused("--schedule rows.csv --json rows.csv").find("rows.csv"), std::string::npos);
}

TEST_F(TuneSchedule, NeedsAPositionForASpeed) {
  EXPECT_NE(refused("--speed 0.3").find("--speed: found 0.3, must come with positions"), std::string::npos);
  write("rows.csv", rows());
  EXPECT_NE(refused("--schedule rows.csv --speed 0").find("--speed: found 0, must be > 0"),
            std::string::npos);
}

TEST_F(TuneSchedule, RefusesWhatCannotExpressAScheduleBeforeItDesigns) {
  write("rows.csv", rows());
  for (const char* format : {"json", "hal"}) {
    const auto error = refused(std::string("--schedule rows.csv -v --export ") + format + ":out.txt");
    EXPECT_NE(
        error.find(std::string("--export ") + format + ": schedule: must be taken away as c, c-float or st"),
        std::string::npos)
        << error;
    EXPECT_EQ(error.find("gains over position"), std::string::npos) << error;  // the stage
  }
}

TEST_F(TuneSchedule, ClaimsNoSpeedBeyondSlowlyVaryingLoops) {
  write("rows.csv", rows());
  const auto error = refused("--schedule rows.csv --structure pi --draws 400 --speed 100");
  EXPECT_NE(error.find("--speed: found 100, must be at most"), std::string::npos) << error;
  EXPECT_NE(error.find("units of the position per s"), std::string::npos) << error;
}

TEST_F(TuneSchedule, TakesNumbersForPositions) {
  EXPECT_NE(refused("--schedule 0.4,1.2").find("must be as many as there are results"), std::string::npos);
}

}  // namespace
}  // namespace resonid
