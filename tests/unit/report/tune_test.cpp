// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/io/controller_file.hpp>
#include <resonid/report/detail/page.hpp>
#include <resonid/report/detail/tune.hpp>
#include <sstream>

#include "tunings.hpp"

namespace resonid::report {
namespace {

using identification::Tuning;
using nlohmann::json;

/// The least that a tuning holds.
Tuning least_tuning() {
  Tuning t;
  t.sample_time_s = 0.002;
  t.units = test::bare().units;
  identification::TunedController c;
  c.structure = "rst";
  c.name = "RST";
  c.feedback = {{1.0, -0.9}, {1.0, -1.0}, 0.002};
  t.candidates = {c};
  return t;
}

std::string text_of(const std::vector<std::string>& list) {
  std::string text;
  for (const auto& s : list) text += s + "\n";
  return text;
}

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

const Chart* chart_of(const Document& d, const std::string& title) {
  for (const auto& section : d.sections)
    for (const auto& chart : section.charts)
      if (chart.title == title) return &chart;
  return nullptr;
}

Table figure_table_of(const Document& d) {
  for (const auto& section : d.sections)
    if (section.title == "What the loop does") return section.plain_tables.front();
  return {};
}

Tuning several_crossings() {
  auto t = test::tuning();
  t.candidates.front().crossings = {{{7.18, 75.6, true}, 7.13, 7.21, 74.1, 77.0, 73.9},
                                    {{12.6, -166.4, false}, 12.2, 13.1, -171.0, -162.0, -161.5},
                                    {{25.2, 49.8, true}, 24.8, 25.6, 41.6, 58.1, 41.2}};
  return t;
}

/// The lines of that table but its head, each with single spaces.
std::vector<std::string> crossing_rows(const std::string& text) {
  std::istringstream lines(text.substr(text.find("\nCrossings of |L| = 1") + 1));
  std::vector<std::string> rows;
  std::string line, word;
  for (int skipped = 0; std::getline(lines, line) && !line.empty(); ++skipped) {
    if (skipped < 2) continue;
    std::istringstream words(line);
    std::string row;
    while (words >> word) row += (row.empty() ? "" : " ") + word;
    rows.push_back(row);
  }
  return rows;
}

TEST(TuneJson, GivesBackWhatWasWritten) {
  for (const auto& t :
       {test::tuning(), test::full_tuning(), test::evaluation(), test::checked(), least_tuning()}) {
    const json j = to_json(t);
    const auto again = from_json<Tuning>(j);
    ASSERT_TRUE(again) << message_of(again.error());
    EXPECT_EQ(to_json(*again), j);
  }
}

TEST(TuneJson, KeepsWhatIsNotFiniteAndLargeSeeds) {
  auto t = test::tuning();
  t.options.largest_load_transfer = std::numeric_limits<double>::infinity();
  t.options.seed = 18'000'000'000'000'000'000U;
  t.options.guarantee = identification::Guarantee::ellipsoid;
  t.candidates[0].curves.sensitivity.high[3] = std::nan("");
  t.candidates[0].figures[0].value = std::numeric_limits<double>::infinity();
  t.over_sensitivity[1].load_transfer = std::numeric_limits<double>::infinity();
  const auto again = from_json<Tuning>(to_json(t));
  ASSERT_TRUE(again) << message_of(again.error());
  EXPECT_TRUE(std::isinf(again->options.largest_load_transfer));
  EXPECT_EQ(again->options.seed, 18'000'000'000'000'000'000U);
  EXPECT_EQ(again->options.guarantee, identification::Guarantee::ellipsoid);
  EXPECT_TRUE(std::isnan(again->candidates[0].curves.sensitivity.high[3]));
  EXPECT_EQ(again->candidates[0].curves.sensitivity.high[4], t.candidates[0].curves.sensitivity.high[4]);
  EXPECT_FALSE(std::isfinite(again->candidates[0].figures[0].value));
  EXPECT_TRUE(std::isinf(again->over_sensitivity[1].load_transfer));
}

TEST(TuneJson, KeepsMachineAndController) {
  const auto t = test::full_tuning();
  const auto again = from_json<Tuning>(to_json(t));
  ASSERT_TRUE(again) << message_of(again.error());
  const auto& m = again->machines.at(0);
  EXPECT_EQ(m.parameters.stiffness, t.machines[0].parameters.stiffness);
  EXPECT_EQ(m.known_delay_s, test::kDelay_s);
  EXPECT_DOUBLE_EQ(m.estimate(fit::kStiffness).std, t.machines[0].estimate(fit::kStiffness).std);
  EXPECT_NEAR(m.resonance().std, t.machines[0].resonance().std, 1e-12);
  const auto& c = again->proposed();
  EXPECT_EQ(c.gains->biquads.at(0).denominator_damping, 0.6);
  EXPECT_EQ(c.feedback.numerator, t.proposed().feedback.numerator);
  EXPECT_EQ(c.crossings.at(0).phase_margin_worst_deg, 60.1);
  EXPECT_EQ(c.crossings[0].frequency_high_hz, 5.2);
  EXPECT_EQ(c.curves.loop, t.proposed().curves.loop);
  EXPECT_EQ(c.curves.ellipses.at(2).covariance, t.proposed().curves.ellipses[2].covariance);
  EXPECT_EQ(again->schedule->nodes.at(2).ki, 17.5);
  EXPECT_EQ(again->schedule->places.at(2).probability, 0.047);
  EXPECT_EQ(again->schedule->probability(), 0.047);
  EXPECT_EQ(again->schedule->set_point_weight, 0.8);
  EXPECT_EQ(again->second_shaped_mode->frequency_hz, 41.0);
  EXPECT_EQ(again->proposed().feed_forward->coulomb, 0.4);
  EXPECT_EQ(again->proposed().feed_forward->delay_s, 0.004);
  EXPECT_EQ(*again->schedule->largest_speed, 1.25);
  EXPECT_EQ(again->shapers.at(1).times_s, t.shapers[1].times_s);
  EXPECT_EQ(again->simulated.at(0).velocity, t.simulated[0].velocity);
}

/// The file, and what controller_json() makes, are what a controller is read from.
TEST(TuneJson, ServesAsAControllerFile) {
  const auto t = test::tuning();
  for (const auto& text : {to_json(t).dump(), controller_json(t.proposed()).dump()}) {
    const auto read = io::read_controller(text, 0.002);
    ASSERT_TRUE(read) << message_of(read.error());
    EXPECT_EQ(read->numerator, t.proposed().feedback.numerator);
    EXPECT_EQ(read->denominator, t.proposed().feedback.denominator);
    EXPECT_FALSE(io::read_controller(text, 0.001));
  }
  EXPECT_FALSE(controller_json(t.proposed()).contains("reference_numerator"));
  auto least = least_tuning();
  least.candidates[0].reference_numerator = {0.5};
  EXPECT_EQ(controller_json(least.proposed()).at("reference_numerator"), json({0.5}));
  EXPECT_EQ(to_json(least).at("reference_numerator"), json({0.5}));
  EXPECT_EQ(io::read_controller(to_json(least).dump(), 0.002)->reference_numerator,
            std::vector<double>({0.5}));
}

TEST(TuneJson, WritesAControllerThatMayBeTakenAway) {
  auto t = least_tuning();
  t.candidates[0].stable = true;
  t.trusted = true;
  EXPECT_EQ(controller_json(t).value(), controller_json(t.proposed()));
  t.trusted = false;
  t.input_scale = 2.0;
  EXPECT_TRUE(controller_json(t)->contains("warning"));
  EXPECT_EQ(controller_json(t)->at("recorded_units").at("gain"), 2.0);
  t.options.positions = {0.0, 1.0};
  EXPECT_EQ(controller_json(t).error().field, "schedule");
  t.options.positions.clear();
  t.candidates[0].stable = false;
  EXPECT_EQ(controller_json(t).error().field, "evaluate");
}

TEST(TuneJson, TellsTheCoefficientsOfBiquads) {
  const json j = to_json(test::tuning());
  const json& b = j.at("candidates").at(0).at("gains").at("biquads").at(0);
  // The biquad alone: what test::feedback_of() gives beside a PI that is 1.
  auto alone = test::feedback_of({1.0, 0.0, {{151.0, 1.2, 0.6}}});
  const std::vector<double> numerator = b.at("b"), denominator = b.at("a");
  for (const double z : {0.3, -0.7, 2.0}) {
    const auto at = [&](const std::vector<double>& c) {
      double sum = 0.0;
      for (std::size_t i = c.size(); i-- > 0;) sum = sum * z + c[i];
      return sum;
    };
    EXPECT_NEAR(at(numerator) / at(denominator), at(alone.numerator) / at(alone.denominator), 1e-9);
  }
}

TEST(TuneJson, NamesWhatIsWrong) {
  const auto message = [](const char* pointer, const json& value) {
    json j = to_json(test::full_tuning());
    j[json::json_pointer(pointer)] = value;
    const auto read = from_json<Tuning>(j);
    return read ? std::string("nothing is wrong") : message_of(read.error());
  };
  EXPECT_EQ(message("/candidates", json::array()),
            "$.candidates: found an array of 0, required at least one controller");
  EXPECT_EQ(message("/wanted/guarantee", "sure"),
            "$.wanted.guarantee: found \"sure\", required one of \"probability\", \"ellipsoid\"");
  EXPECT_EQ(message("/machines/0/structure", "black-box"),
            "$.machines[0].structure: found \"black-box\", required one of \"rigid\", \"two-mass\", "
            "\"three-mass\"");
  EXPECT_EQ(
      message("/candidates/0/curves/loop_imag", json{1.0}),
      "$.candidates[0].curves.loop_imag: found an array of 1, required as many numbers as loop_real has");
}

TEST(TuneText, SaysTheVerdictFirst) {
  const auto t = test::tuning();
  const auto list = sentences(t);
  EXPECT_EQ(
      list.at(0),
      "PI + 1 biquad keeps every bound (|S| <= 1.40, |T_load| <= 1.30) with at least 95 % probability: "
      "of 10 000 machines that the identification leaves possible, 4.2 % exceed one, none is unstable.");
  EXPECT_EQ(list.at(1),
            "Gains: kp 2.20 Nm/(rad/s), ki 20.4 Nm/rad (Ti 108 ms), set-point weight b 0.5. Biquad 1 (lead): "
            "151 Hz, damping 1.20 over 0.600, +6.0 dB there.");
  auto none = t;
  none.candidates.front().exceeding = 0;
  EXPECT_TRUE(holds(sentences(none).front(), "leaves possible, none exceeds one, none is unstable."));
}

/// 1 Nm is 2.5 A and 1 rad/s is 9.549 rpm: 2.20 Nm/(rad/s) are 2.20 * 2.5/9.549 = 0.576 A/rpm.
TEST(TuneText, TellsGainsInTheUnitsOfTheRecording) {
  auto t = test::tuning();
  EXPECT_TRUE(holds(text_of(sentences(t)),
                    "In the recording's own units: kp 0.576 A/rpm, ki 5.34 A/(rpm s) (Ti 108 ms), set-point "
                    "weight b 0.5."));
  EXPECT_TRUE(holds(text_of(sentences(t)),
                    "in the recording's own units kp 0.288 A/rpm, ki 1.34 A/(rpm s) (Ti 216 ms). Record"));
  const auto scale = to_json(t).at("scale");
  EXPECT_NEAR(scale.at("kp").get<double>(), 2.2 * 2.5 * kTwoPi / 60.0, 1e-12);
  EXPECT_NEAR(scale.at("first_ki").get<double>(), 0.25 * 20.4 * 2.5 * kTwoPi / 60.0, 1e-12);
  EXPECT_EQ(scale.at("kp_unit"), "A/rpm");
  EXPECT_FALSE(scale.contains("kd"));
  t.input_unit = t.output_unit = "";
  EXPECT_TRUE(holds(text_of(sentences(t)), "own units: kp 0.576, ki 5.34 (Ti 108 ms)"));
  t.input_scale = t.output_scale = 1.0;
  EXPECT_FALSE(holds(text_of(sentences(t)), "own units"));
  EXPECT_FALSE(to_json(t).contains("scale"));
}

/// A factor of a recording touches torque and velocity: not kv, not times.
TEST(TuneText, TellsEveryGainInTheUnitsOfTheRecording) {
  auto t = test::tuning();
  auto& c = t.candidates.front();
  c.derivative_gain = 0.011;
  c.derivative_time_s = 0.004;
  // 0.011 Nm/(rad/s2) are 0.011 * 2.5/9.549 = 0.00288 A s/rpm; 0.011/2.2 = 5 ms.
  EXPECT_TRUE(holds(text_of(sentences(t)), "kd 0.0110 Nm/(rad/s2) (Td 5.00 ms) filtered with 4.00 ms"));
  EXPECT_TRUE(holds(text_of(sentences(t)), "kd 0.00288 A s/rpm (Td 5.00 ms) filtered with 4.00 ms"));
  EXPECT_NEAR(to_json(t).at("scale").at("kd").get<double>(), 0.011 * 2.5 * kTwoPi / 60.0, 1e-12);
  c.derivative_gain = c.derivative_time_s = std::nullopt;
  c.position_gain = 8.1;
  EXPECT_TRUE(holds(text_of(sentences(t)), "ki 5.34 A/(rpm s) (Ti 108 ms), position gain kv 8.10 1/s"));
  EXPECT_TRUE(
      holds(text_of(sentences(t)), "ki 1.34 A/(rpm s) (Ti 216 ms), position gain kv 4.05 1/s. Record"));
  c.position_gain.reset();
  c.gains.reset();
  EXPECT_TRUE(holds(text_of(sentences(t)), "own units (A/rpm): its numerator times 0.262."));
  // A linear axis in volts.
  t = test::tuning();
  t.units.input = "N";
  t.units.velocity = "m/s";
  t.input_unit = "V";
  t.output_unit = "mm/s";
  t.input_scale = 0.1;
  t.output_scale = 1000.0;
  EXPECT_TRUE(holds(text_of(sentences(t)), "kp 2.20 N/(m/s), ki 20.4 N/m (Ti 108 ms)"));
  EXPECT_TRUE(holds(text_of(sentences(t)), "own units: kp 0.000220 V/(mm/s), ki 0.00204 V/mm (Ti 108 ms)"));
}

TEST(TuneText, TellsTheStatesOfAStateFeedbackAndWhatToBeginWith) {
  auto t = test::tuning();
  auto pi = t.candidates.front();
  pi.structure = "pi";
  auto& c = t.candidates.front();
  c.structure = "state-feedback";
  c.name = "State feedback";
  c.gains.reset();
  c.states = {{"velocity of the load", "rad/s", 1.25, 0.5},
              {"twist of the coupling", "rad", -3.0, 0.02},
              {"load torque", "Nm", 1.0, -0.04}};
  t.candidates.push_back(pi);
  const auto text = text_of(sentences(t));
  EXPECT_TRUE(holds(text,
                    "gains times estimated states: velocity of the load 1.25 Nm/(rad/s), twist of the "
                    "coupling -3.00 Nm/rad, load torque 1.00."))
      << text;
  EXPECT_TRUE(holds(text,
                    "for every rad/s by which the measured velocity differs from its estimate, by: "
                    "velocity of the load 0.500 rad/s, twist of the coupling 0.0200 rad, load torque "
                    "-0.0400 Nm."))
      << text;
  EXPECT_TRUE(holds(text, "First step: there is none of this controller")) << text;
  EXPECT_TRUE(holds(text, "kp 0.955 Nm/(rad/s), ki 4.50 Nm/rad (Ti 212 ms), record")) << text;
}

TEST(TuneText, TellsFirstStepLimitsAndWhatUncertaintyCosts) {
  const auto t = test::tuning();
  const auto text = text_of(sentences(t));
  EXPECT_TRUE(holds(
      text, "First step: half of kp and a quarter of ki, kp 1.10 Nm/(rad/s), ki 5.10 Nm/rad (Ti 216 ms);"));
  EXPECT_TRUE(holds(text, "What limits the design: the bounds on |S| and |T_load|."));
  // On the curve: 0.08 - 0.02 * 1.6 against 0.08 - 0.02 * 1.4.
  EXPECT_TRUE(
      holds(text, "A bound of 1.60 on |S| would make the load step's IAE of the best PI 8 % smaller."));
  EXPECT_TRUE(holds(text,
                    "Designed for the identified machine alone it would have ki 25.1 in place of 20.4 and "
                    "exceed a bound with 56 % probability."));
  EXPECT_TRUE(holds(text, "0.500 ms, is assumed: a quarter of a sample."));
  EXPECT_TRUE(holds(text, "identify without .delay_s"));
  EXPECT_TRUE(holds(
      text,
      "with half of every standard deviation but the delay's ki could be 22.3, and the load step's IAE 8 % "
      "smaller; with no uncertainty but the delay's ki could be 25.1, and the load step's IAE 17 % "
      "smaller. With the delay known exactly ki could be 21.9, and the load step's IAE 6 % smaller."));
  // Half of 2, 2, 2 and 6 %.
  EXPECT_TRUE(holds(text,
                    "resonid plan .model RESULT.json .accuracy "
                    "driven_inertia=1%,load_inertia=1%,stiffness=1%,damping=3%\n"));
  // sqrt(143.75/0.032)/(2 pi) = 10.67 Hz, 4.9 * 2.2/2.1 = 5.13 Hz.
  EXPECT_TRUE(holds(text, "The crossover is 0.48 of the anti-resonance (10.7 Hz)."));
}

/// Curves of a bound are of |S| and |T_load| under a velocity PI.
TEST(TuneText, SaysHowToLearnThePriceOfABound) {
  auto t = test::tuning();
  auto& c = t.candidates.front();
  for (auto& figure : c.figures)
    if (figure.name == "sensitivity_peak") figure.frequency_hz = 12.3;
  c.limits = {"sensitivity_peak", "controller_sensitivity_peak"};
  auto text = text_of(sentences(t));
  EXPECT_TRUE(
      holds(text,
            "What limits the design: the bounds on |S| and |C S|. Larger gains need a looser bound on |C S| "
            "(.largest_controller_sensitivity): design again with one, and compare the IAE of the load step. "
            "A bound of 1.60 on |S| would make"))
      << text;
  c.position_gain = 12.5;
  c.limits = {"sensitivity_peak", "load_peak"};
  text = text_of(sentences(t));
  EXPECT_TRUE(
      holds(text,
            "What limits the design: the bounds on |S| and |T_position|. Larger gains need a looser bound on "
            "|S|, largest near 12.3 Hz (.largest_sensitivity) or |T_position|, largest near "))
      << text;
  EXPECT_TRUE(holds(text, "|T_position| <= 1.30)")) << text;
  EXPECT_TRUE(holds(text, "(.largest_position_transfer): design again with one")) << text;
  EXPECT_FALSE(holds(text, "of the best PI")) << text;
  EXPECT_TRUE(holds(summary_text(t), "largest |T_position|"));
  EXPECT_FALSE(holds(summary_text(t), "largest |T_load|"));
}

/// One gain: no ki of 0, nor a quarter of it.
TEST(TuneText, TellsAProportionalControllerByItsGain) {
  auto t = test::tuning();
  auto p = test::tuned_controller("p", "P", {2.2, 0.0, {}}, 1.0);
  p.within = true;
  std::erase_if(p.figures, [](const auto& f) { return f.name == "load_step_iae"; });
  t.candidates = {p};
  t.nominal = test::tuned_controller("p", "P", {2.4, 0.0, {}}, 1.0);
  t.experiment.clear();
  const auto text = text_of(sentences(t));
  EXPECT_TRUE(holds(text, "Gains: kp 2.20 Nm/(rad/s)."));
  EXPECT_TRUE(
      holds(text, "First step: half of kp, kp 1.10 Nm/(rad/s); in the recording's own units kp 0.288 A/rpm"));
  EXPECT_TRUE(holds(text, "have kp 2.40 in place of 2.20"));
  EXPECT_FALSE(holds(text, "ki "));
  EXPECT_FALSE(holds(text, "times stiffer"));
  EXPECT_FALSE(holds(text, "IAE of the best PI"));
}

/// Structures that are searched are not designed again for less uncertainty.
TEST(TuneText, TellsWhatIsLostToUncertaintyByAnyStructure) {
  auto t = test::tuning();
  t.candidates.front().derivative_gain = 0.01;
  t.experiment = {{0.0, 0.0, 0.0400, 0.0}, {1.0, 0.0, 0.0500, 1.0}};
  auto text = text_of(sentences(t));
  EXPECT_TRUE(
      holds(text,
            "What a better experiment would buy: with no uncertainty at all the load step's IAE could "
            "be 20 % smaller."))
      << text;
  EXPECT_FALSE(holds(text, "resonid plan")) << text;  // the delay is assumed
  t.delay_std_assumed = false;
  EXPECT_TRUE(holds(text_of(sentences(t)), "resonid plan .model"));
}

/// Where the delay alone is worth knowing, that is no better experiment which buys nothing.
TEST(TuneText, TellsWhatOnlyAKnownDelayBuys) {
  auto t = test::tuning();
  t.experiment = {{1.0, 20.4, 0.0531}, {0.25, 20.4, 0.0530}, {0.0, 20.5, 0.0529}, {1.0, 25.0, 0.0420, 0.0}};
  auto text = text_of(sentences(t));
  EXPECT_TRUE(
      holds(text,
            "Better known parameters would buy nothing by themselves. With the delay known exactly ki "
            "could be 25.0, and the load step's IAE 21 % smaller."))
      << text;
  EXPECT_FALSE(holds(text, "A better experiment would buy nothing"));
  t.experiment.pop_back();
  EXPECT_TRUE(holds(text_of(sentences(t)), "A better experiment would buy nothing: the uncertainty hardly"));
}

TEST(TuneText, ComparesWithTheRunningController) {
  auto t = test::tuning();
  const double now = t.running->figures.at(9).value, then = t.proposed().figures.at(9).value;
  ASSERT_EQ(t.running->figures.at(9).name, "load_step_iae");
  ASSERT_GT(now, 2.0 * then);
  std::ostringstream ratio;
  ratio.precision(2);
  ratio << now / then;
  EXPECT_TRUE(
      holds(text_of(sentences(t)), "Against the running controller: " + ratio.str() + " times stiffer;"));
  std::swap(*t.running, t.candidates.front());
  EXPECT_TRUE(holds(text_of(sentences(t)), ratio.str() + " times softer;"));
}

/// A position loop's error, in rad s, is not that of a velocity loop, in rad; all its gains are halved first.
TEST(TuneText, ComparesOnlyWhatIsAlike) {
  auto t = test::tuning();
  auto& c = t.candidates.front();
  c.name = "P over PI";
  c.position_gain = 12.5;
  for (auto& figure : c.figures)
    if (figure.name == "load_step_iae") figure.unit = "rad s";
  const auto text = text_of(sentences(t));
  EXPECT_FALSE(holds(text, "stiffer"));
  EXPECT_TRUE(
      holds(text, "a quarter of ki, kp 1.10 Nm/(rad/s), ki 5.10 Nm/rad (Ti 216 ms), position gain kv 6.25"));
  const auto page = document(t);
  for (const auto& section : page.sections)
    if (section.title == "Controllers that were compared") {
      const auto& table = section.plain_tables.at(0);
      EXPECT_EQ(table.columns.at(5), "IAE, rad s");
      EXPECT_EQ(table.rows.front().at(0), "P over PI");
      EXPECT_NE(table.rows.front().at(5), "");
      EXPECT_EQ(table.rows.back().at(0), "running");
      EXPECT_EQ(table.rows.back().at(5), "");
    }
}

/// 0.0531 is promised of 1 Nm, so that 0.5 Nm make half of it.
TEST(TuneText, SaysOfEverySimulatedRunWhatItWas) {
  auto t = test::full_tuning();
  const double of_one = t.proposed().figures.at(9).value;
  ASSERT_EQ(t.proposed().figures[9].name, "load_step_iae");
  t.simulated = {
      {"reference step", {}, {}, {}, {}, {{"reference_peak_torque", "Nm", 2.0, 2.1}}},
      {"reference step through the shaper", {}, {}, {}, {}, {{"deviation_left", "%", 0.1, 0.2}}},
      {"load step", {}, {}, {}, {}, {{"load_step_iae", "rad", 0.5 * of_one, 0.55 * of_one}}},
      {"motion", {}, {}, {}, {}, {{"peak_torque", "Nm", 0.4, 0.5}}},
      {"motion without feed-forward", {}, {}, {}, {}, {{"position_error_during", "rad", 0.28, 0.29}}},
      {"load step with the running controller", {}, {}, {}, {}, {{"load_step_iae", "rad", 1.0, 1.0}}}};
  t.options.reference_step = 1.5;
  const auto list = sentences(t);
  ASSERT_GT(list.size(), 5U);
  EXPECT_EQ(
      list[list.size() - 4],
      "On the simulated machine, reference step of 1.50 rad/s through the shaper: deviation of the load "
      "that is left 0.200 % (promised 0.100 %).");
  std::vector<std::string> last(list.end() - 5, list.end());
  last.erase(last.begin() + 1);
  EXPECT_EQ(
      last[0],
      "On the simulated machine, reference step of 1.50 rad/s: peak torque 2.10 Nm (promised 2.00 Nm).");
  EXPECT_TRUE(holds(last[1], "machine, load step of 0.500 Nm: IAE of the load step ")) << last[1];
  EXPECT_EQ(last[2],
            "On the simulated machine, motion to 1.50 rad/s: peak torque 0.500 Nm (promised 0.400 Nm).");
  EXPECT_EQ(last[3],
            "On the simulated machine, motion by 1.50 rad without feed-forward: position error during it "
            "0.290 rad (promised 0.280 rad).");
}

TEST(TuneText, WritesNoRoundingDust) {
  auto t = test::tuning();
  t.simulated = {{"reference step", {}, {}, {}, {}, {{"reference_overshoot", "%", 0.0, 1.12e-11}}}};
  EXPECT_TRUE(holds(text_of(sentences(t)), "overshoot of the load 0 % (promised 0 %)."));
  t.simulated.front().figures.front().simulated = 2e-4;
  EXPECT_TRUE(holds(text_of(sentences(t)), "overshoot of the load 0.000200 % (promised 0 %)."));
}

/// A slow loop is farther off its reference through a shaper, which leaves no vibration.
TEST(TuneText, TellsCreepFromVibration) {
  auto t = test::full_tuning();
  const auto put = [&](double plain, double shaped) {
    t.simulated = {
        {"reference step", {}, {}, {}, {}, {{"deviation_left", "%", plain, plain}}},
        {"reference step through the shaper", {}, {}, {}, {}, {{"deviation_left", "%", shaped, shaped}}}};
    return text_of(sentences(t));
  };
  EXPECT_TRUE(
      holds(put(47.9, 58.7),
            "leaves 4.1 % of the vibration or less. What is left of the load's deviation on the simulated "
            "machine, 58.7 % through it and 47.9 % without, is no vibration but how slowly the loop comes"));
  EXPECT_FALSE(holds(put(47.9, 5.2), "is no vibration"));
  EXPECT_FALSE(holds(put(1.2, 1.4), "is no vibration"));  // less than a shaper may leave
}

TEST(TuneText, SaysOfAForcedDesignOnlyWhatItWouldKeep) {
  auto t = test::tuning();
  t.trusted = false;
  t.options.force = true;
  EXPECT_TRUE(holds(sentences(t).at(1),
                    "PI + 1 biquad would keep every bound (|S| <= 1.40, |T_load| <= 1.30) "
                    "with at least 95 % probability if the result were right: of"));
  EXPECT_EQ(trust_text(t), "FORCED, and NOT trusted.");
}

/// All results may be trusted, and something else speaks against the design.
TEST(TuneText, SaysWhatKeepsADesignFromBeingTrusted) {
  auto t = test::tuning();
  t.trusted = false;
  t.findings.push_back({"step-not-kept", diagnostics::Severity::error, {}, {}, "It takes more."});
  EXPECT_TRUE(
      holds(text_of(sentences(t)), "95 % probability if the drive had the torque that its step takes: of"));
  t.findings.push_back({"fails-in-simulation", diagnostics::Severity::error, {}, {}, "It is unstable."});
  EXPECT_TRUE(holds(text_of(sentences(t)), "95 % probability if the drive were the identified one: of"));
  t.findings.push_back({"tuned-untrusted", diagnostics::Severity::error, {}, {}, "It is not."});
  EXPECT_TRUE(holds(text_of(sentences(t)), "95 % probability if the result were right: of"));
}

TEST(TuneText, WritesLargeNumbersOut) {
  auto t = test::tuning();
  for (auto& figure : t.running->figures)
    if (figure.name == "load_step_iae") figure.value = t.proposed().figures.at(9).value / 343.0;
  t.candidates.front().gains->ki = 2.2 / 10.504;
  EXPECT_TRUE(holds(text_of(sentences(t)), ": 340 times softer;"));
  EXPECT_TRUE(holds(text_of(sentences(t)), "(Ti 10.5 s)"));
}

/// A verdict on a controller is one, though the controller is not to be used.
TEST(TuneText, TellsBoundsFromTrust) {
  auto t = test::evaluation();
  EXPECT_TRUE(holds(summary_text(t), "\nBounds NOT kept.\n"));
  t.findings.push_back({"bounds-exceeded", diagnostics::Severity::error, {}, {}, "They are."});
  EXPECT_TRUE(holds(summary_text(t), "\nBounds NOT kept.\n"));
  EXPECT_EQ(document(t).badge->word, "Bounds not kept");
  t.findings.push_back({"misfit", diagnostics::Severity::error, {}, {}, "It does not fit."});
  EXPECT_TRUE(holds(summary_text(t), "\nNOT trusted: see the findings.\n"));
  EXPECT_EQ(document(t).badge->word, "Not trusted");
}

/// However it is told, and with nothing beside it that only a stable loop has.
TEST(TuneText, GivesUnstableLoopsOneVerdict) {
  auto t = test::evaluation();
  EXPECT_TRUE(holds(text_of(sentences(t)), "The common rule"));
  t.candidates.front().stable = false;
  t.findings.push_back({"design-unstable", diagnostics::Severity::error, {}, {}, "It is unstable."});
  const auto simulated = [&] {
    t.findings.push_back({"fails-in-simulation", diagnostics::Severity::error, {}, {}, "It is unstable."});
    return t;
  };
  for (const auto& tuning : {t, simulated()}) {
    const auto text = summary_text(tuning);
    EXPECT_TRUE(holds(text, "\nNOT trusted: the loop is UNSTABLE.\n")) << text;
    EXPECT_FALSE(holds(text, "see the findings")) << text;
    EXPECT_FALSE(holds(text, "The common rule")) << text;
    EXPECT_FALSE(holds(text, "99.73")) << text;  // per cent of the machines exceed a bound
  }
}

/// Of one controller for several machines.
TEST(TuneText, SaysWhoseFiguresItShows) {
  auto t = test::tuning();
  for (const auto& sentence : sentences(t)) EXPECT_FALSE(holds(sentence, "Figures and curves")) << sentence;
  t.machines = {t.machines.front(), t.machines.front()};
  t.files = {"a.csv", "b.csv"};
  t.results = {"run/a.json", "run/b.json"};
  const auto list = sentences(t);
  EXPECT_TRUE(holds(list.at(0),
                    "of 10 000 machines that each identification leaves possible, at most 4.2 % exceed one"));
  EXPECT_EQ(list.at(1),
            "Figures and curves are those of the machine of run/a.json; worst cases are those of all 2 "
            "machines, shares those of the one that exceeds most often.");
  const auto text = summary_text(t);
  EXPECT_TRUE(holds(text, "\nPI + 1 biquad: figures of the machine of run/a.json, worst of all 2\n")) << text;
  EXPECT_TRUE(holds(text, "; figures of the machine of run/a.json\n")) << text;
  EXPECT_TRUE(holds(text, "2 machines, that of run/a.json: two-mass drive")) << text;
  EXPECT_FALSE(holds(text, "of the identified machine")) << text;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
  const auto page = document(t);
  EXPECT_TRUE(holds(text_of(page.summary), list.at(1)));
  ASSERT_GE(page.cards.size(), 3U);
  EXPECT_EQ(page.cards.at(1).under.back(), "machine of a.json");
  for (const auto& section : page.sections)
    EXPECT_FALSE(holds(text_of(section.text), "of the identified machine")) << section.title;
  // Those at a place say so in another way.
  const auto scheduled = test::full_tuning();
  EXPECT_FALSE(holds(text_of(sentences(scheduled)), "Figures and curves"));
}

/// Each machine has its own.
TEST(TuneText, SaysOfWhichResultsTheDelaysDeviationIs) {
  auto t = test::tuning();
  auto own = t.machines.front(), other = own;
  own.estimated[fit::kDelay] = other.estimated[fit::kDelay] = true;
  own.covariance(fit::kDelay, fit::kDelay) = 1e-8;
  other.covariance(fit::kDelay, fit::kDelay) = 4e-8;
  auto assumed = own;
  assumed.estimated[fit::kDelay] = false;
  assumed.covariance(fit::kDelay, fit::kDelay) = 0.0;
  t.results = {"a.json", "b.json"};
  t.machines = {own, assumed};
  EXPECT_TRUE(
      holds(text_of(sentences(t)),
            "The delay's standard deviation, 0.500 ms, is assumed for the machine of b.json: a quarter"));
  t.machines = {assumed, assumed};
  EXPECT_TRUE(
      holds(text_of(sentences(t)), "The delay's standard deviation, 0.500 ms, is assumed: a quarter"));
  t.delay_std_assumed = false;
  t.delay_std_s = 2e-4;
  t.machines = {own, other};
  EXPECT_TRUE(holds(text_of(sentences(t)),
                    "The delay's standard deviation is 0.100 ... 0.200 ms, those of the results."));
  t.machines = {other, other};
  EXPECT_TRUE(
      holds(text_of(sentences(t)), "The delay's standard deviation is 0.200 ms, those of the results."));
  t.machines = {other};
  EXPECT_TRUE(
      holds(text_of(sentences(t)), "The delay's standard deviation is 0.200 ms, that of the result."));
}

TEST(TuneText, SaysWhatMayNotBeReliedOnBeforeAnythingElse) {
  auto t = test::tuning();
  t.trusted = false;
  EXPECT_EQ(sentences(t).front().substr(0, 12), "Not trusted:");
  t.options.force = true;
  EXPECT_EQ(sentences(t).front().substr(0, 23), "Made by force (.force):");
  EXPECT_TRUE(holds(summary_text(t), "\nFORCED, and NOT trusted.\n"));
  EXPECT_EQ(document(t).badge->word, "Forced, not trusted");
  t = test::tuning();
  t.candidates.front().stable = false;
  EXPECT_TRUE(holds(sentences(t).front(), "UNSTABLE"));
  EXPECT_EQ(document(t).badge->word, "Unstable");
  EXPECT_FALSE(document(t).badge->good);
}

TEST(TuneText, JudgesTheControllerThatWasGiven) {
  const auto t = test::evaluation();
  const auto list = sentences(t);
  // |T_load| of 1.9: docs/methods/tune.md 2.4.
  EXPECT_EQ(
      list.at(0),
      "The given controller (PI) does NOT keep every bound (|S| <= 1.40, |T_load| <= 1.30) with 95 % "
      "probability: of 10 000 machines that the identification leaves possible, 99.73 % exceed one, none "
      "is unstable. On the identified machine |T_load| is 1.90 (bound 1.30).");
  EXPECT_FALSE(holds(text_of(list), "First step"));
  EXPECT_EQ(document(t).badge->word, "Bounds not kept");
  EXPECT_EQ(document(t).title, "Evaluation of PI for axis_x.csv");
}

TEST(TuneText, FitsTheTerminal) {
  auto cascade = several_crossings();
  cascade.candidates.front().position_gain = 12.5;
  for (const auto& t :
       {test::tuning(), test::full_tuning(), test::evaluation(), test::checked(), least_tuning(), cascade}) {
    std::istringstream lines(summary_text(t));
    std::string line;
    while (std::getline(lines, line)) EXPECT_LE(line.size(), 100U) << line;
  }
  const auto text = summary_text(test::full_tuning());
  for (const char* part : {"largest |S| (Ms)", "least phase margin, deg", "95 % from", "delay margin, ms",
                           "PI + 1 biquad, nominal", "PI: a larger error of the load", "Gains over position",
                           "mzv", "\nTrusted.\n", "delay-unknown"})
    EXPECT_TRUE(holds(text, part)) << part << "\n" << text;
}

/// One alone is the least margin, which stands among the figures.
TEST(TuneText, TellsCrossingsWhereThereAreSeveral) {
  EXPECT_FALSE(holds(summary_text(test::tuning()), "Crossings of |L| = 1"));
  auto t = several_crossings();
  const auto text = summary_text(t);
  EXPECT_TRUE(
      holds(text, "\nCrossings of |L| = 1 (margin: angle to -1, of L below or above the real axis)\n"))
      << text;
  // 75.6/360/7.18 s, (360 - 166.4)/360/12.6 s, 49.8/360/25.2 s.
  EXPECT_EQ(crossing_rows(text), (std::vector<std::string>{
                                     "7.18 7.13 7.21 falls below 75.6 74.1 77.0 73.9 29.2",
                                     "12.6 12.2 13.1 rises above 166.4 162.0 171.0 161.5 42.7",
                                     "25.2 24.8 25.6 falls below 49.8 41.6 58.1 41.2 5.49",
                                 }))
      << text;
  t.candidates.front().stable = false;
  EXPECT_FALSE(holds(summary_text(t), "Crossings of |L| = 1"));
}

TEST(TuneText, TellsWhereFiguresAreLargest) {
  auto t = test::tuning();
  for (auto& figure : t.candidates.front().figures)
    if (figure.name == "load_peak") figure.frequency_hz = 7.654;
  const auto table = figure_table_of(document(t));
  EXPECT_EQ(table.columns.at(4), "at, Hz");
  for (const auto& row : table.rows) {
    if (row.front() == "largest |T_load|") {
      EXPECT_EQ(row.at(4), "7.65");
    }
    if (row.front() == "gain margin, dB") {
      EXPECT_EQ(row.at(4), "");
    }
  }
  EXPECT_TRUE(holds(summary_text(t), "at, Hz"));
  for (auto& figure : t.candidates.front().figures) figure.frequency_hz.reset();
  EXPECT_EQ(figure_table_of(document(t)).columns.at(4), "95 % from");
  EXPECT_FALSE(holds(summary_text(t), "at, Hz"));
}

TEST(TuneText, TellsWhatTheMachineShows) {
  auto t = test::checked();
  EXPECT_EQ(sentences(t).at(2),
            "Checked on the machine: the loop of run/after.csv is NOT the one that was promised, furthest at "
            "15.5 Hz (probability of that by noise less than 0.0001). Likely cause: the stiffness (+15 %).");
  // 1.96 times the standard deviations, in ms.
  EXPECT_TRUE(holds(summary_text(t), "8.40 +- 0.59"));
  EXPECT_TRUE(holds(summary_text(t), "6.60 +- 0.39"));
  const auto page = document(t);
  EXPECT_EQ(page.sections.at(0).title, "Checked on the machine");
  const auto& magnitude = page.sections[0].charts.at(0);
  EXPECT_EQ(magnitude.curves.at(0).name, "measured");
  EXPECT_NEAR(magnitude.curves[0].y.at(3), 20.0 * std::log10(std::abs(t.check->measured[3])), 1e-12);
  EXPECT_GT(magnitude.curves.at(1).upper.at(3), magnitude.curves[1].y.at(3));
  t.check->agrees = t.check->decided = false;
  t.check->worst_line_hz = 0.0;
  t.check->cause = "the recording is too noisy to tell";
  EXPECT_EQ(
      sentences(t).at(2),
      "Checked on the machine: from run/after.csv it cannot be told whether the loop is as promised, as "
      "the recording is too noisy to tell.");
  t.check->decided = true;
  // An error bar that is wider than the room below the bound.
  for (const double std : {0.001, 0.2}) {
    t.check->agrees = true;
    t.check->figures.push_back({"sensitivity_peak", "", {1.3, 0.01}, {1.3, std}, 0.9});
    EXPECT_EQ(holds(sentences(t).at(2), "does not show that |S| stays below"), std == 0.2);
    EXPECT_TRUE(
        holds(sentences(t).at(2), "A gain that differs by 6.60 % or a delay by 0.700 ms would have shown."));
    t.check->figures.pop_back();
  }
  t.check->agrees = true;
  t.check->figures.push_back({"sensitivity_peak", "", {1.33, 0.05}, {1.44, 0.01}, 0.05});
  t.findings = {{"measured-beyond-bound", diagnostics::Severity::error, 1.44, 1.4, "Beyond."}};
  EXPECT_TRUE(holds(sentences(t).at(1), "if the recording did not show otherwise")) << sentences(t).at(1);
  EXPECT_TRUE(holds(sentences(t).at(2),
                    "within both error bars, and breaks a bound all the same: |S| measures 1.44, beyond its "
                    "bound of 1.40."))
      << sentences(t).at(2);
  t.check->figures.pop_back();
  t.trusted = true;
  t.findings.clear();
  // The delay margin of 6.6 ms for 8.4 ms.
  EXPECT_TRUE(holds(sentences(t).at(1),
                    " Nearest to the edge of that is the delay margin: 6.60 measured, 8.40 "
                    "promised, in ms (probability by noise less than 0.0001)."))
      << sentences(t).at(1);
  EXPECT_TRUE(holds(sentences(t).at(1), "is the one that was promised, within both error bars."));
  t.findings.push_back({"checked-machine", diagnostics::Severity::info, {}, {}, "That of b.json."});
  EXPECT_TRUE(sentences(t).at(1).ends_with(" That of b.json."));
}

TEST(TunePage, TellsCrossingsWithTheirSpread) {
  const auto crossings_of = [](const Tuning& t) {
    for (const auto& section : document(t).sections)
      for (const auto& table : section.plain_tables)
        if (table.title.starts_with("Crossings of |L| = 1")) return table;
    return Table{};
  };
  auto t = test::tuning();
  const auto table = crossings_of(t);
  EXPECT_EQ(table.columns,
            (std::vector<std::string>{"at, Hz", "95 % from", "95 % to", "|L|", "side", "margin, deg",
                                      "95 % from", "95 % to", "least", "delay margin, ms"}));
  ASSERT_EQ(table.rows.size(), 1U);
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"5.10", "5.00", "5.20", "falls", "below", "63.2", "60.8",
                                                     "65.6", "60.1", "34.4"}));
  // By a response, and by results of before: what is not known has no column.
  t.candidates.front().crossings = {{{5.1, 63.2, true}}};
  EXPECT_EQ(crossings_of(t).columns,
            (std::vector<std::string>{"at, Hz", "|L|", "side", "margin, deg", "delay margin, ms"}));
}

