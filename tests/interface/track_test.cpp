// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "program.hpp"

namespace resonid {
namespace {

using Json = nlohmann::json;

/// Columns of a CSV text; an empty cell is not a number.
struct Rows {
  std::vector<std::string> names;
  std::map<std::string, std::vector<double>> column;

  explicit Rows(const std::string& text) {
    std::istringstream lines(text);
    std::string line, cell;
    std::getline(lines, line);
    for (std::istringstream cells(line); std::getline(cells, cell, ',');) names.push_back(cell);
    while (std::getline(lines, line)) {
      std::size_t i = 0, begin = 0;
      for (; i < names.size(); ++i) {
        const std::size_t end = std::min(line.find(',', begin), line.size());
        const std::string value = line.substr(begin, end - begin);
        column[names[i]].push_back(value.empty() ? std::nan("") : std::strtod(value.c_str(), nullptr));
        begin = end + 1;
      }
    }
  }
  [[nodiscard]] std::size_t size() const { return column.at("time_s").size(); }
  [[nodiscard]] const std::vector<double>& operator[](const std::string& name) const {
    return column.at(name);
  }
  [[nodiscard]] std::string header() const {
    std::string all;
    for (const auto& name : names) all += (all.empty() ? "" : ",") + name;
    return all;
  }
};

class Track : public test::ProgramTest {
 protected:
  void simulate(const std::string& experiment, const std::string& more = "") const {
    const auto done = run("simulate " + experiment + " " + more + " --out r.csv --truth truth.json");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }
  /// The controller of the tooth belt's experiments, which the margins are those of: C_pi (1 + kv Ts
  /// z/(z-1)).
  [[nodiscard]] std::string cascade(double sample_time_s = 0.004) const {
    const double proportional = 0.12 * (1.0 + sample_time_s / 0.2), outer = 1.0 + 5.0 * sample_time_s;
    const Json law = {{"numerator", {proportional * outer, -proportional - 0.12 * outer, 0.12}},
                      {"denominator", {1.0, -2.0, 1.0}}};
    write("cascade.json", law.dump());
    return "--controller cascade.json ";
  }
  [[nodiscard]] Rows rows(const std::string& arguments) const {
    const auto done = run("track r.csv --out rows.csv " + arguments);
    EXPECT_EQ(done.exit_code, 0) << done.error;
    return Rows(text("rows.csv"));
  }
};

TEST_F(Track, HelpShowsAnExampleAndTheMethods) {
  const auto help = run("track --help");
  EXPECT_EQ(help.exit_code, 0);
  for (const char* part :
       {"resonid track belt.csv --out rows.csv", "--raw-time", "--every", "--baseline", "--start", "--memory",
        "--controller", "sliding-dft", "oe, rpem, cloe, f-cloe, d-cloe", "--learn", "--whole-record",
        "--forgetting", "--extrapolate", "--friction"})
    EXPECT_NE(help.out.find(part), std::string::npos) << part;
  EXPECT_NE(run("--help").out.find("track"), std::string::npos);
}

TEST_F(Track, PhysicalRowsHoldParametersFiguresMarginsAndPosition) {
  simulate("ii_iii_tooth_prbs", "--duration 4");
  const Rows r = rows("--delay 0.004 " + cascade() + "--json t.json");
  EXPECT_EQ(r.header(),
            "time_s,driven_inertia,driven_inertia_std,load_inertia,load_inertia_std,stiffness,stiffness_std,"
            "damping,"
            "damping_std,torque_offset,torque_offset_std,resonance_hz,resonance_hz_std,antiresonance_hz,"
            "antiresonance_hz_std,crossover_hz,crossover_hz_std,phase_margin_deg,phase_margin_deg_std,"
            "modulus_margin,"
            "modulus_margin_std,position_m,trusted");
  for (const char* figure : {"crossover_hz_std", "phase_margin_deg_std", "modulus_margin_std"})
    EXPECT_GT(r[figure].back(), 0.0) << figure;
  const Json t = Json::parse(text("t.json"));
  const double learned_s = t["learned_s"];
  ASSERT_EQ(static_cast<double>(r.size()), 1000.0 - 250.0 * learned_s);
  EXPECT_GE(learned_s, 0.8);  // 200 samples
  for (const double flag : r["trusted"]) EXPECT_TRUE(flag == 0.0 || flag == 1.0);
  EXPECT_EQ(r["trusted"].back(), 1.0);
  const Rows record(text("r.csv"));  // the position is that of the time described
  const auto at = static_cast<std::size_t>(std::lround(250.0 * r["time_s"].front()));
  EXPECT_NEAR(r["position_m"].front(), record["position"].at(at), 1e-3);
  EXPECT_GT(r["stiffness_std"].back(), 0.0);

  EXPECT_EQ(t["schema"], "resonid.track/1");
  EXPECT_EQ(t["causal"], true);
  EXPECT_EQ(t["method"], "physical");
  EXPECT_EQ(t["approach"], "direct");
  EXPECT_NE(t["reason"].get<std::string>().find("two-mass"), std::string::npos);
  EXPECT_NE(t["start"].get<std::string>().find("the first"), std::string::npos);
  EXPECT_EQ(t["rows"], r.size());
  EXPECT_EQ(t["over_time"]["time_s"].size(), r.size());
  EXPECT_EQ(t["over_time"]["resonance_hz_std"].size(), r.size());
  EXPECT_NEAR(t["final"]["resonance_hz"]["value"].get<double>(), r["resonance_hz"].back(), 1e-6);
  EXPECT_EQ(t["final"]["stiffness"]["unit"], "Nm/rad");
  EXPECT_FALSE(t["final"].contains("gap"));
}

TEST_F(Track, FixedLinesHaveThreeColumnsEach) {
  simulate("iv_multisine_a", "--duration 6");
  const Rows r = rows("--method kalman --lines 2.976190476,5.952380952,8.928571429,11.9047619");
  EXPECT_EQ(
      r.header(),
      "time_s,re_2.97619,im_2.97619,std_2.97619,re_5.95238,im_5.95238,std_5.95238,re_8.92857,im_8.92857,"
      "std_8.92857,re_11.9048,im_11.9048,std_11.9048,resonance_hz,resonance_hz_std,antiresonance_hz,"
      "antiresonance_hz_std,trusted");
  EXPECT_TRUE(std::isnan(r["re_2.97619"].front()));  // not settled: unknown, and an empty cell
  EXPECT_TRUE(std::isfinite(r["re_2.97619"].back()));
}

TEST_F(Track, AChirpTellsTheFrequencyThatItDescribes) {
  simulate("vi_chirp_a");
  const Rows r = rows("--method kalman --chirp 35:1.5:17 --delay 0.004 --controller pi:1.036,0.147");
  EXPECT_EQ(
      r.header(),
      "time_s,frequency_hz,real,imag,std,resonance_hz,resonance_hz_std,antiresonance_hz,antiresonance_hz_std,"
      "crossover_hz,crossover_hz_std,phase_margin_deg,phase_margin_deg_std,modulus_margin,modulus_margin_std,"
      "trusted");
  const std::size_t k = 5000;
  EXPECT_NEAR(r["frequency_hz"][k], 35.0 - 33.5 / 17.0 * r["time_s"][k], 1e-6);
  // On the described time the response at the resonance's flank is near the truth; the truth is the
  // simulator's.
  const Json truth = Json::parse(text("truth.json"));
  const auto& f = truth["frequency_response"]["frequency_hz"];
  std::size_t i = 0;
  while (i + 1 < f.size() && f[i].get<double>() < r["frequency_hz"][k]) ++i;
  const double re = truth["frequency_response"]["real"][i], im = truth["frequency_response"]["imag"][i];
  EXPECT_NEAR(std::hypot(r["real"][k], r["imag"][k]) / std::hypot(re, im), 1.0, 0.15);
  // What the sweep has not passed yet is known by the model alone, and as badly as its error bar says.
  const double crossover = truth["loop"]["crossover_hz"];
  EXPECT_NEAR(r["crossover_hz"][k], crossover, 3.0 * r["crossover_hz_std"][k]);
  EXPECT_NEAR(r["crossover_hz"].back(), crossover, 3.0 * r["crossover_hz_std"].back());
  EXPECT_GT(r["crossover_hz_std"][k], 5.0 * r["crossover_hz_std"].back());
}

TEST_F(Track, DiscreteModelsHaveTheirCoefficients) {
  simulate("ii_iii_tooth_prbs", "--duration 4");
  for (const char* method : {"arx", "oe", "rpem", "cloe", "d-cloe", "iv", "iv --extrapolate"}) {
    const Rows r = rows(std::string("--delay 0.004 ") + cascade() + "--method " + method);
    EXPECT_EQ(r.header().substr(0, r.header().find("resonance_hz")),
              "time_s,b1,b1_std,b2,b2_std,b3,b3_std,a1,a1_std,a2,a2_std,a3,a3_std,")
        << method;
    EXPECT_NEAR(r["a1"].back() + r["a2"].back() + r["a3"].back(), -1.0, 1e-6) << method;  // an integrator
  }
}

TEST_F(Track, DescribedTimeIsTheNewestLessTheLag) {
  simulate("ii_iii_tooth_prbs", "--duration 4");
  const std::string options = "--delay 0.004 " + cascade() + "--method iv --json t.json";
  const Rows described = rows(options);
  const Json t = Json::parse(text("t.json"));
  const Rows raw = rows(options + " --raw-time");
  ASSERT_EQ(described.size(), raw.size());
  for (std::size_t k = 500; k < raw.size(); k += 50) {
    EXPECT_NEAR(raw["time_s"][k], t["learned_s"].get<double>() + 0.004 * static_cast<double>(k), 1e-9);
    const double lag = t["over_time"]["lag_s"][k];
    EXPECT_GT(lag, 0.05);
    EXPECT_NEAR(raw["time_s"][k] - described["time_s"][k], lag,
                0.02);  // time does not turn back for a lag that grows
    EXPECT_EQ(raw["resonance_hz"][k], described["resonance_hz"][k]);
  }
  EXPECT_TRUE(std::is_sorted(described["time_s"].begin(), described["time_s"].end()));
}

TEST_F(Track, EveryNthSampleMakesARow) {
  simulate("ii_iii_tooth_prbs", "--duration 4");
  const Rows all = rows("--delay 0.004");
  const Rows few = rows("--delay 0.004 --every 7");
  const std::size_t learned = 1000 - all.size(), first = (learned + 7) / 7 * 7 - 1 - learned;
  ASSERT_EQ(few.size(), 1000 / 7 - learned / 7);
  for (std::size_t n = 0; n < few.size(); ++n) {
    EXPECT_EQ(few["time_s"][n], all["time_s"][7 * n + first]);
    EXPECT_EQ(few["stiffness"][n], all["stiffness"][7 * n + first]);
  }
}

TEST_F(Track, ABaselineGivesTheGapAndTheStart) {
  simulate("iv_multisine_a", "--duration 6");
  ASSERT_EQ(run("identify r.csv --json base.json").exit_code, 0);
  const Rows same = rows("--baseline base.json --drift 0 --json t.json --every 50");
  EXPECT_EQ(same.names[same.names.size() - 3], "gap");
  EXPECT_EQ(same.names[same.names.size() - 2], "gap_std");
  EXPECT_LT(same["gap"].back(), 0.1);
  EXPECT_EQ(Json::parse(text("t.json"))["start"], "the baseline's model");
  simulate("iv_multisine_b", "--duration 6");
  EXPECT_GT(rows("--baseline base.json --every 50")["gap"].back(), 0.4);
}

TEST_F(Track, OfAnotherSampleRateTheBaselineCountsAllTheSame) {
  simulate("ii_iii_tooth_prbs_2ms", "--duration 2");
  ASSERT_EQ(run("identify r.csv --to 1 --delay 0.002 --json base.json").exit_code, 0);
  simulate("ii_iii_tooth_prbs", "--duration 2");
  const Rows r = rows("--delay 0.004 --drift 0 --start base.json --baseline base.json");
  EXPECT_LT(r["gap"][40], 0.1);  // the cart still rests
}

TEST_F(Track, StandardOutputIsAlone) {
  simulate("ii_iii_tooth_prbs", "--duration 2");
  const auto out = run("track r.csv --delay 0.004 --out -");
  EXPECT_EQ(out.out.substr(0, 7), "time_s,");
  const Json t = Json::parse(run("track r.csv --delay 0.004 --json -").out);
  EXPECT_GT(t["rows"], 0);
  EXPECT_EQ(std::count(out.out.begin(), out.out.end(), '\n'), 1 + t["rows"].get<int>());
}

TEST_F(Track, ThePageStandsAlone) {
  simulate("ii_iii_tooth_prbs", "--duration 4");
  ASSERT_EQ(run("track r.csv --delay 0.004 " + cascade() + "--report p.html").exit_code, 0);
  const std::string page = text("p.html");
  for (const char* part :
       {"resonid \xC2\xB7 tracking", "Over position", "Nyquist curve of the loop along the recording",
        "modulus margin", "Rows after the start that passed", "Input and output",
        "resonid track r.csv --delay 0.004", "SHA-256 "})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_EQ(page.find("http://"), std::string::npos);
  EXPECT_LT(page.size(), 2'800'000U);
}

TEST_F(Track, WithoutExcitationTheDirectMethodsRemain) {
  simulate("ii_iii_tooth_prbs", "--duration 4");
  const Json truth = Json::parse(text("truth.json"));
  const Rows full(text("r.csv"));
  std::string without = "time_s,u,y\n";
  for (std::size_t k = 0; k < full.size(); ++k)
    without += std::to_string(full["time_s"][k]) + "," + std::to_string(full["u"][k]) + "," +
               std::to_string(full["y"][k]) + "\n";
  write("r.csv", without);
  expect_refused("track r.csv --method iv --controller pi:0.12,0.2",
                 {"--excitation", "iv needs the excitation"});
  const Rows r = rows("--delay 0.004");
  const double true_hz = truth["over_time"]["resonance_hz"].back();
  EXPECT_NEAR(r["resonance_hz"].back(), true_hz, 0.02 * true_hz);
}

TEST_F(Track, WrongUseNamesWhatWasFoundAndWhatIsRequired) {
  simulate("ii_iii_tooth_prbs", "--duration 2");
  expect_refused("track", {"RECORD"});
  expect_refused("track missing.csv", {"missing.csv"});
  expect_refused("track r.csv --method rls",
                 {"--method", "'rls'", "arx, oe, rpem, cloe, f-cloe, d-cloe, iv, physical"});
  expect_refused("track r.csv --every 0", {"--every", "found 0", ">= 1"});
  expect_refused("track r.csv --every 501", {"--every", "500 samples", "found 501"});
  expect_refused("track r.csv --memory 0", {"--memory", "found 0", "> 0"});
  expect_refused("track r.csv --memory 0.01 --method arx", {"--memory", "4 samples", "0.01 s"});
  expect_refused("track r.csv --drift -1", {"--drift", "0 1/s or more", "-1"});
  expect_refused("track r.csv --method cloe", {"--controller", "cloe needs the controller"});
  expect_refused("track r.csv --method iv", {"--controller", "iv needs the controller"});
  expect_refused("track r.csv --method arx --approach joint", {"--approach", "arx is direct", "joint"});
  expect_refused("track r.csv --method iv --delay 0.004 --controller pi:100,0.0001",
                 {"--controller", "unstable"});
  expect_refused("track r.csv --method kalman", {"--lines", "no period"});
  expect_refused("track r.csv --method kalman --lines 10,10:200:10", {"--lines"});
  expect_refused("track r.csv --learn 0.001", {"--learn", "4 samples", "0.001 s"});
  expect_refused("track r.csv --learn 1 --whole-record", {"--learn", "--whole-record"});
  expect_refused("track r.csv --learn 3 --delay 0.004", {"--learn", "too early to start"});
  expect_refused("track r.csv --method physical --forgetting none", {"--forgetting", "arx, oe", "physical"});
  expect_refused("track r.csv --method arx --extrapolate", {"--extrapolate", "iv", "arx"});
  expect_refused("track r.csv --method oe --friction dry", {"--friction", "arx, iv and physical", "oe"});
  expect_refused("track r.csv --raw-times", {"--raw-times", "did you mean '--raw-time'"});
  expect_refused("track r.csv --out a --json a", {"--json", "'a'", "a file of its own"});
  expect_refused("track r.csv --out - --json -", {"--out", "--json", "standard output"});
}

TEST_F(Track, BrokenModelsAreNamedWithTheirPlace) {
  simulate("ii_iii_tooth_prbs", "--duration 2");
  expect_refused("track r.csv --start none.json", {"--start", "none.json", "no such file"});
  write("broken.json", "{");
  expect_refused("track r.csv --baseline broken.json", {"--baseline", "broken.json", "not valid JSON"});
  write("other.json", R"({"schema": "resonid.truth/1"})");
  expect_refused("track r.csv --baseline other.json", {"--baseline", "$.schema", "resonid.identification/1"});
  ASSERT_EQ(run("identify r.csv --model none --json plain.json").exit_code, 0);
  expect_refused("track r.csv --start plain.json", {"--start", "'plain.json'", "no model"});
  EXPECT_FALSE(std::filesystem::exists(path("rows.csv")));
}

TEST_F(Track, TooShortARecordSaysSo) {
  simulate("ii_iii_tooth_prbs", "--duration 2");
  const std::string all = text("r.csv");
  std::size_t end = 0;
  for (int line = 0; line < 25; ++line) end = all.find('\n', end) + 1;
  write("short.csv", all.substr(0, end));
  expect_refused("track short.csv --out rows.csv", {"--method", "nothing to track", "24 samples"});
  EXPECT_FALSE(std::filesystem::exists(path("rows.csv")));
}

TEST_F(Track, RowsThatAreNotToBeTrustedEndWithThree) {
  simulate("ii_iii_tooth_prbs_2ms", "--duration 4");
  const auto cloe =
      run("track r.csv --delay 0.002 " + cascade(0.002) + "--method cloe --require-trusted --json t.json");
  EXPECT_EQ(cloe.exit_code, 3);
  EXPECT_EQ(Json::parse(text("t.json"))["trusted"], false);
  EXPECT_EQ(run("track r.csv --delay 0.002 --require-trusted").exit_code, 0);
}

/// What a line of a CSV text begins with counts: rows are compared as they are written.
TEST_F(Track, ARecordCutAtAnyRowGivesTheSameRowsUntilThere) {
  simulate("ii_iii_tooth_prbs", "--duration 4");
  const std::string record = text("r.csv");
  for (const char* method : {"auto", "iv", "d-cloe"}) {
    const std::string arguments = "--out rows.csv --delay 0.004 " + cascade() + "--method " + method;
    ASSERT_EQ(run("track r.csv " + arguments).exit_code, 0) << method;
    const std::string whole = text("rows.csv");
    for (const int samples : {700, 701, 999}) {
      std::size_t end = 0;
      for (int line = 0; line < samples + 1; ++line) end = record.find('\n', end) + 1;
      write("cut.csv", record.substr(0, end));
      ASSERT_EQ(run("track cut.csv " + arguments).exit_code, 0) << method;
      const std::string cut = text("rows.csv");
      EXPECT_GT(cut.size(), whole.size() / 4) << method;
      EXPECT_EQ(cut, whole.substr(0, cut.size())) << method << ", " << samples << " samples";
    }
  }
}

TEST_F(Track, TheWholeRecordIsLearnedFromWhenAsked) {
  simulate("ii_iii_tooth_prbs", "--duration 4");
  const Rows r = rows("--delay 0.004 --whole-record --json t.json");
  const Json t = Json::parse(text("t.json"));
  EXPECT_EQ(r.size(), 1000U);
  EXPECT_EQ(t["causal"], false);
  EXPECT_NE(t["findings"].dump().find("whole-record"), std::string::npos);
}

TEST_F(Track, WhatCannotBeWrittenIsToldBeforeTheRecordIsRead) {
  const auto failed = run("track missing.csv --out nowhere/rows.csv");
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_NE(failed.error.find("nowhere"), std::string::npos);
  for (const char* verb : {"identify missing.csv --json nowhere/x", "simulate missing.toml --out nowhere/x",
                           "excite prbs --sample-rate 500 --out nowhere/x"}) {
    const auto outcome = run(verb);
    EXPECT_EQ(outcome.exit_code, 1) << verb;
    EXPECT_NE(outcome.error.find("nowhere"), std::string::npos) << verb << outcome.error;
  }
}

}  // namespace
}  // namespace resonid
