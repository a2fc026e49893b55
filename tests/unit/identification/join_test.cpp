// SPDX-License-Identifier: MIT
// Joint estimates of records that differ in what may differ, against simulation truth and Cramer-Rao bound.
#include <gtest/gtest.h>

#include <algorithm>
#include <joined_records.hpp>
#include <resonid/identification/detail/figures.hpp>
#include <resonid/plant/detail/white_noise.hpp>

namespace resonid::identification {
namespace {

std::string chosen(const Result& result, const std::string& what) {
  for (const auto& c : result.choices)
    if (c.what == what) return c.chosen;
  return {};
}

/// Truth where chi-square of four degrees lies with 99.9 %, error bars within 12 % of the bound.
void expect_at_the_bound(const Joint& joint, const test::JoinedRecords& bench) {
  ASSERT_TRUE(joint.result.model);
  const auto& model = joint.result.model->drive;
  ASSERT_EQ(model.structure, fit::Structure::two_mass);
  EXPECT_LT(test::normalised_error(model, bench.experiments.front()), 18.5);
  const Eigen::Array4d stated = test::logarithmic_covariance(model).diagonal().array();
  const Eigen::Array4d bound = bench.bound().diagonal().array();
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(std::sqrt(stated(i) / bound(i)), 1.0, 0.12) << i;
}

TEST(Join, RecordsThatSayLittleAloneTellTheMachineTogether) {
  auto bench = test::narrow_bands(1);
  const auto joint = bench.joined();
  const auto two_masses = std::count_if(bench.results.begin(), bench.results.end(), [](const Result& r) {
    return r.model && r.model->drive.structure == fit::Structure::two_mass;
  });
  EXPECT_LT(two_masses, 3);
  expect_at_the_bound(joint, bench);
  EXPECT_EQ(chosen(joint.result, "estimate"), "one likelihood over 4 recordings");
}

TEST(Join, EveryRecordHasItsOwnOffsetStateNoiseAndLength) {
  const struct {
    double noise, speed, duration_s, offset;
  } runs[] = {{0.05, 10.0, 1.5, 0.0}, {0.3, -4.0, 4.0, 0.8}, {0.1, 25.0, 2.5, -0.5}};
  test::JoinedRecords bench;
  for (const auto& run : runs) {
    auto c = test::published_drive(run.noise, run.speed, 20 + bench.records.size());
    test::prbs(c);
    c.run.duration_s = run.duration_s + 1.0;
    auto record = test::cut_from(test::simulated(c).record, 1.0);  // the machine moves already
    for (double& u : record.input.samples) u += run.offset;
    record.excitation = {};  // no feedback can be told from a torque with an offset
    bench.add(c, std::move(record));
    bench.options.delay_s = c.measurement.delay_s;
  }
  const auto joint = bench.joined();
  expect_at_the_bound(joint, bench);
  for (const auto& r : joint.records) EXPECT_TRUE(r.own_estimate && r.agrees) << r.file;
}

bool differs(const Joint& joint, diagnostics::Severity severity) {
  return std::any_of(joint.result.findings.begin(), joint.result.findings.end(), [&](const auto& f) {
    return f.id == "differs-between-records" && f.severity == severity;
  });
}

/// Four records of one machine, and the same with a stiffness that scatters by 1 % between them.
TEST(Join, ScatterBetweenRecordsIsToldAndHeld) {
  for (const double scatter : {0.0, 0.01}) {
    test::JoinedRecords bench;
    for (const double sign : {1.0, -1.0, -0.5, 0.5}) {
      auto c = test::published_drive(0.05, 10.0, 40 + bench.records.size());
      test::prbs(c);
      c.drive.stiffness *= 1.0 + sign * scatter;
      bench.add(c);
      bench.options = test::known(c);
    }
    const auto joint = bench.joined();
    ASSERT_TRUE(joint.result.model);
    const auto stiffness = joint.result.model->drive.estimate(fit::kStiffness);
    EXPECT_EQ(differs(joint, diagnostics::Severity::error), scatter > 0.0);
    EXPECT_EQ(joint.result.trusted, scatter == 0.0);
    EXPECT_NEAR(stiffness.value, 143.75, 4.0 * stiffness.std);
    if (scatter > 0.0) {
      EXPECT_GT(stiffness.std, 0.5 * scatter * 143.75);
    }
  }
}

TEST(Join, RepeatsAllExperimentsTogether) {
  auto bench = test::narrow_bands(1);
  bench.options.bootstrap = 40;
  const auto joint = bench.joined();
  ASSERT_TRUE(joint.result.model && joint.result.bootstrap);
  EXPECT_GE(joint.result.bootstrap->replicas, 38U);
  const auto told = figures(joint.result);
  std::size_t compared = 0;
  for (const auto& i : joint.result.bootstrap->intervals) {
    const auto* figure = find(told, i.name);
    if (figure == nullptr || !figure->std) continue;
    ++compared;
    EXPECT_NEAR(i.std / *figure->std, 1.0, 0.4) << i.name;  // 40 replicas: 11 %
  }
  EXPECT_GE(compared, 6U);
}

/// Noise on the recorded input: the loop's controller is that which all records show, and its error is in the
/// margins.
TEST(Join, TakesTheControllerOfAllRecords) {
  test::JoinedRecords bench;
  bench.options.delay_s = 0.004;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto c = test::published_drive(0.1, 10.0, seed);
    test::prbs(c);
    c.excitation.register_length = 12;
    c.excitation.amplitude = 2.1;
    c.run.duration_s = 8.0;
    auto record = test::simulated(c).record;
    plant::WhiteNoise noise(700 + seed, 0.3);
    for (double& u : record.input.samples) u += noise.step();
    bench.add(c, std::move(record));
  }
  const auto joint = bench.joined();
  ASSERT_TRUE(joint.result.model && joint.result.loop && joint.result.loop->phase_margin_std_deg);
  EXPECT_LT(test::normalised_error(joint.result.model->drive, bench.experiments.front()), 18.5);
  const double std = *joint.result.loop->phase_margin_std_deg;
  EXPECT_NEAR(*joint.result.loop->margins.phase_margin_deg(), 63.49, 3.5 * std);
  ASSERT_TRUE(bench.results.front().loop && bench.results.front().loop->phase_margin_std_deg);
  EXPECT_NEAR(std / *bench.results.front().loop->phase_margin_std_deg, 1.0 / std::sqrt(3.0), 0.15);
}

/// Four seconds of PRBS in a noisy loop each.
test::JoinedRecords in_the_loop() {
  test::JoinedRecords bench;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto c = test::published_drive(0.3, 10.0, seed);
    test::prbs(c);
    c.run.duration_s = 4.0;
    bench.add(c);
    bench.options = test::known(c);
  }
  bench.options.approach = Approach::indirect;
  bench.options.model = ModelChoice::two_mass;
  return bench;
}