TEST(TunePage, DrawsProposedBeforeRunningWithBandsAndBounds) {
  auto t = test::tuning();
  t.running->curves.frequency_hz.front() = 0.01;  // one line below those of the proposed controller
  const auto page = document(t);
  EXPECT_LE(page.cards.size(), 6U);
  const auto* sensitivity = chart_of(page, "Sensitivity |S|");
  ASSERT_NE(sensitivity, nullptr);
  ASSERT_EQ(sensitivity->curves.size(), 3U);
  EXPECT_EQ(sensitivity->curves[0].name, "PI + 1 biquad");
  EXPECT_EQ(sensitivity->curves[0].upper, t.proposed().curves.sensitivity.high);
  EXPECT_EQ(sensitivity->curves[1].name, "running controller");
  EXPECT_TRUE(sensitivity->curves[1].lower.empty());
  EXPECT_GE(sensitivity->curves[1].x.front(), t.proposed().curves.frequency_hz.front());
  EXPECT_EQ(sensitivity->curves[2].y, (std::vector<double>{1.4, 1.4}));
  const auto* magnitude = chart_of(page, "Open loop L: magnitude");
  ASSERT_NE(magnitude, nullptr);
  EXPECT_NEAR(magnitude->curves[0].lower[7], 20.0 * std::log10(t.proposed().curves.loop_size.low[7]), 1e-12);
  EXPECT_NE(chart_of(page, "Load after a torque step of 1 Nm on it"), nullptr);
}

