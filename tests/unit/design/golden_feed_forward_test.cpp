// SPDX-License-Identifier: MIT
// Moves with every kind of feed-forward against an independent implementation
// (tests/golden/e_tune_structures.json), within the 2 % that stand there.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "design/feed_forward.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

FeedForward kind_of(const std::string& mode) {
  const std::map<std::string, FeedForward> kinds = {{"none", FeedForward::none},
                                                    {"v", FeedForward::velocity},
                                                    {"v+a", FeedForward::inertia},
                                                    {"v+a+d", FeedForward::delayed},
                                                    {"flat", FeedForward::flexible}};
  return kinds.at(mode.substr(0, mode.find(',')));
}

/// The golden inversion cuts the series of the twist off where the snap stands.
void cut_off(const fit::DriveModel& m, const PolynomialMove& move, double coulomb_nm,
             std::vector<MoveSample>& samples) {
  const auto& p = m.parameters;
  const double x = p.damping / p.stiffness, scale = p.load_inertia / p.stiffness;
  const auto path = [&](double t) {
    const auto d = move.at(t);
    const double e = scale * (d[2] - x * d[3] + x * x * d[4]), e1 = scale * (d[3] - x * d[4]),
                 e2 = scale * d[4];
    const double v = d[1] + e1;
    return std::array{d[0] + e, v,
                      p.driven_inertia * (d[2] + e2) + p.load_inertia * d[2] +
                          (v > 0   ? coulomb_nm
                           : v < 0 ? -coulomb_nm
                                   : 0.0)};
  };
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double t = static_cast<double>(k) * m.sample_time_s;
    const auto late = path(t - m.known_delay_s);
    samples[k] = {move.at(t)[0], late[0], late[1], path(t)[2]};
  }
}

/// The golden machine, with what a case's model has wrong.
fit::DriveModel model_of(fit::DriveModel model, const std::string& mode) {
  const auto says = [&](const char* text) { return mode.find(text) != std::string::npos; };
  if (says("K +5 %")) model.parameters.stiffness *= 1.05;
  if (says("K -20 %")) model.parameters.stiffness *= 0.8;
  if (says("J2 +5 %")) model.parameters.load_inertia *= 1.05;
  return model;
}

struct Case {
  std::string mode;
  MoveFigures golden, cut, exact;
};

std::vector<Case> all_cases() {
  const auto golden = test::golden_json("e_tune_structures.json");
  const auto& position = golden.at("cascade").at("cases").front();
  const Machine machine = test::golden_plant(golden, "system2");
  const Cascade cascade{{position.at("kp"), position.at("ki"), {}}, position.at("kv")};
  std::vector<Case> all;
  for (const auto& c : golden.at("cascade").at("feed_forward").at("cases")) {
    Case one{
        c.at("mode"), {c.at("max_error_during"), c.at("max_error_after"), c.at("peak_torque"), 0.0}, {}, {}};
    const bool rubs = one.mode.find("Coulomb 0.5") != std::string::npos;
    const double friction = rubs ? 0.5 : 0.0;
    const double fed = one.mode.find("feed-forward 0.5") != std::string::npos ? 0.5 : 0.0;
    const auto model = model_of(machine.model(), one.mode);
    const PolynomialMove move{1.0, c.at("move_s")};
    auto samples = move_samples(model, move, kind_of(one.mode), 1000, fed).value();
    one.exact = move_figures_of(machine, cascade, samples, move.duration_s, friction);
    if (one.mode.find("flat") == 0) cut_off(model, move, fed, samples);
    one.cut = move_figures_of(machine, cascade, samples, move.duration_s, friction);
    all.push_back(one);
  }
  return all;
}

TEST(GoldenFeedForward, Moves) {
  const auto cases = all_cases();
  ASSERT_EQ(cases.size(), 15U);
  for (const Case& c : cases) {
    SCOPED_TRACE(c.mode);
    const bool rubs = c.mode.find("Coulomb") != std::string::npos;
    const double room = rubs ? 0.02 : 1e-6;  // the way that friction is simulated
    EXPECT_NEAR(c.cut.error_during / c.golden.error_during, 1.0, room);
    EXPECT_NEAR(c.cut.error_after / c.golden.error_after, 1.0, room);
    EXPECT_NEAR(c.cut.peak_torque / c.golden.peak_torque, 1.0, room);
  }
}

TEST(FeedForward, ExactInversionComesNearerThanTheSeriesCutOff) {
  for (const Case& c : all_cases()) {
    if (c.mode != "flat") continue;
    // The slow move's errors are those of sampling either way.
    EXPECT_LT(c.exact.error_during, 1.01 * c.golden.error_during);
    EXPECT_LT(c.exact.error_after, c.golden.error_after);
  }
}

/// The load of a finely sampled drive follows to what its own sampling leaves.
TEST(FeedForward, ExactInversionIsExact) {
  const auto golden = test::golden_json("e_tune_structures.json");
  auto model = test::golden_plant(golden, "system2").model();
  model.parameters.damping = 1.5;  // so that the series alone would not do
  model.parameters.viscous_friction = 0.3;
  model.parameters.load_viscous_friction = 0.5;
  model.sample_time_s = 2e-5;
  model.known_delay_s = 0.0;
  const PolynomialMove move{1.0, 0.1};
  const auto samples = move_samples(model, move, FeedForward::flexible, 10000).value();
  const auto f = move_figures_of(Machine(model), {{0.0, 0.0, {}}, 0.0}, samples, move.duration_s);
  EXPECT_LT(f.error_during, 5e-4);
  EXPECT_LT(f.error_after, 5e-5);
}

TEST(FeedForward, OneOfThreeMassesIsRefused) {
  fit::DriveModel model;
  model.structure = fit::Structure::three_mass;
  model.sample_time_s = 0.002;
  EXPECT_FALSE(move_samples(model, {}, FeedForward::flexible, 10));
}

TEST(PolynomialMove, DerivativesAreThoseOfTheOneBefore) {
  const PolynomialMove move{2.0, 0.3};
  for (const double t : {0.01, 0.1, 0.2, 0.29}) {
    const double h = 1e-6;
    const auto before = move.at(t - h), after = move.at(t + h), here = move.at(t);
    for (std::size_t n = 0; n + 1 < here.size(); ++n)
      EXPECT_NEAR((after[n] - before[n]) / (2.0 * h), here[n + 1],
                  1e-5 * (std::abs(here[n + 1]) + std::abs(here[n]) / 0.3));
  }
  EXPECT_EQ(move.at(0.0)[0], 0.0);
  EXPECT_EQ(move.at(0.3)[0], 2.0);
  EXPECT_NEAR(move.at(0.15)[0], 1.0, 1e-12);
}

}  // namespace
}  // namespace resonid::design
