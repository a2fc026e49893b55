// SPDX-License-Identifier: MIT
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/io/detail/table.hpp>

#include "program.hpp"

namespace resonid {
namespace {

class Excite : public test::ProgramTest {};

TEST_F(Excite, HelpAndVersion) {
  EXPECT_EQ(run("--help").exit_code, 0);
  EXPECT_NE(run("--help").out.find("simulate"), std::string::npos);
  EXPECT_EQ(run("--version").out.rfind("resonid ", 0), 0U);
  for (const char* verb :
       {"excite", "excite prbs", "excite multisine", "excite chirp", "excite stepped-sine", "simulate"}) {
    const auto help = run(std::string(verb) + " --help");
    EXPECT_EQ(help.exit_code, 0) << verb;
    EXPECT_NE(help.out.find("Example:\n  resonid " + std::string(verb)), std::string::npos) << help.out;
  }
}

TEST_F(Excite, WritesAndReportsAMultisine) {
  const auto done =
      run("excite multisine --sample-rate 2000 --lines 20:120:5 --amplitude 0.3 --periods 3 "
          "--out m.csv --json m.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("crest factor  1.78"), std::string::npos) << done.out;
  const auto told = nlohmann::json::parse(text("m.json"));
  EXPECT_EQ(told.at("kind"), "multisine");
  EXPECT_EQ(told.at("samples"), 1200);
  EXPECT_EQ(told.at("period_samples"), 400);
  EXPECT_EQ(told.at("lines_hz").size(), 21U);
  EXPECT_LE(told.at("crest_factor").get<double>(), 1.83);
  EXPECT_NEAR(told.at("rms").get<double>(), 0.3 * std::sqrt(21.0 / 2.0), 1e-9);
  EXPECT_EQ(told.at("band_hz"), (nlohmann::json{20.0, 120.0}));
  const auto table = io::read_csv(path("m.csv"));
  ASSERT_TRUE(table.has_value());
  EXPECT_EQ(table->names, (std::vector<std::string>{"time_s", "excitation"}));
  ASSERT_EQ(table->columns[1].size(), 1200U);
  EXPECT_EQ(table->columns[1][400], table->columns[1][0]);
  EXPECT_DOUBLE_EQ(table->columns[0][400], 0.2);
}

TEST_F(Excite, JsonToStandardOutputIsAlone) {
  const auto done = run("excite prbs --sample-rate 500 --register-length 17 --json -");
  const auto told = nlohmann::json::parse(done.out);
  EXPECT_EQ(told.at("period_samples"), 131071);
  EXPECT_EQ(told.at("crest_factor"), 1.0);
}

TEST_F(Excite, RepeatsSweepsAndHonoursDurations) {
  ASSERT_EQ(
      run("excite chirp --sample-rate 100 --from 1 --to 20 --duration 1 --periods 2 --out c.csv").exit_code,
      0);
  const auto chirp = io::read_csv(path("c.csv")).value().columns[1];
  ASSERT_EQ(chirp.size(), 200U);
  EXPECT_EQ(chirp[150], chirp[50]);
  ASSERT_EQ(run("excite prbs --sample-rate 100 --duration 2.5 --out p.csv").exit_code, 0);
  EXPECT_EQ(io::read_csv(path("p.csv")).value().columns[1].size(), 250U);
}

TEST_F(Excite, SameSeedSameBytes) {
  const std::string start = "excite multisine --sample-rate 500 --lines 2,3,5 --phases random --out ";
  ASSERT_EQ(run(start + "a.csv --seed 4").exit_code, 0);
  ASSERT_EQ(run(start + "b.csv --seed 4").exit_code, 0);
  ASSERT_EQ(run(start + "c.csv --seed 5").exit_code, 0);
  EXPECT_EQ(text("a.csv"), text("b.csv"));
  EXPECT_NE(text("a.csv"), text("c.csv"));
}

TEST_F(Excite, WritesRealisations) {
  const std::string start =
      "excite multisine --sample-rate 200 --lines 1:20:1 --phases random --periods-per-realisation 3 ";
  const auto done = run(start + "--realisations 4 --out r.csv --json r.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("realisations  4 of 3 periods"), std::string::npos) << done.out;
  const auto told = nlohmann::json::parse(text("r.json"));
  EXPECT_EQ(told.at("periods_per_realisation"), 3);
  EXPECT_EQ(told.at("samples"), 4 * 3 * 200);
  const auto x = io::read_csv(path("r.csv")).value().columns[1];
  ASSERT_EQ(x.size(), 2400U);
  for (std::size_t k = 0; k + 200 < x.size(); ++k) {
    const bool same_realisation = k / 600 == (k + 200) / 600;
    if (same_realisation) {
      ASSERT_EQ(x[k], x[k + 200]) << k;
    }
  }
  EXPECT_NE(x[0], x[600]);
  EXPECT_NE(x[600], x[1200]);
  // The phases told are those of the first realisation.
  double first = 0.0;
  for (const auto& p : told.at("phases_rad")) first += std::cos(p.get<double>());
  EXPECT_NEAR(x[0], first, 1e-9);
  ASSERT_EQ(run(start + "--periods 12 --out p.csv").exit_code, 0);
  EXPECT_EQ(text("p.csv"), text("r.csv"));
  expect_refused(start + "--realisations 4 --periods 2", {"--realisations", "--periods"});
  expect_refused(start + "--realisations 4 --duration 2", {"--realisations", "--duration"});
  expect_refused("excite multisine --sample-rate 200 --lines 1:20:1 --phases random --realisations 4",
                 {"--realisations", "--periods-per-realisation", "required"});
  expect_refused("excite multisine --sample-rate 200 --lines 1:20:1 --periods-per-realisation 3",
                 {"--periods-per-realisation", "--phases random"});
}

TEST_F(Excite, LeavesLinesOut) {
  const std::string start = "excite multisine --sample-rate 200 --lines 1:20:0.5 ";
  const auto odd = run(start + "--leave-out odd-random --group 5 --seed 3 --json o.json");
  ASSERT_EQ(odd.exit_code, 0) << odd.error;
  // Multiples 2 ... 40 of 0.5 Hz: 20 even ones go, and 3 of the 19 odd ones.
  EXPECT_NE(odd.out.find("left out      23 of 39 lines: 20 even and 3 odd multiples of 0.5 Hz"),
            std::string::npos)
      << odd.out;
  const auto told = nlohmann::json::parse(text("o.json"));
  EXPECT_EQ(told.at("lines_hz").size(), 16U);
  EXPECT_EQ(told.at("left_out_hz").size(), 23U);
  const auto best = run(start + "--leave-out even --phases optimised --json e.json");
  ASSERT_EQ(best.exit_code, 0) << best.error;
  EXPECT_EQ(nlohmann::json::parse(text("e.json")).at("lines_hz").size(), 19U);
  expect_refused(start + "--leave-out odd", {"--leave-out", "'odd'", "odd-random"});
  expect_refused(start + "--leave-out odd-random --group 1", {"--group", "1", ">= 2"});
  expect_refused("excite multisine --sample-rate 200 --lines 1,1.41421356237 --leave-out even",
                 {"--leave-out", "common period"});
}

TEST_F(Excite, WrongUseNamesOptionFoundAndRequired) {
  const std::string chirp = "excite chirp --sample-rate 500 --duration 17 ";
  expect_refused(chirp + "--from 300 --to 1.5", {"--from", "300", "below half the sample rate"});
  expect_refused(chirp + "--from 30 --to 30", {"--to", "30", "band is empty"});
  expect_refused(chirp + "--from abc --to 3", {"--from", "'abc'", "a number"});
  expect_refused(chirp + "--from nan --to 3", {"--from", "'nan'", "a number"});
  expect_refused(chirp + "--from 30", {"--to", "required"});
  expect_refused(chirp + "--from 30 --to 3 --swep linear",
                 {"unknown option '--swep'", "did you mean '--sweep'"});
  expect_refused(chirp + "--from 30 --to 3 --sweep lin", {"--sweep", "'lin'", "linear, logarithmic"});
  expect_refused(chirp + "--from 30 --to 3 --amplitude -1", {"--amplitude", "-1", "must be > 0"});
  expect_refused("excite chirp --from 30 --to 3 --duration 1", {"--sample-rate", "required"});
  expect_refused("excite prbs --sample-rate 500 --register-length 25",
                 {"--register-length", "25", "2 ... 24"});
  expect_refused("excite prbs --sample-rate 500 --periods 0", {"--periods", "0", ">= 1"});
  expect_refused("excite prbs --sample-rate 500 --periods 2 --duration 1", {"--periods", "--duration"});
  expect_refused("excite prbs --sample-rate 500 --duration -1", {"--duration", "-1"});
  expect_refused("excite multisine --sample-rate 500 --lines 20:10:1",
                 {"--lines", "'20:10:1'", "FIRST:LAST:STEP"});
  expect_refused("excite multisine --sample-rate 500 --lines 100:300:50", {"--lines", "250", "below half"});
  expect_refused("excite multisine --sample-rate 500", {"--lines", "required"});
  expect_refused("excite stepped-sine --sample-rate 500 --lines 5 --measure-periods 0",
                 {"--measure-periods", "1 ... 1e6"});
  expect_refused("excite prbs --sample-rate 500 --out - --json -", {"--out", "--json", "standard output"});
}

TEST_F(Excite, WrongVerbsGetASuggestion) {
  expect_refused("", {"a verb is required"});
  expect_refused("excite", {"a kind is required"});
  expect_refused("excit prbs", {"'excit'", "did you mean 'excite'"});
  expect_refused("excite chrip", {"'chrip'", "did you mean 'chirp'"});
}

TEST_F(Excite, AFileThatCannotBeWrittenIsAFailure) {
  const auto failed = run("excite prbs --sample-rate 500 --out missing/x.csv");
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_NE(failed.error.find("missing"), std::string::npos);
}

}  // namespace
}  // namespace resonid