TEST(TunePage, PutsBoundAndWorstBesideTheValue) {
  const auto t = test::tuning();
  const auto page = document(t);
  const auto section = std::ranges::find(page.sections, "What the loop does", &Section::title);
  ASSERT_NE(section, page.sections.end());
  const auto& table = section->plain_tables.at(0);
  EXPECT_EQ(table.columns, (std::vector<std::string>{"figure", "value", "bound", "worst", "at, Hz",
                                                     "95 % from", "95 % to", "exceeded, %"}));
  EXPECT_EQ(table.rows.at(0).at(0), "largest |S| (Ms)");
  EXPECT_EQ(table.rows[0].at(2), "1.40");
}

/// |C S| is |S| times |C|, and |S G| is |T| over it, with their bands.
TEST(TunePage, DrawsWhatNoiseAndTorquesDo) {
  auto t = test::tuning();
  for (auto& figure : t.candidates.front().figures)
    if (figure.name == "controller_sensitivity_peak") figure.bound = 4.0;
  const auto page = document(t);
  const auto* noise = chart_of(page, "From noise of the velocity to the torque, |C S|");
  const auto* torque = chart_of(page, "From a torque to the measured velocity, |S G|");
  ASSERT_NE(noise, nullptr);
  ASSERT_NE(torque, nullptr);
  EXPECT_EQ(noise->y_label, "Magnitude in Nm/(rad/s)");
  ASSERT_EQ(noise->curves.size(), 3U);
  EXPECT_EQ(noise->curves[1].name, "running controller");
  EXPECT_EQ(noise->curves[2].name, "bound 4.00");
  EXPECT_EQ(noise->curves[2].y, (std::vector<double>{4.0, 4.0}));
  const auto& curves = t.proposed().curves;
  for (const std::size_t i : {std::size_t{0}, std::size_t{40}, std::size_t{200}}) {
    const double c = std::abs(t.proposed().feedback.response(curves.frequency_hz[i]));
    EXPECT_NEAR(noise->curves[0].y.at(i), curves.sensitivity.value[i] * c, 1e-9 * c);
    EXPECT_NEAR(noise->curves[0].upper.at(i), curves.sensitivity.high[i] * c, 1e-9 * c);
    EXPECT_NEAR(torque->curves.at(0).y.at(i), curves.complementary.value[i] / c, 1e-9 / c);
    EXPECT_NEAR(torque->curves[0].lower.at(i), curves.complementary.low[i] / c, 1e-9 / c);
  }
}

