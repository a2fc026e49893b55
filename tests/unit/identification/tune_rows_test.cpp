// SPDX-License-Identifier: MIT
// Results over the position of tracked rows, against rows whose law is written down here.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/identification/tune.hpp>
#include <string>

namespace resonid::identification {
namespace {

constexpr double kMotor = 0.0028, kLoad = 0.00265;

Result identified() {
  Result r;
  r.trusted = true;
  r.model.emplace();
  auto& m = r.model->drive;
  m.sample_time_s = 0.0005;
  m.known_delay_s = 0.0005;
  m.parameters.driven_inertia = kMotor;
  m.parameters.load_inertia = kLoad;
  m.parameters.stiffness = 235.0;
  m.parameters.damping = 0.056;
  m.estimated = fit::estimated_parameters(m.structure, false, true);
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (m.estimated[static_cast<std::size_t>(i)])
      m.covariance(i, i) = std::pow(0.01 * m.value(static_cast<fit::Parameter>(i)), 2);
  m.covariance(fit::kDelay, fit::kDelay) = 1e-10;
  m.covariance(fit::kDelay, fit::kStiffness) = m.covariance(fit::kStiffness, fit::kDelay) = 1e-7;
  m.covariance(fit::kStiffness, fit::kDamping) = m.covariance(fit::kDamping, fit::kStiffness) =
      0.5 *
      std::sqrt(m.covariance(fit::kStiffness, fit::kStiffness) * m.covariance(fit::kDamping, fit::kDamping));
  return r;
}

double stiffness_at(double position) { return 400.0 * std::exp(-0.8 * position); }
double damping_at(double position) { return 0.07 * std::exp(-0.4 * position); }

constexpr double kOwn = 0.002;  // relative standard deviation that every row gives

/// Rows there and back over 0.2 ... 1.2, at two times the number, `by` off in turn.
Track rows(double by = 0.0, std::size_t count = 400,
           const std::function<double(double)>& stiffness = stiffness_at) {
  Track t;
  t.parameters = {{"driven_inertia", "", {}, {}},
                  {"load_inertia", "", {}, {}},
                  {"stiffness", "", {}, {}},
                  {"damping", "", {}, {}}};
  for (std::size_t k = 0; k < 2 * count; ++k) {
    const double there = static_cast<double>(k < count ? k : 2 * count - 1 - k);
    const double position = 0.2 + there / static_cast<double>(count - 1);
    const double factor = std::exp(k < count ? by : -by);
    const double values[] = {kMotor, kLoad, stiffness(position) * factor, damping_at(position)};
    for (std::size_t i = 0; i < 4; ++i) {
      t.parameters[i].value.push_back(values[i]);
      t.parameters[i].std.push_back(kOwn * values[i]);
    }
    t.time_s.push_back(static_cast<double>(k));
    t.position_m.push_back(position);
    t.trusted_rows.push_back(true);
  }
  return t;
}

std::string refused(const Result& result, const Track& track) {
  const auto found = results_over_position(result, track);
  return found ? "" : message_of(found.error());
}

TEST(TunedRows, GiveTheMachineOfEveryPosition) {
  const auto found = results_over_position(identified(), rows());
  ASSERT_TRUE(found) << message_of(found.error());
  ASSERT_EQ(found->positions.size(), found->results.size());
  EXPECT_DOUBLE_EQ(found->positions.front(), 0.2);
  EXPECT_DOUBLE_EQ(found->positions.back(), 1.2);
  // Stiffness falls by exp(0.8): in 16 halves of halves each falls by 5 %.
  EXPECT_EQ(found->positions.size(), 16U);
  for (std::size_t k = 0; k < found->positions.size(); ++k) {
    const double position = found->positions[k];
    if (k > 0) {
      EXPECT_GT(position, found->positions[k - 1]);
    }
    const auto& m = found->results[k].model->drive;
    EXPECT_NEAR(m.parameters.stiffness / stiffness_at(position), 1.0, 1e-9);
    EXPECT_NEAR(m.parameters.damping / damping_at(position), 1.0, 1e-9);
    EXPECT_NEAR(m.parameters.driven_inertia / kMotor, 1.0, 1e-9);
    EXPECT_EQ(m.known_delay_s, 0.0005);
  }
}

TEST(TunedRows, HaveTheirOwnVarianceAndTheScatterAroundTheLine) {
  constexpr double kOff = 0.01;  // there, and as much the other way back
  const auto found = results_over_position(identified(), rows(kOff));
  ASSERT_TRUE(found) << message_of(found.error());
  for (const Result& here : found->results) {
    const auto& m = here.model->drive;
    const double k = m.parameters.stiffness, d = m.parameters.damping;
    const double variance = m.covariance(fit::kStiffness, fit::kStiffness) / (k * k);
    EXPECT_NEAR(variance, kOwn * kOwn + kOff * kOff, 0.06 * kOff * kOff);  // N/(N - 2) of 50 rows or more
    EXPECT_NEAR(m.covariance(fit::kDamping, fit::kDamping) / (d * d), kOwn * kOwn, 1e-9);
    // Together as in the result: correlated by a half, by their own errors.
    EXPECT_NEAR(m.covariance(fit::kStiffness, fit::kDamping) / (k * d), 0.5 * kOwn * kOwn, 1e-9);
    // The delay is not tracked: as known as before, and to nothing that is.
    EXPECT_EQ(m.covariance(fit::kDelay, fit::kDelay), 1e-10);
    EXPECT_EQ(m.covariance(fit::kDelay, fit::kStiffness), 0.0);
  }
}

TEST(TunedRows, AreFewWhereNothingChanges) {
  const auto same = results_over_position(identified(), rows(0.0, 400, [](double) { return 235.0; }));
  ASSERT_TRUE(same);
  EXPECT_LT(same->positions.size(), 10U);  // damping alone falls by exp(0.4)
  // Within 10 % of error bars there is no change of 10 %.
  auto doubtful = rows();
  for (auto& series : doubtful.parameters)
    for (std::size_t i = 0; i < series.value.size(); ++i) series.std[i] = 0.1 * series.value[i];
  const auto coarse = results_over_position(identified(), doubtful);
  ASSERT_TRUE(coarse);
  EXPECT_EQ(coarse->positions.size(), 4U);  // a quarter of exp(0.8) each: 20 %
}

TEST(TunedRows, LeaveOutWhatIsNotTrusted) {
  auto track = rows();
  for (std::size_t i = 0; i < track.time_s.size(); i += 3) {
    track.trusted_rows[i] = false;
    track.parameters[2].value[i] *= 5.0;
  }
  track.parameters[0].value[1] = std::numeric_limits<double>::quiet_NaN();
  const auto found = results_over_position(identified(), track);
  ASSERT_TRUE(found) << message_of(found.error());
  for (std::size_t k = 0; k < found->positions.size(); ++k)
    EXPECT_NEAR(found->results[k].model->drive.parameters.stiffness / stiffness_at(found->positions[k]), 1.0,
                1e-9);
}

TEST(TunedRows, FollowViscousFrictionToo) {
  auto track = rows();
  TrackSeries friction{"viscous_friction", "", {}, {}};
  for (const double x : track.position_m) {
    friction.value.push_back(0.001 * (x - 0.5));  // below 0 as well: nothing that has a logarithm
    friction.std.push_back(1e-4);
  }
  track.parameters.push_back(friction);
  const auto found = results_over_position(identified(), track);
  ASSERT_TRUE(found) << message_of(found.error());
  const auto& m = found->results.back().model->drive;
  EXPECT_NEAR(m.parameters.viscous_friction, 0.0007, 1e-9);
  EXPECT_TRUE(m.estimated[fit::kViscousFriction]);
  EXPECT_NEAR(m.covariance(fit::kViscousFriction, fit::kViscousFriction), 1e-8, 1e-12);
}

TEST(TunedRows, RefuseWhatTellsNoMachineOverPosition) {
  auto track = rows();
  track.position_m.clear();
  EXPECT_NE(refused(identified(), track).find("position_m"), std::string::npos);
  track = rows();
  track.parameters.erase(track.parameters.begin() + 3);
  EXPECT_NE(refused(identified(), track).find("damping_std"), std::string::npos);
  track = rows();
  track.trusted_rows.assign(track.trusted_rows.size(), false);
  track.trusted_rows[5] = true;
  EXPECT_NE(refused(identified(), track).find("trusted"), std::string::npos);
  track = rows();
  track.position_m.assign(track.position_m.size(), 0.8);
  EXPECT_NE(refused(identified(), track).find("one"), std::string::npos);
  track = rows();
  for (double& value : track.parameters[1].value) value *= 1e3;
  EXPECT_NE(refused(identified(), track).find("units"), std::string::npos);
  auto rigid = identified();
  rigid.model->drive.structure = fit::Structure::rigid;
  EXPECT_NE(refused(rigid, rows()).find("two-mass"), std::string::npos);
  EXPECT_EQ(refused(identified(), rows()), "");
}

TEST(TunedRows, RefuseGapsOverWhichTheMachineChanges) {
  const auto with_gap = [](double from, double to) {
    auto track = rows();
    for (std::size_t i = 0; i < track.time_s.size(); ++i)
      if (track.position_m[i] > from && track.position_m[i] < to) track.trusted_rows[i] = false;
    return track;
  };
  EXPECT_EQ(refused(identified(), with_gap(0.6, 0.75)), "");  // 12 %
  const auto wide = refused(identified(), with_gap(0.5, 0.9));
  EXPECT_NE(wide.find("stiffness changes by 28 %"), std::string::npos) << wide;
  // Too few rows to be divided, over the whole change.
  EXPECT_NE(refused(identified(), rows(0.0, 7)).find("enough"), std::string::npos);
}

}  // namespace
}  // namespace resonid::identification
