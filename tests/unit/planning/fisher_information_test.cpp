// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <planned_experiment.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/planning/detail/fisher_information.hpp>

namespace resonid::planning {
namespace {

using test::rough_drive;

TEST(NominalDrive, MovesAsThePlantDoes) {
  auto c = test::published_chirp(0.0);
  for (const double delay_s : {0.004, 0.0037, 0.0}) {
    c.measurement.delay_s = delay_s;
    const auto run = plant::simulate_closed_loop(c);
    ASSERT_TRUE(run.has_value());
    auto drive = rough_drive({1.0, 1.0, 1.0, 1.0}, 0.1);
    drive.model.known_delay_s = delay_s;
    const auto motion = simulate(drive, run->record.excitation.samples);
    const auto measured = simulate({drive.model, std::nullopt, {}}, run->record.input.samples).measured;
    for (std::size_t k = 10; k < motion.torque.size(); k += 7) {
      ASSERT_NEAR(motion.torque[k], run->record.input.samples[k], 1e-8) << delay_s << " at " << k;
      ASSERT_NEAR(measured[k], run->record.output.samples[k], 1e-8) << delay_s << " at " << k;
    }
  }
}

TEST(NominalDrive, AnswersASineAsItsResponseSays) {
  const auto drive = rough_drive({1.0, 1.0, 1.0, 1.0}, 0.1);
  const double f = 12.5;  // 40 samples per period
  std::vector<double> sine(8000);
  for (std::size_t k = 0; k < sine.size(); ++k)
    sine[k] = std::cos(kTwoPi * f * static_cast<double>(k) * 0.002);
  const auto motion = simulate(drive, sine);
  const auto loop = loop_response(drive, std::vector<double>{f});
  const auto phasor = [&](const std::vector<double>& x) {
    std::complex<double> sum = 0.0;
    for (std::size_t k = 4000; k < 8000; ++k)
      sum += x[k] * std::polar(2.0 / 4000.0, -kTwoPi * f * static_cast<double>(k) * 0.002);
    return sum;
  };
  EXPECT_LT(std::abs(phasor(motion.torque) - loop.torque[0]), 1e-6);
  EXPECT_LT(std::abs(phasor(motion.velocity) - loop.velocity[0]), 1e-6);
  // The position is the velocity's trapezoids: (w Ts)^2/12 = 0.2 % short.
  EXPECT_LT(std::abs(phasor(motion.position) - loop.position[0]), 3e-3 * std::abs(loop.position[0]));
}

TEST(NominalDrive, TellsStableFromUnstableLoops) {
  auto drive = rough_drive({1.0, 1.0, 1.0, 1.0}, 0.1);
  EXPECT_TRUE(stable(drive));
  EXPECT_EQ(possible_drives(drive, 0.2).size(), 9U);
  EXPECT_EQ(possible_drives(drive, 0.0).size(), 1U);
  drive.controller = data::pi_controller(20.0, 0.147, 0.002);
  EXPECT_FALSE(stable(drive));
  EXPECT_EQ(check(drive).error().field, "controller");
}

// The fit's own covariance comes from Ceres' Jacobian of one noisy record; 1.5 % covers that noise.
TEST(Information, IsThatOfTheFit) {
  const auto drive = rough_drive({1.0, 1.0, 1.0, 1.0}, 0.1);
  const auto run = plant::simulate_closed_loop(test::published_chirp(0.1));
  ASSERT_TRUE(run.has_value());
  fit::OutputErrorConfig o;
  o.initial = drive.model;
  o.known_delay_s = 0.004;
  o.noise_model = false;
  const auto fitted = fit::fit_output_error(run->record, o);
  const auto told = predicted(drive, run->record.excitation.samples);
  for (int i = 0; i < 4; ++i) {
    const auto p = static_cast<fit::Parameter>(i);
    const double ratio = fitted->model.estimate(p).std / fitted->model.value(p) /
                         (told.model.estimate(p).std / told.model.value(p));
    EXPECT_NEAR(ratio, 1.0, 0.03) << fit::kParameterNames[static_cast<std::size_t>(i)];
  }
  const auto figures = figures_of(told);
  EXPECT_EQ(figures.size(), 11U);
  EXPECT_NEAR(figures[4].value, told.model.resonance().value, 1e-12);
  EXPECT_NEAR(figures[4].std, told.model.resonance().std, 1e-3 * figures[4].std);
}

// Three masses: the simulation is the plant's, and the bars are those that the fit's own Jacobian gives.
TEST(Information, IsThatOfTheFitOfThreeMasses) {
  const auto drive = test::rough_three_mass(0.05);
  auto c = test::three_mass_drive(0.05);
  c.excitation.kind = online::Kind::chirp;
  c.excitation.from_hz = 100.0;
  c.excitation.to_hz = 1.0;
  c.excitation.duration_s = 10.0;
  const auto quiet = test::without_noise(c);
  const auto motion = simulate(drive, quiet.record.excitation.samples);
  const auto measured = simulate({drive.model, std::nullopt, {}}, quiet.record.input.samples).measured;
  for (std::size_t k = 10; k < motion.torque.size(); k += 7) {
    ASSERT_NEAR(motion.torque[k], quiet.record.input.samples[k], 1e-8) << k;
    ASSERT_NEAR(measured[k], quiet.record.output.samples[k], 1e-8) << k;
  }
  const auto run = plant::simulate_closed_loop(c);
  ASSERT_TRUE(run.has_value());
  fit::OutputErrorConfig o;
  o.initial = drive.model;
  o.known_delay_s = 0.001;
  o.noise_model = false;
  const auto fitted = fit::fit_output_error(run->record, o);
  ASSERT_TRUE(fitted.has_value());
  const auto told = predicted(drive, run->record.excitation.samples);
  for (const int i : estimated_of(drive.model)) {
    const auto p = static_cast<fit::Parameter>(i);
    const double ratio = fitted->model.estimate(p).std / fitted->model.value(p) /
                         (told.model.estimate(p).std / told.model.value(p));
    EXPECT_NEAR(ratio, 1.0, 0.1) << fit::kParameterNames[static_cast<std::size_t>(i)];
  }
  const auto modes = drive.model.modes();  // ascending: anti-resonance, resonance, and again
  const auto figures = figures_of(told, {"antiresonance", "resonance", "antiresonance_2", "resonance_2"});
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(figures[i].value, modes[i].frequency_hz.value);
    EXPECT_NEAR(figures[i].std, told.model.modes()[i].frequency_hz.std, 1e-3 * figures[i].std);
  }
  EXPECT_EQ(figure_names(drive).size(), 7U + 8U + 3U);
  EXPECT_EQ(possible_drives(drive, 0.05).size(), 9U);
}

TEST(Information, OfLinesIsThatOfALongRecord) {
  // Without fed-back noise (its variance is small) and over many periods transients do not count.
  const auto drive = rough_drive({1.0, 1.0, 1.0, 1.0}, 0.001);
  const std::vector<double> lines{2.0, 13.0, 16.5};
  constexpr std::size_t kSamples = 40 * 1000;
  std::vector<double> excitation(kSamples, 0.0);
  for (std::size_t k = 0; k < kSamples; ++k)
    for (const double f : lines)
      excitation[k] += 0.5 * std::cos(kTwoPi * f * static_cast<double>(k) * 0.002 + f);
  const Eigen::MatrixXcd d = line_sensitivities(drive, lines);
  const Eigen::MatrixXd information = 0.125 * kSamples * (d * d.adjoint()).real();
  const auto told = predicted(drive, excitation);
  Eigen::Matrix4d covariance;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      covariance(i, j) = told.model.covariance(i, j) / scale(drive.model, i) / scale(drive.model, j);
  EXPECT_LT((covariance * information - Eigen::Matrix4d::Identity()).norm(), 0.03);
}

TEST(Information, CallsUnknownWhatARecordDoesNotTell) {
  auto drive = rough_drive({1.0, 1.0, 1.0, 1.0}, 0.1);
  drive.controller.reset();  // with one, its noise would tell something
  const auto told = predicted(drive, std::vector<double>(500, 0.0));
  for (const auto& figure : figures_of(told)) EXPECT_TRUE(std::isinf(figure.std)) << figure.name;
}

}  // namespace
}  // namespace resonid::planning