/// Though the controllers settle at different times; what is far slower is cut.
TEST(TunePage, DrawsStepsOfOneLength) {
  auto t = test::tuning();
  const std::vector<double> settled = {0.0, 0.7, 1.0};
  auto& proposed = t.candidates.front().curves;
  proposed.time_s = {0.0, 0.1, 0.2};
  proposed.load_by_reference = {settled, settled, settled};
  t.candidates.front().stable = t.running->stable = true;
  t.options.reference_step = 1.0;
  auto& running = t.running->curves;
  running.load_by_reference = {settled, {}, {}};
  const auto curves = [&](double running_s) {
    running.time_s = {0.0, 0.5 * running_s, running_s};
    const auto page = document(t);
    const auto* chart = chart_of(page, "Load after a reference step of 1 rad/s");
    return chart == nullptr ? std::vector<Curve>() : chart->curves;
  };
  for (const auto& [running_s, end_s] : {std::pair{0.6, 0.6}, {0.1, 0.2}, {3.0, 0.8}}) {
    const auto list = curves(running_s);
    ASSERT_EQ(list.size(), 2U);
    for (const auto& curve : list) {
      if (running_s < 1.0) {
        EXPECT_DOUBLE_EQ(curve.x.back(), end_s);
      }
      EXPECT_LE(curve.x.back(), end_s + 1e-12);
      EXPECT_EQ(curve.x.size(), curve.y.size());
    }
    EXPECT_DOUBLE_EQ(list[0].x.back(), end_s);
    EXPECT_EQ(list[0].y.back(), 1.0);
    EXPECT_EQ(list[0].lower.size(), list[0].x.size());
    EXPECT_EQ(list[0].upper.back(), 1.0);
  }
}

