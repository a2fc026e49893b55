// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/gap.hpp>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/detail/compare.hpp>
#include <resonid/report/detail/track.hpp>
#include <resonid/report/detail/validate.hpp>
#include <string>

#include "results.hpp"

namespace resonid::report {
namespace {

using identification::Track;
using identification::TrackSeries;

const Section* section_of(const Document& d, const std::string& title) {
  const auto found =
      std::find_if(d.sections.begin(), d.sections.end(), [&](const Section& s) { return s.title == title; });
  return found == d.sections.end() ? nullptr : &*found;
}

std::vector<std::string> names_of(const Chart& chart) {
  std::vector<std::string> names;
  for (const auto& curve : chart.curves) names.push_back(curve.name);
  return names;
}

/// Four lines, two rows; |G| = 10 k at line k, the last one not known in the second row.
Track tracked_lines() {
  Track t;
  t.record.file = "run/axis.csv";
  t.method = "kalman";
  t.rows = 2;
  t.time_s = {1.0, 2.0};
  t.trusted_rows = {true, true};
  t.residual = t.lag_s = {0.0, 0.0};
  for (int k = 1; k <= 4; ++k) {
    const std::string f = std::to_string(10 * k);
    const double size = 10.0 * k;
    t.lines.push_back({"re_" + f, "", {0.0, 0.0}, {}});
    t.lines.push_back({"im_" + f, "", {-size, -size}, {}});
    t.lines.push_back({"std_" + f, "", {0.1, k == 4 ? 2.0 * size : 0.1}, {}});
  }
  t.trusted = true;
  t.shares.all = 0.875;
  return t;
}

TEST(TrackPage, ShowsTheLinesAsAWaterfall) {
  const auto page = track_document(tracked_lines());
  const auto* section = section_of(page, "Response");
  ASSERT_NE(section, nullptr);
  const auto& map = section->charts.at(0).map;
  ASSERT_TRUE(map);
  EXPECT_EQ(map->x, (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(map->y, (std::vector<double>{10.0, 20.0, 30.0, 40.0}));
  EXPECT_NEAR(map->value[1][0], 20.0 * std::log10(20.0), 1e-12);
  EXPECT_NEAR(map->value[3][0], 20.0 * std::log10(40.0), 1e-12);
  EXPECT_TRUE(std::isnan(map->value[3][1]));  // its standard deviation is twice its magnitude
}

TEST(TrackPage, SaysItsVerdictFirstAndShowsTheRecordingWhereThereIsOne) {
  auto track = tracked_lines();
  EXPECT_EQ(track_document(track).badge->word, "Trusted");
  EXPECT_EQ(section_of(track_document(track), "Input and output"), nullptr);
  track.trusted = false;
  track.findings = {{"not-converged", diagnostics::Severity::error, {}, {}, "It moves."}};
  data::Record record;
  record.sample_rate_hz = 10.0;
  record.input = {"u", "Nm", {1.0, 2.0, 3.0}};
  record.output = {"y", "rad/s", {4.0, 5.0, 6.0}};
  const auto page = track_document(track, record);
  EXPECT_FALSE(page.badge->good);
  EXPECT_EQ(page.badge->reason, "1 error");
  ASSERT_TRUE(page.findings);
  EXPECT_EQ(page.findings->size(), 1U);
  const auto* signals = section_of(page, "Input and output");
  ASSERT_NE(signals, nullptr);
  EXPECT_EQ(signals->charts.at(1).y_label, "y in rad/s");
  EXPECT_EQ(signals->charts.at(1).curves.at(0).y, record.output.samples);
}

class ComparePage : public ::testing::Test {
 protected:
  void SetUp() override {
    first_ = second_ = test::full();
    first_.record.file = "a/before.csv";
    second_.record.file = "a/after.csv";
    second_.model->drive.set(fit::kLoadInertia, 0.04);
    changes_.first = first_.record;
    changes_.second = second_.record;
    changes_.units = first_.units;
    changes_.first_response = first_.response;
    changes_.second_response = second_.response;
    changes_.trusted = true;
  }

  identification::Result first_, second_;
  identification::Changes changes_;
};

TEST_F(ComparePage, NamesTheFilesAndDrawsBothModels) {
  const auto page = document(changes_, ComparedResults{first_, second_});
  EXPECT_EQ(page.title, "after.csv against before.csv");
  const auto* responses = section_of(page, "Responses");
  ASSERT_NE(responses, nullptr);
  EXPECT_EQ(
      names_of(responses->charts.at(0)),
      (std::vector<std::string>{"before.csv", "after.csv", "model of before.csv", "model of after.csv"}));
  EXPECT_EQ(section_of(page, "Loop before and after"), nullptr);  // no controller, no loop
  changes_.second.file = changes_.first.file = "same.csv";
  EXPECT_EQ(document(changes_).title, "same.csv (second) against same.csv (first)");
}

TEST_F(ComparePage, GivesNoPerCentOfWhatMayBeZero) {
  changes_.parameters = {
      {"offset", "Nm", {-4e-7, 1.4e-5}, {1.5e-5, 1.4e-5}, 1.54e-5, 2e-5, -38.5, 0.4, false, {}},
      {"stiffness", "Nm/rad", {144.0, 1.0}, {150.0, 1.0}, 6.0, 1.4, 0.0417, 1e-5, true, {}}};
  const auto page = document(changes_, ComparedResults{first_, second_});
  const auto& rows = section_of(page, "What changed")->plain_tables.at(0).rows;
  EXPECT_EQ(rows.at(0).at(5), "");
  EXPECT_NE(rows.at(1).at(5), "");
}

/// L = C G e^{-jwT}, with the model's G as it was measured.
TEST_F(ComparePage, DrawsTheLoopBeforeAndAfterWithTheController) {
  const data::TransferFunction controller{{2.0}, {1.0}, 0.002};
  const auto page = document(changes_, ComparedResults{first_, second_, controller});
  const auto* loops = section_of(page, "Loop before and after");
  ASSERT_NE(loops, nullptr);
  const Chart& plane = loops->charts.at(0);
  EXPECT_EQ(names_of(plane), (std::vector<std::string>{"before.csv", "after.csv"}));
  const Curve& curve = plane.curves.at(0);
  std::size_t compared = 0;
  double closest = 1e9;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    const std::vector<double> f = {curve.at[i]};
    const auto expected =
        2.0 * first_.model->drive.values(f, true)[0] * std::polar(1.0, -kTwoPi * f[0] * 0.004);
    closest = std::min(closest, std::abs(1.0 + expected));
    if (std::isnan(curve.x[i])) continue;
    EXPECT_NEAR(curve.x[i], expected.real(), 1e-9);
    EXPECT_NEAR(curve.y[i], expected.imag(), 1e-9);
    ++compared;
  }
  EXPECT_GT(compared, 50U);
  const auto circle = std::find_if(plane.shapes.begin(), plane.shapes.end(), [](const Shape& s) {
    return s.name.find("before.csv: modulus margin") == 0;
  });
  ASSERT_NE(circle, plane.shapes.end());
  EXPECT_EQ(circle->x, -1.0);
  EXPECT_NEAR(circle->radius, closest, 1e-3 * closest);
}

TEST_F(ComparePage, LinesThatNothingExcitesAreFaint) {
  changes_.first_response.std = {0.1, 0.1, 0.9};  // the third is known worse than half its magnitude
  const auto page = document(changes_);
  const Chart& magnitude = section_of(page, "Responses")->charts.at(0);
  EXPECT_EQ(magnitude.curves.at(0).x, (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(magnitude.curves.at(1).mark, Curve::Mark::faint);
  EXPECT_EQ(magnitude.curves.at(1).x, (std::vector<double>{3.0}));
}

TEST(BatchPage, ShowsEveryFigureOverTheRecordings) {
  BatchResult result;
  for (const char* file : {"r/one.csv", "r/two.csv"}) {
    identification::BatchEntry entry;
    entry.file = file;
    entry.result = test::full();
    result.batch.entries.push_back(std::move(entry));
  }
  result.batch.entries[1].result->trusted = false;
  identification::Spread spread;
  spread.name = "stiffness";
  spread.unit = "Nm/rad";
  spread.values = {{0, 143.0, 0.5}, {1, 150.0, 1.0}};
  spread.mean = 144.4;
  spread.std = 0.447;
  spread.probability = 1e-6;
  spread.agrees = false;
  result.batch.figures = {spread};
  const auto page = document(result);
  const auto* bars = section_of(page, "Parameters over the recordings");
  ASSERT_NE(bars, nullptr);
  const auto& list = bars->intervals.at(0);
  EXPECT_EQ(list.rows.at(1).name, "two.csv");
  EXPECT_TRUE(list.rows.at(1).marked);
  EXPECT_NEAR(list.rows.at(0).half_width, 1.959964 * 0.5, 1e-5);
  EXPECT_EQ(list.verdict, "differs");
  EXPECT_EQ(page.badge->word, "1 of 2 trusted");
  EXPECT_FALSE(page.badge->good);
  // The verdict stands beside the name, however many figures follow.
  EXPECT_EQ(section_of(page, "Recordings")->plain_tables.at(0).columns.at(1), "verdict");
  EXPECT_EQ(section_of(page, "Recordings")->plain_tables.at(0).rows.at(1).at(1), "NOT trusted");
  // One finding of both recordings, told once.
  ASSERT_EQ(page.findings->size(), 1U);
  EXPECT_EQ(page.findings->front().meaning, "one.csv, two.csv: Coherence falls.");
}

TEST(ValidatePage, OverlayComesFirstAndTheJudgedBandIsShaded) {
  identification::ModelValidation v;
  data::Record record;
  record.sample_rate_hz = 100.0;
  record.output = {"y", "rad/s", {1.0, 2.0, 3.0, 4.0}};
  v.candidate.source = "x/model.json";
  v.record.file = "x/new.csv";
  v.simulated = {1.0, 2.0, 3.0, 3.5};
  v.residual = {0.0, 0.0, 0.0, 0.5};
  v.residual_test.self.value = {0.0, 1.0, 0.0};
  v.residual_test.max_lag = 1;
  v.judged_from_hz = 2.5;
  v.judged_fit_percent = 91.0;
  v.trusted = true;
  const auto page = document(v, record);
  EXPECT_EQ(page.title, "model.json on new.csv");
  EXPECT_EQ(page.sections.at(0).title, "Measured and simulated");
  const Chart& overlay = page.sections[0].charts.at(0);
  EXPECT_EQ(names_of(overlay), (std::vector<std::string>{"measured", "simulated"}));
  EXPECT_EQ(overlay.curves[0].y, record.output.samples);
  const auto* spectrum = section_of(page, "Residual by frequency");
  ASSERT_NE(spectrum, nullptr);
  EXPECT_EQ(spectrum->charts.at(0).shapes.at(0).x, 2.5);
  EXPECT_TRUE(std::any_of(page.cards.begin(), page.cards.end(),
                          [](const Card& c) { return c.name == "Fit where judged" && c.value == "91.0"; }));
}

/// The sheet that is printed holds both responses and not their distance; what is judged as a whole is not
/// shaded.
TEST(ValidatePage, PutsTheJudgedBandIntoCardsTableAndResponses) {
  identification::ModelValidation v;
  data::Record record;
  record.sample_rate_hz = 100.0;
  record.output = {"y", "rad/s", {1.0, 2.0, 3.0, 4.0}};
  v.simulated = {1.0, 2.0, 3.0, 3.5};
  v.residual = {0.0, 0.0, 0.0, 0.5};
  v.residual_test.self.value = {0.0, 1.0, 0.0};
  v.residual_test.max_lag = 1;
  v.measured = v.modelled = test::full().response;
  v.gap = diagnostics::gap_curve(*v.measured, *v.modelled);
  const double first = v.gap->frequency_hz.front(), last = v.gap->frequency_hz.back();
  v.bands = {{0.0, 0.5 * first, 0.1, 0.1, 0.1}, {first, last, 0.1, 0.1, 0.1}};
  v.judged = identification::JudgedBand{first, last, true, 92.5, 0.25};
  const auto page = document(v, record);
  const auto* responses = section_of(page, "Responses");
  ASSERT_NE(responses, nullptr);
  EXPECT_EQ(responses->charts.size(), 2U);
  EXPECT_TRUE(responses->charts.at(0).shapes.empty());
  ASSERT_NE(section_of(page, "Distance of the responses"), nullptr);
  EXPECT_FALSE(section_of(page, "Distance of the responses")->sheet);
  const auto& bands = section_of(page, "Residual by frequency")->plain_tables.at(0);
  EXPECT_EQ(bands.columns.back(), "Judged");
  EXPECT_EQ(bands.rows.at(0).back(), "no");
  EXPECT_EQ(bands.rows.at(1).back(), "yes");
  EXPECT_TRUE(std::any_of(page.cards.begin(), page.cards.end(),
                          [](const Card& c) { return c.name == "Fit where judged" && c.value == "92.5"; }));
  v.judged->high_hz = 0.5 * (first + last);
  EXPECT_EQ(section_of(document(v, record), "Responses")->charts.at(0).shapes.size(), 1U);
}

}  // namespace
}  // namespace resonid::report
