// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>
#include <resonid/data/two_mass.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/plant/detail/white_noise.hpp>

#include "experiments.hpp"
#include "track_errors.hpp"

// `track` as a user runs it, over experiments whose truth the simulator knows.
namespace resonid {
namespace {

using identification::Track;
using identification::TrackMethod;
using identification::TrackOptions;
using test::errors_of;
using test::tracked;
using test::TrackErrors;

class ToothBelt : public ::testing::TestWithParam<const char*> {};

// Nothing that auto picks is off by more than 2 % after the first second: as it is, and where physical is
// ruled out because a memory is wanted.
TEST_P(ToothBelt, WhatAutoPicksIsNeverOffByMoreThanTwoPerCent) {
  auto config = io::shipped_experiment(GetParam());
  for (const std::uint64_t seed : {301U, 303U, 306U}) {
    config.run.seed = seed;
    const auto simulation = test::simulated(config);
    auto options = test::known_to_track(config);
    const Track physical = tracked(simulation.record, options);
    EXPECT_EQ(physical.method, "physical");
    const TrackErrors p = errors_of(physical, *simulation.truth.over_time, 1.0);
    EXPECT_LT(p.greatest, 0.02) << GetParam() << " seed " << seed;
    EXPECT_LT(p.rms, 0.003) << GetParam() << " seed " << seed;
    EXPECT_TRUE(physical.trusted);
    EXPECT_GT(physical.shares.all, 0.9);

    options.memory_s = 0.1;
    const Track iv = tracked(simulation.record, options);
    EXPECT_EQ(iv.method, "iv");
    EXPECT_LT(errors_of(iv, *simulation.truth.over_time, 1.0).greatest, 0.02)
        << GetParam() << " seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(SampleTimes, ToothBelt,
                         ::testing::Values("ii_iii_tooth_prbs", "ii_iii_tooth_prbs_2ms"));

// The recursions that are locally unstable there say so, are not trusted, and are not what auto takes.
TEST(Tracking, UnstableRecursionsAreNotTrusted) {
  const auto config = io::shipped_experiment("ii_iii_tooth_prbs_2ms");
  const auto simulation = test::simulated(config);
  auto options = test::known_to_track(config);
  for (const auto method : {TrackMethod::output_error, TrackMethod::closed_loop_output_error}) {
    options.method = method;
    const Track track = tracked(simulation.record, options);
    EXPECT_GT(errors_of(track, *simulation.truth.over_time, 1.0).rms, 0.1) << track.method;
    EXPECT_FALSE(track.trusted) << track.method;
    const auto found = std::find_if(track.findings.begin(), track.findings.end(),
                                    [](const auto& f) { return f.id == "locally-unstable"; });
    ASSERT_NE(found, track.findings.end()) << track.method;
    EXPECT_LT(*found->value, 0.0);
  }
}

// A belt that loosens stays trusted while it does, however far apart the rows are.
TEST(Tracking, TrustDoesNotDependOnTheDistanceOfTheRows) {
  const auto config = io::shipped_experiment("belt_loosens");
  const auto simulation = test::simulated(config);
  auto options = test::known_to_track(config);
  for (const std::size_t every : {1U, 25U, 100U}) {
    options.every = every;
    const Track track = tracked(simulation.record, options);
    EXPECT_TRUE(track.trusted) << every;
    EXPECT_GT(track.shares.converged, 0.98) << every;
  }
}

// On the described time the instrumental variables have no lag: with raw time they have.
TEST(Tracking, DescribedTimeTakesTheLagOut) {
  const auto config = io::shipped_experiment("ii_iii_tooth_prbs");
  const auto simulation = test::simulated(config);
  auto options = test::known_to_track(config);
  options.method = TrackMethod::instrumental_variables;
  options.memory_s = 0.4;
  const TrackErrors described =
      errors_of(tracked(simulation.record, options), *simulation.truth.over_time, 2.0);
  options.raw_time = true;
  const TrackErrors raw = errors_of(tracked(simulation.record, options), *simulation.truth.over_time, 2.0);
  EXPECT_LT(described.rms, 0.5 * raw.rms);
}

TEST(Tracking, PublicationVIsSlidingDftAndPhysicalTracker) {
  const auto config = io::shipped_experiment("v_tooth_multisine");
  const auto simulation = test::simulated(config);
  TrackOptions options;
  options.common.delay_s = config.measurement.delay_s;
  options.kept_rows = 2000;
  EXPECT_LT(errors_of(tracked(simulation.record, options), *simulation.truth.over_time, 1.0).rms, 0.003);
  options.method = TrackMethod::sliding_dft;
  EXPECT_LT(errors_of(tracked(simulation.record, options), *simulation.truth.over_time, 1.0).rms, 0.005);
}

/// A belt drive in open loop whose excitation ends after half of the record.
data::Record silent_half(double noise) {
  const data::TwoMassParameters machine{0.032, 0.032, 143.75, 0.3, 0.0};
  fit::DriveModel drive;
  drive.parameters = machine;
  drive.sample_time_s = 0.004;
  data::Record record;
  record.source = "half";
  record.sample_rate_hz = 250.0;
  constexpr std::size_t kSamples = 5000;
  auto prbs = online::Prbs::create({.sample_rate_hz = 250.0, .amplitude = 1.0, .register_length = 15});
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double level = prbs->step();
    record.excitation.samples.push_back(k < kSamples / 2 ? level : 0.0);
  }
  record.excitation.name = "ru";
  record.input = {"u", "Nm", record.excitation.samples};
  plant::WhiteNoise white(7, noise);
  record.output = {"y", "rad/s", drive.transfer_function().simulate(record.input.samples)};
  for (double& y : record.output.samples) y += white.step();
  return record;
}

TEST(Tracking, WithoutExcitationTheEstimateIsHeldAndNotTrusted) {
  const double true_hz = 15.086;
  for (const auto method : {TrackMethod::physical, TrackMethod::arx}) {
    // ARX is biased by output noise (docs/methods/arx.md): at 0.05 rad/s it sees no resonance here.
    const auto record = silent_half(method == TrackMethod::arx ? 0.002 : 0.05);
    TrackOptions options;
    options.method = method;
    const Track track = tracked(record, options);
    const auto& resonance = track.find("resonance_hz")->value;
    const std::size_t learned = record.samples() - track.rows;
    const double before = resonance[2490 - learned], after = resonance.back();
    EXPECT_NEAR(before, true_hz, 0.02 * true_hz) << track.method;
    EXPECT_NEAR(after, before, 0.02 * true_hz) << track.method;
    EXPECT_TRUE(track.trusted_rows[2490 - learned]) << track.method;
    const auto quiet = static_cast<std::ptrdiff_t>(3500 - learned);  // four seconds later
    EXPECT_EQ(std::count(track.trusted_rows.begin() + quiet, track.trusted_rows.end(), true), 0)
        << track.method;
    const auto found = std::find_if(track.findings.begin(), track.findings.end(),
                                    [](const auto& f) { return f.id == "no-excitation"; });
    ASSERT_NE(found, track.findings.end()) << track.method;
    EXPECT_LT(*found->value, *found->threshold);
  }
}

// Told the controller that runs, a cascade, the margins are those of the simulated loop. Told the bare PI
// within it they would not be, and a finding says so.
TEST(Tracking, MarginsAreThoseOfTheLoopThatRuns) {
  auto config = io::shipped_experiment("ii_iii_tooth_prbs");
  const test::LoopTruth truth(config);
  for (const std::uint64_t seed : {1U, 2U}) {
    config.run.seed = seed;
    const auto simulation = test::simulated(config);
    auto options = test::known_to_track(config);
    options.every = 5;
    const Track track = tracked(simulation.record, options);
    EXPECT_TRUE(track.trusted) << seed;
    const auto [crossover, phase, modulus] = test::margin_errors(track, truth);
    EXPECT_GT(crossover.rows, 900U);
    EXPECT_LT(crossover.rms, 0.02) << seed;
    EXPECT_LT(phase.rms, 1.5) << seed;
    EXPECT_LT(modulus.rms, 0.03) << seed;

    options.common.controller =
        data::pi_controller(config.controller.gain, config.controller.integral_time_s, 0.004);
    const Track told_wrong = tracked(simulation.record, options);
    EXPECT_FALSE(told_wrong.trusted);
    EXPECT_EQ(std::count_if(told_wrong.findings.begin(), told_wrong.findings.end(),
                            [](const auto& f) { return f.id == "controller-differs"; }),
              1)
        << seed;
    EXPECT_GT(test::margin_errors(told_wrong, truth)[1].rms, 5.0) << seed;
  }
}

// A stiffness that falls by a tenth at once is found, one that stays is not.
TEST(Tracking, AChangeOfTheWatchedFigureIsFound) {
  auto config = io::shipped_experiment("belt_loosens");
  const auto simulation = test::simulated(config);
  auto options = test::known_to_track(config);
  options.change_of = identification::TrackFigure::resonance;
  options.every = 5;
  const Track track = tracked(simulation.record, options);
  ASSERT_TRUE(track.change);
  EXPECT_LT(track.change->size, 0.0);
  const auto& changed = track.find("changed")->value;
  EXPECT_EQ(changed.front(), 0.0);
  EXPECT_EQ(changed.back(), 1.0);
  EXPECT_EQ(std::count_if(track.findings.begin(), track.findings.end(),
                          [](const auto& f) { return f.id == "changed"; }),
            1);
}

using Row = std::vector<double>;

/// All rows that a record gives in batches of so many samples (0: by track()), as they are handed out.
std::vector<Row> rows_of(const data::Record& record, TrackOptions options, std::size_t batch = 0) {
  std::vector<Row> rows;
  options.on_row = [&](std::span<const double> row) { rows.emplace_back(row.begin(), row.end()); };
  options.kept_rows = 100;
  if (batch == 0) {
    const auto done = identification::track(record, options);
    EXPECT_EQ(done.has_value(), !rows.empty());
    return rows;
  }
  identification::Tracking tracking(options);
  for (std::size_t k = 0; k < record.samples(); k += batch) {
    const auto added = tracking.add(data::part_of(record, k, std::min(batch, record.samples() - k)));
    EXPECT_TRUE(added);
  }
  EXPECT_TRUE(tracking.finish());
  return rows;
}

bool same_bits(const Row& a, const Row& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

struct CausalCase {
  const char* experiment;
  TrackMethod method;
  double duration_s;
  bool chirp = false;  // told
  friend std::ostream& operator<<(std::ostream& out, const CausalCase& c) {
    return out << c.experiment << ", " << name_of(c.method) << (c.chirp ? ", told of the chirp" : "");
  }
};

class Causal : public ::testing::TestWithParam<CausalCase> {
 protected:
  void SetUp() override {
    const auto& c = GetParam();
    auto config = io::shipped_experiment(c.experiment);
    config.run.duration_s = c.duration_s;
    simulation_ = test::simulated(config);
    options_ = test::known_to_track(config);
    options_.method = c.method;
    const auto& e = config.excitation;
    if (c.chirp) options_.common.chirp = online::SweepLaw{e.from_hz, e.to_hz, e.duration_s};
  }
  plant::Simulation simulation_;
  TrackOptions options_;
};

// No row depends on a later sample: a record that ends earlier gives the same rows until then.
TEST_P(Causal, CutAnywhereTheRowsAreTheSame) {
  const auto& record = simulation_.record;
  const auto all = rows_of(record, options_);
  ASSERT_GT(all.size(), record.samples() / 4);
  const std::size_t learned = record.samples() - all.size();
  for (const std::size_t rows : {std::size_t{1}, std::size_t{2}, all.size() / 3, all.size() - 1}) {
    const auto cut = rows_of(data::part_of(record, 0, learned + rows), options_);
    ASSERT_EQ(cut.size(), rows);
    for (std::size_t i = 0; i < rows; ++i)
      ASSERT_TRUE(same_bits(cut[i], all[i])) << "row " << i << " of " << rows;
  }
  // While it learns it says nothing.
  EXPECT_TRUE(rows_of(data::part_of(record, 0, learned), options_).empty());
}

TEST_P(Causal, TheRowsDoNotDependOnTheBatches) {
  const auto all = rows_of(simulation_.record, options_);
  for (const std::size_t batch : {1U, 7U, 1000U}) {
    const auto rows = rows_of(simulation_.record, options_, batch);
    ASSERT_EQ(rows.size(), all.size()) << batch;
    for (std::size_t i = 0; i < rows.size(); ++i)
      ASSERT_TRUE(same_bits(rows[i], all[i])) << "row " << i << ", batches of " << batch;
  }
}

INSTANTIATE_TEST_SUITE_P(
    EveryMethod, Causal,
    ::testing::Values(CausalCase{"ii_iii_tooth_prbs", TrackMethod::automatic, 4.0},
                      CausalCase{"ii_iii_tooth_prbs", TrackMethod::physical, 4.0},
                      CausalCase{"ii_iii_tooth_prbs", TrackMethod::instrumental_variables, 4.0},
                      CausalCase{"ii_iii_tooth_prbs", TrackMethod::arx, 4.0},
                      CausalCase{"ii_iii_tooth_prbs", TrackMethod::output_error, 4.0},
                      CausalCase{"ii_iii_tooth_prbs", TrackMethod::closed_loop_output_error, 4.0},
                      CausalCase{"ii_iii_tooth_prbs", TrackMethod::filtered_closed_loop_output_error, 4.0},
                      CausalCase{"ii_iii_tooth_prbs", TrackMethod::damped_closed_loop_output_error, 4.0},
                      CausalCase{"ii_iii_tooth_prbs", TrackMethod::prediction_error, 4.0},
                      CausalCase{"v_tooth_multisine", TrackMethod::kalman, 6.0},
                      CausalCase{"v_tooth_multisine", TrackMethod::sliding_dft, 6.0},
                      CausalCase{"vi_chirp_a", TrackMethod::kalman, 17.0, true},
                      CausalCase{"vi_chirp_a", TrackMethod::kalman, 17.0}));

TEST(Tracking, TheWholeRecordIsLearnedFromOnlyWhenAsked) {
  auto config = io::shipped_experiment("ii_iii_tooth_prbs");
  config.run.duration_s = 4.0;
  const auto simulation = test::simulated(config);
  auto options = test::known_to_track(config);
  const Track causal = tracked(simulation.record, options);
  EXPECT_TRUE(causal.causal);
  EXPECT_EQ(causal.rows, 1000U - static_cast<std::size_t>(250.0 * causal.learned_s));
  options.whole_record = true;
  const Track whole = tracked(simulation.record, options);
  EXPECT_FALSE(whole.causal);
  EXPECT_EQ(whole.rows, 1000U);
  EXPECT_EQ(whole.learned_s, 4.0);
  EXPECT_EQ(whole.start, "the whole record");
  EXPECT_EQ(std::count_if(whole.findings.begin(), whole.findings.end(),
                          [](const auto& f) { return f.id == "whole-record"; }),
            1);
}

// Rows may be too many to be kept: every one is handed out, a few are kept.
TEST(Tracking, RowsAreHandedOutAndThinned) {
  auto config = io::shipped_experiment("ii_iii_tooth_prbs");
  config.run.duration_s = 8.0;
  const auto simulation = test::simulated(config);
  auto options = test::known_to_track(config);
  options.kept_rows = 100;
  std::size_t columns = 0, rows = 0;
  bool same = true;
  options.on_columns = [&](std::span<const std::string> names) { columns = names.size(); };
  options.on_row = [&](std::span<const double> values) {
    same = same && values.size() == columns;
    ++rows;
  };
  const Track track = tracked(simulation.record, options);
  EXPECT_EQ(rows, track.rows);
  EXPECT_EQ(rows, 2000U - static_cast<std::size_t>(250.0 * track.learned_s));
  EXPECT_EQ(track.time_s.size(), (rows + 31) / 32);  // a row in 16 would be more than a hundred
  EXPECT_EQ(track.find("stiffness")->std.size(), track.time_s.size());
  EXPECT_TRUE(same);
}

}  // namespace
}  // namespace resonid