/// A position loop's curves are of position, and a running velocity loop has no place beside them.
TEST(TunePage, DrawsPositionLoopsAsSuch) {
  auto t = test::tuning();
  t.options.reference_step = 2.0;
  auto& c = t.candidates.front();
  c.position_gain = 12.5;
  for (auto& figure : c.figures)
    if (figure.name == "load_step_peak") figure.unit = "rad";
  const auto page = document(t);
  for (const char* title :
       {"Load after a torque step of 1 Nm on it", "Load after a reference step of 2 rad"}) {
    const auto* chart = chart_of(page, title);
    ASSERT_NE(chart, nullptr) << title;
    EXPECT_EQ(chart->y_label, "Position of the load in rad");
    EXPECT_EQ(chart->curves.size(), 1U);
  }
  const auto* load = chart_of(page, "From the reference to the load's position, |T_position|");
  ASSERT_NE(load, nullptr);
  for (const auto& curve : load->curves) EXPECT_NE(curve.name, "running controller");
  EXPECT_EQ(chart_of(page, "Sensitivity |S|")->curves.at(1).name, "running controller");
  for (const auto& section : page.sections) {
    if (section.title == "Steps") {
      EXPECT_TRUE(holds(text_of(section.text), "The running controller closes a loop of velocity"));
      EXPECT_TRUE(holds(text_of(section.text), "are those of the measured position"));
    }
    if (section.title == "Controllers that were compared") {
      EXPECT_EQ(section.plain_tables.at(0).columns.at(4), "|T_position|");
      EXPECT_EQ(section.plain_tables[0].rows.back().at(4), "");
    }
  }
  const auto text = summary_text(t);  // the terminal breaks it
  EXPECT_TRUE(holds(text, "  load step: peak of the measured ")) << text;
  EXPECT_TRUE(holds(text, "\n    position, rad\n")) << text;
  // A running position loop is drawn beside it; a linear axis is in m.
  t.running->position_gain = 5.0;
  t.units.velocity = "m/s";
  const auto both = document(t);
  const auto* step = chart_of(both, "Load after a reference step of 2 m");
  ASSERT_NE(step, nullptr);
  EXPECT_EQ(step->y_label, "Position of the load in m");
  EXPECT_EQ(step->curves.size(), 2U);
}

