// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <resonid/identification/batch.hpp>
#include <resonid/identification/detail/cross_validation.hpp>
#include <resonid/identification/join.hpp>

#include "experiments.hpp"

namespace resonid::identification {
namespace {

plant::ExperimentConfig experiment(std::uint64_t seed, double stiffness = 5.75e4) {
  auto c = test::published_drive(0.1, 10.0, seed);
  test::prbs(c);
  c.run.duration_s = 4.0;
  c.drive.stiffness = stiffness;
  return c;
}

data::Record record_of(const plant::ExperimentConfig& c, const std::string& name) {
  auto record = test::simulated(c).record;
  record.source = name;
  return record;
}

/// Records as if read from files; the stiffness may differ in each.
struct Bench {
  std::vector<data::Record> records;
  Options options;
  explicit Bench(const std::vector<double>& stiffness) {
    for (std::size_t i = 0; i < stiffness.size(); ++i) {
      const auto c = experiment(i + 1, stiffness[i]);
      records.push_back(record_of(c, "r" + std::to_string(i + 1)));
      options = test::known(c);
    }
  }
  [[nodiscard]] BatchTask task() const {
    BatchTask task;
    for (const auto& r : records) task.files.push_back(r.source);
    task.load = [this](std::size_t i) -> expected<BatchJob, Error> {
      if (records[i].samples() == 0) return tl::unexpected(Error{"", "is empty"});
      return BatchJob{records[i], options};
    };
    return task;
  }
  [[nodiscard]] std::vector<Result> results() const {
    std::vector<Result> list;
    for (const auto& r : records) list.push_back(*identify(r, options));
    return list;
  }
};

constexpr double kStiffness = 5.75e4;

TEST(Batch, GivesWhatIdentifyGivesOneByOne) {
  const Bench bench(std::vector<double>(3, kStiffness));
  auto task = bench.task();
  task.jobs = 3;
  const auto batch = identify_batch(task);
  ASSERT_TRUE(batch.complete());
  for (std::size_t i = 0; i < 3; ++i) {
    const auto single = identify(bench.records[i], bench.options);
    ASSERT_TRUE(single);
    const auto a = figures(*single), b = figures(*batch.entries[i].result);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      EXPECT_EQ(a[k].name, b[k].name);
      EXPECT_EQ(a[k].value, b[k].value) << a[k].name;
      EXPECT_EQ(a[k].std, b[k].std) << a[k].name;
    }
    EXPECT_EQ(single->response.value, batch.entries[i].result->response.value);
  }
}

TEST(Batch, GoesOnAfterABrokenRecord) {
  Bench bench(std::vector<double>(3, kStiffness));
  bench.records[1].output.samples.clear();
  auto task = bench.task();
  std::size_t told = 0;
  task.progress = [&](std::size_t done, const BatchEntry&) { EXPECT_EQ(done, ++told); };
  const auto batch = identify_batch(task);
  EXPECT_EQ(told, 3U);
  EXPECT_FALSE(batch.complete());
  EXPECT_TRUE(batch.entries[0].result);
  EXPECT_EQ(batch.entries[1].error.requirement, "is empty");
  EXPECT_TRUE(batch.entries[2].result);
  for (const auto& f : batch.figures) EXPECT_EQ(f.values.size(), 2U) << f.name;
}

BatchEntry entry(double hz, double std) {
  Result r;
  r.modes = {{false, {hz, std}}};
  return {"x", r, {}};
}

TEST(Batch, HoldsScatterAgainstErrorBars) {
  // Of 10 +- 1 and 13 +- 2: mean (10 + 13/4)/(1 + 1/4) = 10.6, chi2 = 9/5 = 1.8, p = erfc(sqrt(0.9)).
  const std::vector<BatchEntry> two = {entry(10.0, 1.0), entry(13.0, 2.0)};
  const auto list = spread(two, 0.95);
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0].name, "resonance_hz");
  EXPECT_NEAR(list[0].mean, 10.6, 1e-12);
  EXPECT_NEAR(*list[0].std, std::sqrt(0.8), 1e-12);
  EXPECT_NEAR(*list[0].chi_square, 1.8, 1e-12);
  EXPECT_NEAR(*list[0].probability, std::erfc(std::sqrt(0.9)), 1e-12);
  EXPECT_TRUE(list[0].agrees);
  // Three records: two degrees of freedom, p = exp(-chi2/2). 10, 13, 16 with 1 each: chi2 = 18.
  const std::vector<BatchEntry> three = {entry(10.0, 1.0), entry(13.0, 1.0), entry(16.0, 1.0)};
  const auto apart = spread(three, 0.95);
  EXPECT_NEAR(*apart[0].probability, std::exp(-9.0), 1e-12);
  EXPECT_FALSE(apart[0].agrees);
  EXPECT_NEAR(apart[0].deviation, 3.0, 1e-12);
}

TEST(Batch, FindsTheMachineThatDiffers) {
  const Bench bench({kStiffness, kStiffness, 1.1 * kStiffness});
  const auto batch = identify_batch(bench.task());
  ASSERT_TRUE(batch.complete());
  for (const auto& f : batch.figures) {
    if (f.name == "resonance_hz") {
      EXPECT_FALSE(f.agrees);
    }
  }
}

