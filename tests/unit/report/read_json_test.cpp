// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/report/json.hpp>

#include "results.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

identification::Result correlated() {
  auto r = test::full();
  r.model->drive.covariance(0, 2) = r.model->drive.covariance(2, 0) = 5e-9;
  r.radius_m = 0.05;
  r.confidence = 0.9;
  return r;
}

identification::Result rigid() {
  auto r = test::bare();
  identification::ModelResult model;
  model.drive.structure = fit::Structure::rigid;
  model.drive.parameters.driven_inertia = 0.064;
  model.drive.parameters.viscous_friction = 0.05;
  model.drive.sample_time_s = 0.002;
  model.drive.estimated = fit::estimated_parameters(fit::Structure::rigid, true, false);
  model.drive.covariance(fit::kDrivenInertia, fit::kDrivenInertia) = 1e-8;
  model.drive.covariance(fit::kViscousFriction, fit::kViscousFriction) = 1e-6;
  model.coulomb_friction = data::Estimate{0.2, 0.01};
  model.from_record = false;
  r.model = model;
  r.validation = identification::Validation{80.0, false, std::nullopt, std::nullopt};
  return r;
}

std::string message(const json& j) {
  const auto result = from_json<identification::Result>(j);
  return result ? std::string() : message_of(result.error());
}

TEST(ReadJson, GivesBackWhatWasWritten) {
  for (const auto& result : {test::bare(), test::full(), correlated(), rigid(), test::listed(),
                             test::distorted(), test::black_box(), test::with_second_output()}) {
    const json j = to_json(result);
    const auto again = from_json<identification::Result>(j);
    ASSERT_TRUE(again) << message_of(again.error());
    EXPECT_EQ(to_json(*again), j);
  }
}

TEST(ReadJson, KeepsTheOptionsThatWereGiven) {
  auto result = test::bare();
  EXPECT_FALSE(to_json(result).contains("options"));
  result.options = {{"output-scale", "-1"}, {"controller", "pi:1,0.1"}};
  json j = to_json(result);
  EXPECT_EQ(j.at("options"), (json{{"output-scale", "-1"}, {"controller", "pi:1,0.1"}}));
  const auto again = from_json<identification::Result>(j);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->options.size(), 2U);
  EXPECT_EQ(to_json(*again), j);
  j["options"]["output-scale"] = -1;
  EXPECT_NE(message(j).find("$.options.output-scale"), std::string::npos) << message(j);
  j.erase("options");
  EXPECT_TRUE(from_json<identification::Result>(j)->options.empty());
}

TEST(ReadJson, KeepsTheCovariance) {
  const auto again = from_json<identification::Result>(to_json(correlated()));
  ASSERT_TRUE(again);
  EXPECT_DOUBLE_EQ(again->model->drive.covariance(0, 2), 5e-9);
  EXPECT_DOUBLE_EQ(again->model->drive.resonance().std, correlated().model->drive.resonance().std);
}

TEST(ReadJson, KeepsTheLists) {
  const auto again = from_json<identification::Result>(to_json(test::listed()));
  ASSERT_TRUE(again) << message_of(again.error());
  ASSERT_EQ(again->structures.size(), 3U);
  EXPECT_TRUE(again->structures[1].chosen);
  EXPECT_DOUBLE_EQ(again->structures[1].bic, -300.25);
  EXPECT_FALSE(again->structures[2].holdout_fit_percent);
  ASSERT_EQ(again->roots.size(), 3U);
  EXPECT_EQ(again->roots[2].kind, "zero");
  EXPECT_DOUBLE_EQ(again->roots[0].covariance(0, 1), 0.01);
  ASSERT_TRUE(again->bootstrap);
  EXPECT_EQ(again->bootstrap->failed, 3U);
  EXPECT_DOUBLE_EQ(again->bootstrap->intervals[0].high, 144.6);
  EXPECT_EQ(again->bootstrap->intervals[1].values, (std::vector<double>{0.85, 0.86, 0.84}));
  EXPECT_EQ(again->choices[1].because, "It has the least criterion.");
  EXPECT_DOUBLE_EQ(*again->loop->gain_margin_std_db, 0.2);
}

