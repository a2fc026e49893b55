// SPDX-License-Identifier: MIT
// A part of tests/statistics/compare_test.cpp, models validated on records of other machines, and drives
// tracked that an on-line estimator does not hold.
#include <algorithm>
#include <repetitions.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/identification/compare.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/identification/validate.hpp>

namespace resonid {
namespace {

using identification::Verdict;

TEST(Compare, TellsRepetitionsFromAStiffnessThatChanged) {
  const auto first = test::identified_repetition(1), again = test::identified_repetition(2);
  const auto softer = test::identified_repetition(3, 0.95);
  EXPECT_FALSE(identification::compare(first, again).value().changed);
  const auto changes = identification::compare(first, softer).value();
  EXPECT_TRUE(changes.changed);
  for (const auto& d : changes.parameters)
    if (d.name == "stiffness") {
      EXPECT_NEAR(d.change, -0.05 * 143.75, 4.0 * d.std.value());
    }
}

/// An open loop, with lines from 5 Hz on; below them the velocity drifts by more than it moves.
identification::ModelValidation validated(double stiffness, bool drifts) {
  auto c = test::real_drive(7, stiffness);
  c.friction = {};
  c.actuator = {};
  c.controller.kind = plant::ControllerKind::none;
  c.motion = {};
  c.measurement.velocity = plant::VelocitySource::sensor;
  c.measurement.noise_rms = 0.05;
  std::vector<double> lines;
  for (int i = 10; i <= 60; ++i) lines.push_back(0.5 * i);
  c.excitation.lines_hz.assign(lines);
  auto simulation = test::simulated(c);
  auto& y = simulation.record.output.samples;
  if (drifts)
    for (std::size_t k = 0; k < y.size(); ++k) {
      const double t = static_cast<double>(k) / c.run.sample_rate_hz;
      y[k] += 20.0 * std::sin(kTwoPi * 0.11 * t) + 10.0 * std::sin(kTwoPi * 0.23 * t + 1.0);
    }
  identification::CandidateModel candidate;
  candidate.source = "model.json";
  auto truth = test::real_drive(1);
  fit::DriveModel drive;
  drive.structure = fit::Structure::two_mass;
  const double square = truth.drive.radius_m * truth.drive.radius_m;
  drive.parameters.driven_inertia = truth.drive.driven_inertia;
  drive.parameters.load_inertia = truth.drive.load_inertia;
  drive.parameters.stiffness = truth.drive.stiffness * square;
  drive.parameters.damping = truth.drive.damping * square;
  drive.sample_time_s = 1.0 / c.run.sample_rate_hz;
  candidate.model = identification::ModelResult{drive, false, 0.0, {}, {}};
  identification::ValidateOptions options;
  options.common.delay_s = c.measurement.delay_s;
  return identification::validate(simulation.record, candidate, options).value();
}

TEST(Validate, DriftBelowTheExcitedBandSaysNothing) {
  const auto still = validated(1.0, false), drifting = validated(1.0, true), softer = validated(0.9, true);
  EXPECT_EQ(still.verdict, Verdict::accepted);
  EXPECT_FALSE(still.judged_from_hz);
  EXPECT_EQ(drifting.verdict, Verdict::accepted);
  ASSERT_TRUE(drifting.judged_from_hz);
  EXPECT_GT(*drifting.judged_fit_percent, 90.0);
  EXPECT_NE(softer.verdict, Verdict::accepted);
}

/// Fitted to the record itself: 5 % show in two seconds, and nothing does on the same machine.
TEST(Validate, AStiffnessThatIsOffIsToldByTheRecord) {
  for (const double stiffness : {1.0, 0.95}) {
    auto c = test::published_drive(0.02, 10.0, 3);
    test::prbs(c);
    auto own = c;
    own.run.seed = 4;
    c.drive.stiffness *= stiffness;
    const auto model = test::identified(test::simulated(own).record, test::known(own));
    identification::ValidateOptions options;
    options.common = test::known(c);
    const auto validation = identification::validate(test::simulated(c).record, model, options).value();
    const bool differs = std::any_of(validation.findings.begin(), validation.findings.end(),
                                     [](const auto& f) { return f.id == "parameters-differ"; });
    EXPECT_EQ(differs, stiffness != 1.0);
    EXPECT_EQ(validation.verdict == Verdict::accepted, stiffness == 1.0);
  }
}

/// A lag that the estimator takes for inertia and damping: by what it leaves, and by the start model that has
/// it.
TEST(Track, DoesNotTrustADriveWithATorqueLag) {
  for (const double lag_s : {0.0, 0.001}) {
    auto c = test::published_drive(0.02, 10.0, 5);
    test::prbs(c);
    c.actuator.lag_s = lag_s;
    identification::TrackOptions options;
    options.common = test::known(c);
    const auto record = test::simulated(c).record;
    const auto track = identification::track(record, options).value();
    EXPECT_EQ(track.trusted, lag_s == 0.0);
    options.start = test::identified(record, options.common).model.value().drive;
    const auto started = identification::track(record, options).value();
    EXPECT_EQ(started.trusted, lag_s == 0.0);
    const auto& rows = started.trusted_rows;
    EXPECT_EQ(std::find(rows.begin(), rows.end(), true) != rows.end(), lag_s == 0.0);
  }
}

}  // namespace
}  // namespace resonid