TEST(Join, TheKnownControllerPredictsWhereItIsAskedFor) {
  auto bench = in_the_loop();
  const auto joint = bench.joined();
  ASSERT_TRUE(joint.result.model);
  const auto& model = joint.result.model->drive;
  EXPECT_LT(test::normalised_error(model, bench.experiments.front()), 18.5);
  fit::OutputErrorConfig config;
  config.initial = model;
  config.initial.parameters = {0.032, 0.032, 143.75, 0.3, 0.0};
  config.viscous_friction = model.estimated[fit::kViscousFriction];
  config.delay = model.estimated[fit::kDelay];
  config.known_delay_s = bench.options.delay_s;
  config.predictor = fit::Predictor::closed_loop;
  config.controller = bench.options.controller;
  const auto closed = fit::fit_output_error(bench.records, config);
  config.predictor = fit::Predictor::open_loop;
  const auto open = fit::fit_output_error(bench.records, config);
  ASSERT_TRUE(closed && open);
  const auto apart = [&](const fit::DriveModel& other) {
    return std::abs(model.parameters.stiffness / other.parameters.stiffness - 1.0);
  };
  EXPECT_LT(apart(closed->model), 1e-4);
  EXPECT_GT(apart(open->model), 1e-3);
}

TEST(Join, TheExcitationIsReconstructedAsForOneRecord) {
  auto bench = in_the_loop();
  const auto recorded = bench.joined();
  bench.results.clear();
  for (auto& record : bench.records) record.excitation = {};
  const auto reconstructed = bench.joined();
  ASSERT_TRUE(recorded.result.model && reconstructed.result.model);
  EXPECT_NEAR(reconstructed.result.model->drive.parameters.stiffness /
                  recorded.result.model->drive.parameters.stiffness,
              1.0, 1e-3);
}