TEST(ReadJson, KeepsTheBlackBox) {
  const auto again = from_json<identification::Result>(to_json(test::black_box()));
  ASSERT_TRUE(again) << message_of(again.error());
  ASSERT_TRUE(again->black_box);
  EXPECT_FALSE(again->model);
  EXPECT_EQ(again->black_box->model.delay_samples, 2U);
  ASSERT_TRUE(again->black_box->further_delay);
  EXPECT_DOUBLE_EQ(again->black_box->further_delay->std, 2e-5);
  EXPECT_DOUBLE_EQ(again->black_box->model.covariance(1, 4), 2e-7);
}

TEST(ReadJson, RefusesListsThatAreWrong) {
  nlohmann::json j = to_json(test::listed());
  j["poles"][0]["covariance"] = {{1.0, 0.0}};
  j["bootstrap"]["intervals"][0]["std"] = -1.0;
  j["structures"][0].erase("chosen");
  EXPECT_EQ(message(j),
            "$.structures[0].chosen: found nothing, required this key\n"
            "$.poles[0].covariance: found an array of 1, required 2 rows\n"
            "$.bootstrap.intervals[0].std: found -1.0, required a number >= 0");
}

TEST(ReadJson, RefusesDistortionThatIsWrong) {
  nlohmann::json j = to_json(test::distorted());
  j["distortion"]["noise_std"] = {0.1};
  j["distortion"]["scatter"].erase("significant");
  j["distortion"]["detection_lines"]["odd"]["level"] = -1.0;
  EXPECT_EQ(message(j),
            "$.distortion.noise_std: found an array of 1, required as many numbers as the frequency response "
            "has lines\n"
            "$.distortion.scatter.significant: found nothing, required this key\n"
            "$.distortion.detection_lines.odd.level: found -1.0, required a number >= 0");
}

TEST(ReadJson, TakesResultsWithoutCovariance) {
  json j = to_json(correlated());
  j["model"].erase("covariance");
  const auto again = from_json<identification::Result>(j);
  ASSERT_TRUE(again);
  EXPECT_DOUBLE_EQ(again->model->drive.covariance(0, 2), 0.0);
  EXPECT_NEAR(again->model->drive.estimate(fit::kStiffness).std, 1e-4, 1e-12);
}

TEST(ReadJson, PassesOverWhatTheSchemaDoesNotName) {
  json j = to_json(test::full());
  j["page"] = {{"title", "x"}};
  j["model"]["remark"] = 3;
  EXPECT_TRUE(from_json<identification::Result>(j));
}

TEST(ReadJson, NamesEveryKeyThatIsMissing) {
  const json whole = to_json(test::full());
  for (const char* pointer : {"/schema",
                              "/record",
                              "/record/file",
                              "/record/samples",
                              "/record/sample_rate_hz",
                              "/record/signals",
                              "/record/signals/input",
                              "/record/signals/output",
                              "/method",
                              "/approach",
                              "/frequency_response",
                              "/frequency_response/frequency_hz",
                              "/frequency_response/real",
                              "/frequency_response/imag",
                              "/resonances",
                              "/resonances/0/kind",
                              "/resonances/1/frequency_hz",
                              "/resonances/0/source",
                              "/model/structure",
                              "/model/parameters",
                              "/model/parameters/driven_inertia",
                              "/model/parameters/load_inertia",
                              "/model/parameters/stiffness",
                              "/model/parameters/damping/value",
                              "/model/transfer_function",
                              "/model/transfer_function/sample_time_s",
                              "/loop/modulus_margin",
                              "/validation/fit_percent",
                              "/trusted",
                              "/findings",
                              "/findings/0/id",
                              "/findings/0/meaning"}) {
    const json::json_pointer at(pointer);
    json j = whole;
    j.at(at.parent_pointer()).erase(at.back());
    std::string path = "$";
    for (const char* c = pointer; *c != 0; ++c) path += *c == '/' ? '.' : *c;
    for (const char* digit : {"0", "1"})
      if (const auto i = path.find("." + std::string(digit) + "."); i != std::string::npos)
        path.replace(i, 3, "[" + std::string(digit) + "].");
    EXPECT_EQ(message(j).rfind(path + ": found nothing, required this key", 0), 0U) << path << "\n"
                                                                                    << message(j);
  }
}