/// On an ellipse of 95 %, d' P^-1 d = chi2 of two degrees at 0.95 = 5.9915 (scipy.stats.chi2.ppf(0.95, 2)).
TEST(TunePage, DrawsTheCircleOfMsAndEllipses) {
  auto t = test::tuning();
  auto& e = t.candidates[0].curves.ellipses;
  e.resize(1);
  e[0].value = {-0.3, -0.5};
  e[0].covariance << 4e-4, 1.5e-4, 1.5e-4, 1e-4;
  const auto page = document(t);
  const auto* plane = chart_of(page, "Nyquist curve of L = C G, every delay included");
  ASSERT_NE(plane, nullptr);
  ASSERT_EQ(plane->curves.size(), 3U);
  const auto& ellipse = plane->curves[2];
  ASSERT_GT(ellipse.x.size(), 40U);
  const double determinant = 4e-4 * 1e-4 - 1.5e-4 * 1.5e-4;
  Eigen::Matrix2d inverse;
  inverse << 1e-4 / determinant, -1.5e-4 / determinant, -1.5e-4 / determinant, 4e-4 / determinant;
  for (std::size_t i = 0; i + 1 < ellipse.x.size(); ++i) {
    const Eigen::Vector2d d(ellipse.x[i] + 0.3, ellipse.y[i] + 0.5);
    EXPECT_NEAR(d.dot(inverse * d), 5.991464547107979, 1e-9);
  }
  const auto circle = std::find_if(plane->shapes.begin(), plane->shapes.end(),
                                   [](const Shape& s) { return s.name.find("|S| = 1.40") == 0; });
  ASSERT_NE(circle, plane->shapes.end());
  EXPECT_EQ(circle->x, -1.0);
  EXPECT_DOUBLE_EQ(circle->radius, 1.0 / 1.4);
}

