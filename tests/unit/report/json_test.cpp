// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <resonid/report/json.hpp>
#include <set>
#include <sstream>

#include "results.hpp"

namespace resonid::report {
namespace {

using identification::Result;
using nlohmann::json;
using test::bare;
using test::distorted;
using test::full;
using test::two_mass;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::set<std::string> keys(const json& object) {
  std::set<std::string> names;
  for (const auto& [key, value] : object.items()) names.insert(key);
  return names;
}

bool holds_null(const json& j) {
  return j.is_null() || (j.is_structured() &&
                         std::any_of(j.begin(), j.end(), [](const json& part) { return holds_null(part); }));
}

TEST(Json, HoldsWhatTheInterfaceNames) {
  const json j = to_json(full());
  for (const char* key : {"schema", "record", "method", "approach", "frequency_response", "resonances",
                          "model", "loop", "validation", "trusted", "findings"})
    EXPECT_TRUE(j.contains(key)) << key;
  EXPECT_EQ(j.at("schema"), "resonid.identification/1");
  EXPECT_EQ(j.at("record").at("signals"),
            (json{{"time", "t"}, {"input", "u"}, {"output", "y"}, {"excitation", "ru"}, {"reference", "r"}}));
  EXPECT_EQ(keys(j.at("frequency_response")),
            (std::set<std::string>{"frequency_hz", "real", "imag", "std", "coherence"}));
  EXPECT_EQ(j.at("frequency_response").at("imag"), (json{-2.0, -1.0, -0.5}));
  EXPECT_EQ(j.at("resonances")[0], (json{{"kind", "antiresonance"},
                                         {"frequency_hz", 10.67},
                                         {"std_hz", 0.03},
                                         {"damping_ratio", 0.07},
                                         {"source", "model"}}));
  EXPECT_EQ(
      keys(j.at("model").at("parameters")),
      (std::set<std::string>{"driven_inertia", "load_inertia", "stiffness", "damping", "delay", "offset"}));
  EXPECT_EQ(j.at("model").at("parameters").at("stiffness"),
            (json{{"value", 143.75}, {"std", 1e-4}, {"unit", "Nm/rad"}}));
  EXPECT_EQ(j.at("model").at("transfer_function").at("sample_time_s"), 0.002);
  EXPECT_EQ(j.at("loop").at("crossover_hz"), 2.7);
  EXPECT_EQ(j.at("loop").at("phase_margin_deg"), 63.5);
  EXPECT_EQ(j.at("loop").at("gain_margin_db"), 19.2);
  EXPECT_EQ(j.at("validation").at("limit"), 0.0235);
  EXPECT_EQ(j.at("findings")[0], (json{{"id", "low-coherence"},
                                       {"severity", "warning"},
                                       {"value", 0.4},
                                       {"threshold", 0.8},
                                       {"meaning", "Coherence falls."}}));
  EXPECT_FALSE(holds_null(j));
}

TEST(Json, WhatWasNotComputedIsAbsent) {
  const json j = to_json(bare());
  for (const char* key : {"model", "loop", "validation", "known_delay_s", "distortion"})
    EXPECT_FALSE(j.contains(key)) << key;
  EXPECT_EQ(keys(j.at("frequency_response")), (std::set<std::string>{"frequency_hz", "real", "imag"}));
  EXPECT_FALSE(j.at("record").at("signals").contains("excitation"));
  EXPECT_EQ(j.at("resonances"), json::array());
  EXPECT_EQ(j.at("findings"), json::array());
}

/// JSON knows no infinity: nlohmann would write null.
TEST(Json, WhatIsNotFiniteIsAbsent) {
  auto r = full();
  r.modes[0].frequency_hz.std = kNan;
  r.modes[1].damping_ratio.value = kInfinity;
  r.model->drive.covariance(fit::kStiffness, fit::kStiffness) = kInfinity;
  r.loop->margins.gain_margin_db = kInfinity;
  r.loop->phase_margin_std_deg = kNan;
  r.findings[0].value = kNan;
  const json j = json::parse(to_json(r).dump());
  EXPECT_FALSE(holds_null(j)) << j.dump(1);
  EXPECT_FALSE(j.at("resonances")[0].contains("std_hz"));
  EXPECT_FALSE(j.at("model").at("parameters").at("stiffness").contains("std"));
  EXPECT_FALSE(j.at("loop").contains("gain_margin_db"));
}

TEST(Json, ARigidDriveHasItsOwnParameters) {
  auto r = full();
  r.modes.clear();
  r.model->drive = {};
  r.model->drive.structure = fit::Structure::rigid;
  r.model->drive.parameters.driven_inertia = 0.064;
  r.model->drive.sample_time_s = 0.002;
  r.model->drive.estimated = fit::estimated_parameters(fit::Structure::rigid, true, false);
  r.model->coulomb_friction = data::Estimate{0.2, 0.01};
  const json parameters = to_json(r).at("model").at("parameters");
  EXPECT_EQ(keys(parameters),
            (std::set<std::string>{"driven_inertia", "viscous_friction", "coulomb_friction", "offset"}));
  EXPECT_EQ(parameters.at("coulomb_friction").at("unit"), "Nm");
}

TEST(Json, RadiusAddsTheBelt) {
  auto r = full();
  r.radius_m = 0.05;
  const json parameters = to_json(r).at("model").at("parameters");
  EXPECT_NEAR(parameters.at("belt_stiffness").at("value").get<double>(), 57500.0, 1e-6);
  EXPECT_NEAR(parameters.at("belt_damping").at("value").get<double>(), 120.0, 1e-9);
  EXPECT_EQ(parameters.at("belt_damping").at("unit"), "Ns/m");
}

TEST(Summary, IsNoWiderThanATerminal) {
  auto r = full();
  r.radius_m = 0.05;
  std::string meaning = "Words";
  for (int i = 0; i < 60; ++i) meaning += " of length";
  r.findings[0].meaning = meaning;
  const std::string text = summary_text(r);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
  for (const char* word : {"bench.csv", "two-mass", "15.09", "phase margin 63.5", "stiffness", "Nm/rad",
                           "warning", "low-coherence", "Trusted."})
    EXPECT_NE(text.find(word), std::string::npos) << word << "\n" << text;
  for (const char* word : {"null", " nan", " inf"}) EXPECT_EQ(text.find(word), std::string::npos) << text;
}

TEST(Json, DistortionHasWhatWasFound) {
  auto r = distorted();
  const json both = to_json(r).at("distortion");
  EXPECT_EQ(both.at("realisations"), 8);
  EXPECT_EQ(both.at("distortion_std"), (json{0.1, 0.0, 0.05}));
  EXPECT_EQ(both.at("scatter").at("level"), 0.12);
  EXPECT_EQ(both.at("detection_lines").at("even").at("significant"), false);
  r.distortion->realisations = 0;
  r.distortion->even = {};
  const json silent = to_json(r).at("distortion");
  EXPECT_EQ(keys(silent), (std::set<std::string>{"detection_lines"}));
  EXPECT_EQ(keys(silent.at("detection_lines")), (std::set<std::string>{"odd"}));
}

TEST(Summary, TellsOfDistortion) {
  const std::string text = summary_text(distorted());
  for (const char* words : {"by 8 realisations 12 % of the output", "40 even lines",
                            "beyond the noise (0.2 %)", "12 odd lines", "8 % of the output"})
    EXPECT_NE(text.find(words), std::string::npos) << words << "\n" << text;
}

TEST(Summary, DistrustIsPlain) {
  auto r = bare();
  r.findings = {{"incoherent", diagnostics::Severity::error, 0.0, 0.05, "No line is coherent."}};
  const std::string text = summary_text(r);
  EXPECT_NE(text.find("NOT trusted"), std::string::npos) << text;
  EXPECT_NE(text.find("ERROR: No line is coherent. (incoherent)"), std::string::npos) << text;
  EXPECT_EQ(text.find("Parameters"), std::string::npos) << text;
}

TEST(Sentences, SayTheMostImportantFirst) {
  auto list = sentences(full());
  ASSERT_EQ(list.size(), 3U);
  EXPECT_NE(list[0].find("two-inertia (two-mass) drive"), std::string::npos) << list[0];
  EXPECT_NE(list[0].find("10.67"), std::string::npos) << list[0];
  EXPECT_NE(list[1].find("crossover 2.7 Hz"), std::string::npos) << list[1];
  EXPECT_NE(list[1].find("minimum distance to -1 (modulus margin) 0.85"), std::string::npos) << list[1];
  EXPECT_NE(list[1].find("Ms 1.18"), std::string::npos) << list[1];
  EXPECT_NE(list[2].find("92 % (NRMSE)"), std::string::npos) << list[2];
  auto r = bare();
  EXPECT_NE(sentences(r)[0].find("no resonance"), std::string::npos);
  r.modes = {{false, {15.2, kNan}, {kNan, kNan}, false}};
  EXPECT_NE(sentences(r)[0].find("a resonance at 15.2 Hz"), std::string::npos) << sentences(r)[0];
}

}  // namespace
}  // namespace resonid::report