TEST(ReadJson, NamesWhatWasFoundAndWhatIsRequired) {
  const json whole = to_json(test::full());
  const auto with = [&](const char* pointer, const json& value) {
    json j = whole;
    j[json::json_pointer(pointer)] = value;
    return message(j);
  };
  EXPECT_EQ(with("/schema", "resonid.track/1"),
            "$.schema: found \"resonid.track/1\", required one of \"resonid.identification/1\", "
            "\"resonid.identifications/1\"");
  EXPECT_EQ(message(json::object()), "$.schema: found nothing, required this key");
  EXPECT_EQ(with("/model/parameters/stiffness/value", "143.75"),
            "$.model.parameters.stiffness.value: found \"143.75\", required a number");
  EXPECT_EQ(with("/model/parameters/stiffness/value", -3.0),
            "$.model.parameters.stiffness.value: found -3.0, required a number > 0");
  EXPECT_EQ(with("/model/parameters/stiffness", 143.75),
            "$.model.parameters.stiffness: found 143.75, required an object");
  EXPECT_EQ(with("/model/structure", "two-masses"),
            "$.model.structure: found \"two-masses\", required one of \"rigid\", \"two-mass\", "
            "\"three-mass\", \"black-box\"");
  EXPECT_EQ(with("/record/sample_rate_hz", 0), "$.record.sample_rate_hz: found 0, required a number > 0");
  EXPECT_EQ(with("/record/samples", -1), "$.record.samples: found -1, required a whole number >= 0");
  EXPECT_EQ(with("/trusted", nullptr), "$.trusted: found null, required true or false");
  EXPECT_EQ(
      with("/frequency_response/real", json{1.0, 2.0}),
      "$.frequency_response.real: found an array of 2, required as many numbers as frequency_hz has, 3");
  EXPECT_EQ(with("/frequency_response/frequency_hz", json{1.0, 3.0, 2.0}),
            "$.frequency_response.frequency_hz: found an array of 3, required ascending frequencies >= 0");
  EXPECT_EQ(with("/frequency_response/imag/1", "x"),
            "$.frequency_response.imag[1]: found \"x\", required a number");
  EXPECT_EQ(with("/frequency_response/std/2", -0.1),
            "$.frequency_response.std[2]: found -0.1, required a number >= 0");
  EXPECT_EQ(with("/resonances/1/kind", 7),
            "$.resonances[1].kind: found 7, required one of \"resonance\", \"antiresonance\"");
  EXPECT_EQ(with("/method", json::array()), "$.method: found an array of 0, required a text");
  EXPECT_EQ(message(json::array({1, 2})), "$: found an array of 2, required an object");
}

TEST(ReadJson, NamesAllThatIsWrong) {
  json j = to_json(test::full());
  j["method"] = 1;
  j["record"].erase("file");
  j["loop"]["modulus_margin"] = "much";
  const auto result = from_json<identification::Result>(j);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().field, "$.record.file");
  EXPECT_EQ(message_of(result.error()),
            "$.record.file: found nothing, required this key\n"
            "$.method: found 1, required a text\n"
            "$.loop.modulus_margin: found \"much\", required a number");
}

}  // namespace
}  // namespace resonid::report