TEST(TunePage, SaysWhichPositionItsFiguresAreOf) {
  const auto page = document(test::full_tuning());
  const auto holds = [&](std::string_view words) {
    return std::any_of(page.summary.begin(), page.summary.end(),
                       [&](const std::string& text) { return text.find(words) != std::string::npos; });
  };
  EXPECT_TRUE(holds("Gains over position, 3 nodes: every bound is met at every position"));
  EXPECT_TRUE(holds("below are those at position 0.1"));
  EXPECT_EQ(page.badge->reason.find("at every position"), 0U);
  for (std::size_t i = 0; i + 1 < page.cards.size(); ++i)
    EXPECT_EQ(page.cards[i].under.back(), "at position 0.1") << page.cards[i].name;
  EXPECT_EQ(page.cards.back().value, "4.7 %");
  EXPECT_EQ(page.cards.back().under.back(), "at position 0.9, where most");
  std::size_t there = 0;
  for (const auto& section : page.sections) there += section.title.ends_with(", at position 0.1") ? 1 : 0;
  EXPECT_EQ(there, 5U);
  const auto plain = document(test::tuning());
  for (const auto& section : plain.sections) EXPECT_EQ(section.title.find("position"), std::string::npos);
}

/// There is no machine then.
TEST(TunePage, WordsADesignByAResponseAsOne) {
  auto t = test::tuning();
  t.by_response = true;
  t.machines.clear();
  t.nominal.reset();
  auto& c = t.candidates.front();
  c.draws = 0;
  c.curves.ellipses.clear();
  for (auto& figure : c.figures) {
    figure.low.reset();
    figure.high.reset();
    figure.probability.reset();
    if (figure.name == "load_peak") figure.worst = figure.value = 1.25;
  }
  const auto text = summary_text(t);
  EXPECT_TRUE(holds(text, ": figures of the measured response")) << text;
  EXPECT_FALSE(holds(text, "identified machine")) << text;
  const auto page = document(t);
  for (const auto& section : page.sections)
    if (section.title == "What the loop does" || section.title == "Sensitivity, and what the load does") {
      EXPECT_FALSE(holds(text_of(section.text), "machine")) << section.title;
    }
  const auto table = figure_table_of(page);
  const auto load =
      std::ranges::find(table.rows, "largest |T_load|", [](const auto& row) { return row.front(); });
  ASSERT_NE(load, table.rows.end());
  EXPECT_EQ(load->at(1), "");
  EXPECT_EQ(load->at(3), "1.25");
}