TEST(Join, DroppedPeriodsAreNotFitted) {
  test::JoinedRecords bench, cut;
  constexpr std::size_t kPeriod = 511;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    auto c = test::published_drive(0.05, 10.0, seed);
    c.excitation.kind = online::Kind::prbs;
    c.excitation.register_length = 9;
    c.run.duration_s = 4.0 * kPeriod / c.run.sample_rate_hz;
    auto record = test::simulated(c).record;
    for (std::size_t k = 0; k < kPeriod; ++k)  // somebody pushes
      record.output.samples[k] += 3.0 * std::sin(0.05 * static_cast<double>(k));
    cut.add(c, test::cut_from(record, kPeriod / c.run.sample_rate_hz));
    bench.add(c, std::move(record));
    bench.options = cut.options = test::known(c);
  }
  bench.options.drop_periods = 1;
  const auto dropped = bench.joined();
  expect_at_the_bound(dropped, cut);
  const auto expected = cut.joined();
  EXPECT_EQ(dropped.result.model->drive.parameters.stiffness,
            expected.result.model->drive.parameters.stiffness);
  EXPECT_EQ(dropped.records[0].fit_percent, expected.records[0].fit_percent);
  bench.options.drop_periods = 4;
  const auto none = join(bench.records, bench.results, bench.options);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().field, "drop_periods");
}

TEST(Join, ARecordWithoutAnEstimateIsToldSo) {
  test::JoinedRecords bench;
  for (const double amplitude : {1.0, 1.0, 0.002}) {
    auto c = test::published_drive(0.1, 10.0, 1 + bench.records.size());
    test::prbs(c);
    c.run.duration_s = 3.0;
    c.excitation.amplitude = amplitude;
    c.controller.kind = plant::ControllerKind::none;
    c.motion = {};
    bench.add(c);
    bench.options.delay_s = c.measurement.delay_s;
  }
  const auto joint = bench.joined();
  expect_at_the_bound(joint, bench);
  EXPECT_TRUE(joint.records[0].own_estimate && joint.records[1].own_estimate);
  EXPECT_FALSE(joint.records[2].own_estimate);
  EXPECT_TRUE(joint.records[2].agrees);
  EXPECT_FALSE(joint.records[2].chi_square);
  const auto* told = test::finding(joint.result, "undetermined-record");
  ASSERT_NE(told, nullptr);
  EXPECT_NE(told->meaning.find("r3"), std::string::npos) << told->meaning;
}

TEST(Join, RefusesBlackBoxes) {
  test::JoinedRecords bench = test::narrow_bands(1);
  Options options = bench.options;
  options.model = ModelChoice::black_box;
  const std::vector<Result> results(bench.records.size());
  const auto refused = join(bench.records, results, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().field, "records");
  EXPECT_NE(refused.error().requirement.view().find(".model auto"), std::string::npos)
      << refused.error().requirement;
}

}  // namespace
}  // namespace resonid::identification