TEST(Join, HasTheAccuracyOfAllRecords) {
  const Bench bench(std::vector<double>(4, kStiffness));
  const auto results = bench.results();
  const auto joint = join(bench.records, results, bench.options);
  ASSERT_TRUE(joint) << joint.error().requirement;
  ASSERT_TRUE(joint->result.model);
  EXPECT_TRUE(joint->result.trusted);
  const auto all = figures(joint->result), one = figures(results[0]);
  const struct {
    const char* name;
    double truth;
  } expected[] = {
      {"stiffness", 143.75}, {"damping", 0.3}, {"driven_inertia", 0.032}, {"load_inertia", 0.032}};
  for (const auto& e : expected) {
    const auto* joined = find(all, e.name);
    ASSERT_NE(joined, nullptr) << e.name;
    EXPECT_NEAR(joined->value, e.truth, 3.5 * *joined->std) << e.name;
    // Four equal records: half the error bar of one; each knows its own to some per cent only.
    EXPECT_NEAR(*joined->std / *find(one, e.name)->std, 0.5, 0.1) << e.name;
  }
  for (std::size_t i = 0; i < joint->records.size(); ++i) {
    const auto& r = joint->records[i];
    EXPECT_TRUE(r.agrees) << r.file;
    EXPECT_GT(*r.probability, 1e-3) << r.file;
    // The record's own model, with parameters of its own, simulates it hardly better.
    EXPECT_NEAR(*r.fit_percent, results[i].validation->fit_percent, 0.5) << r.file;
  }
  ASSERT_TRUE(joint->response_chi_square);
  EXPECT_LT(*joint->response_chi_square, 1.5);
  EXPECT_EQ(joint->result.record.samples, 4 * bench.records[0].samples());
}

TEST(Join, AveragesTheResponse) {
  const Bench bench(std::vector<double>(4, kStiffness));
  const auto results = bench.results();
  const auto joint = join(bench.records, results, bench.options);
  ASSERT_TRUE(joint);
  const auto& g = joint->result.response;
  const auto truth = test::simulated(experiment(1), g.frequency_hz).truth.response;
  double one = 0.0, all = 0.0;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    one += std::norm((results[0].response.at(g.frequency_hz[i]) - truth.value[i]) / truth.value[i]);
    all += std::norm((g.value[i] - truth.value[i]) / truth.value[i]);
  }
  EXPECT_LT(std::sqrt(all / one), 0.75);
}

TEST(Join, NamesTheRecordThatDisagrees) {
  const Bench bench({kStiffness, kStiffness, kStiffness, 1.1 * kStiffness});
  const auto results = bench.results();
  const auto joint = join(bench.records, results, bench.options);
  ASSERT_TRUE(joint);
  EXPECT_FALSE(joint->records[3].agrees);
  EXPECT_FALSE(joint->result.trusted);
  bool found = false;
  for (const auto& f : joint->result.findings)
    if (f.id == "records-disagree") {
      found = true;
      EXPECT_NE(f.meaning.find("r4"), std::string::npos) << f.meaning;
    }
  EXPECT_TRUE(found);
}

TEST(Join, RefusesRecordsThatCannotBeJoined) {
  Bench bench(std::vector<double>(2, kStiffness));
  const auto results = bench.results();
  EXPECT_FALSE(join(std::span(bench.records).first(1), std::span(results).first(1), bench.options));
  auto other = bench.records;
  other[1].sample_rate_hz = 1000.0;
  const auto rate = join(other, results, bench.options);
  ASSERT_FALSE(rate);
  EXPECT_NE(rate.error().requirement.view().find("1000 Hz"), std::string::npos) << rate.error().requirement;
  auto volts = results;
  volts[1].units.response = "(rad/s)/V";
  const auto unit = join(bench.records, volts, bench.options);
  ASSERT_FALSE(unit);
  EXPECT_NE(unit.error().requirement.view().find("(rad/s)/V"), std::string::npos) << unit.error().requirement;
}

TEST(CrossValidation, AcceptsTheMachineAndRejectsAnother) {
  Bench bench({});
  for (const std::uint64_t seed :
       {1U, 2U}) {  // whole periods, so that the response to compare with is unbiased
    auto c = experiment(seed);
    c.run.duration_s = 5.0 * 1023.0 / c.run.sample_rate_hz;
    c.measurement.noise_rms = 0.01;  // the response that validate() compares with is biased where noise rules
    bench.records.push_back(record_of(c, "r"));
    bench.options = test::known(c);
  }
  auto result = *identify(bench.records[0], bench.options);
  ASSERT_TRUE(result.model && result.trusted);
  auto same = result;
  ASSERT_TRUE(validate_on(bench.records[1], bench.options, same));
  EXPECT_EQ(same.independent->verdict, "accepted");
  EXPECT_TRUE(same.trusted);
  auto heavy = experiment(3);
  heavy.drive.load_inertia *= 3.0;
  heavy.drive.driven_inertia *= 3.0;
  ASSERT_TRUE(validate_on(record_of(heavy, "heavy"), bench.options, result));
  EXPECT_EQ(result.independent->verdict, "rejected");
  EXPECT_EQ(result.independent->file, "heavy");
  EXPECT_FALSE(result.trusted);
}

TEST(CrossValidation, ComparesTheKeptStructures) {
  const Bench bench({kStiffness, kStiffness});
  auto options = bench.options;
  options.model = ModelChoice::rigid;
  const auto rigid = *identify(bench.records[0], options);
  auto result = *identify(bench.records[0], bench.options);
  ASSERT_TRUE(rigid.model && result.model);
  StructureTrial one, two;
  one.name = "rigid";
  one.model = rigid.model;
  two.name = "two-mass";
  two.model = result.model;
  two.chosen = true;
  result.structures = {one, two};
  ASSERT_TRUE(validate_on(bench.records[1], bench.options, result));
  ASSERT_TRUE(result.structures[0].independent_fit_percent && result.structures[1].independent_fit_percent);
  EXPECT_GT(*result.structures[1].independent_fit_percent, *result.structures[0].independent_fit_percent);
}

}  // namespace
}  // namespace resonid::identification