/// Of one that is given the lines may tell that its loop is unstable, or nothing.
TEST(TunePage, WordsALoopThatAResponseDoesNotTellStable) {
  auto t = test::evaluation();
  t.by_response = true;
  t.machines.clear();
  t.trusted = false;
  auto& c = t.candidates.front();
  c.stable = c.within = false;
  c.draws = 0;
  EXPECT_EQ(sentences(t).front(),
            "The given controller (PI): by the measured response its loop is UNSTABLE.");
  EXPECT_EQ(document(t).badge->word, "Unstable");
  EXPECT_TRUE(holds(summary_text(t), " unstable"));
  t.findings.push_back({"stability-not-told", diagnostics::Severity::error, {}, {}, "It ends too early."});
  EXPECT_EQ(sentences(t).front(),
            "The given controller (PI): by the measured response its loop is NOT TOLD to be stable.");
  const auto text = summary_text(t);
  EXPECT_FALSE(holds(text, "identified machine")) << text;
  EXPECT_FALSE(holds(text, "UNSTABLE") || holds(text, " unstable")) << text;
  EXPECT_TRUE(holds(text, "not told stable")) << text;
  const auto page = document(t);
  EXPECT_EQ(page.badge->word, "Not told stable");
  EXPECT_EQ(page.badge->reason, "by the measured response");
  EXPECT_FALSE(page.badge->good);
}

TEST(TunePage, IsMadeOfWhateverIsThere) {
  const auto page = document(test::full_tuning());
  for (const char* title :
       {"Steps, at position 0.1", "Sensitivity, and what the load does, at position 0.1",
        "Loop, at position 0.1", "What the loop does, at position 0.1", "Controllers that were compared",
        "What the bounds cost", "Gains over position", "Input shapers", "On the simulated machine"})
    EXPECT_TRUE(std::any_of(page.sections.begin(), page.sections.end(), [&](const Section& s) {
      return s.title == title;
    })) << title;
  EXPECT_LT(document_page(page).size(), kPageBytes);
  const auto* run = chart_of(page, "Load, load step");
  ASSERT_NE(run, nullptr);
  ASSERT_EQ(run->curves.size(), 3U);
  EXPECT_EQ(run->curves[1].name, "running controller");
  EXPECT_LE(run->curves[1].x.back(), run->curves[0].x.back());  // though it lasts longer
  const auto least = document(least_tuning());
  EXPECT_EQ(least.sections.size(), 1U);  // the table of controllers
  EXPECT_FALSE(document_page(least).empty());
  // What a file gives back makes the same page.
  const auto t = test::full_tuning();
  EXPECT_EQ(document_json(document(*from_json<Tuning>(to_json(t)))).dump(),
            document_json(document(t)).dump());
}

}  // namespace
}  // namespace resonid::report
