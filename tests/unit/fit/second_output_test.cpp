// SPDX-License-Identifier: MIT
// The load's response against the simulated drive, and fits to both outputs against what information adds up
// to.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <experiments.hpp>
#include <loop_of_two_masses.hpp>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/data/detail/second_output.hpp>
#include <resonid/fit/detail/second_output.hpp>

namespace resonid::fit {
namespace {

using Complex = std::complex<double>;
using data::SecondOutput;

constexpr double kRate = 500.0;
constexpr int kPeriod = 500;
constexpr std::array kLines = {3, 9, 14, 22, 40, 90, 160};

plant::ExperimentConfig belt(SecondOutput kind) {
  auto c = test::loop_of_two_masses(0.032, 0.05, 400.0, 0.6, 1.0, 0.15);
  c.measurement.delay_s = 0.0034;  // a fraction of a sample, too
  c.measurement.second_output = kind;
  c.excitation.kind = online::Kind::multisine;
  c.excitation.amplitude = 0.5;
  std::vector<double> lines(kLines.begin(), kLines.end());
  c.excitation.lines_hz.assign(lines);
  c.run.sample_rate_hz = kRate;
  c.run.duration_s = 16.0;
  return c;
}

DriveModel model_of(const plant::ExperimentConfig& c) {
  DriveModel m;
  const auto& d = c.drive;
  m.structure = d.structure == plant::Structure::three_mass ? Structure::three_mass : Structure::two_mass;
  m.parameters = {d.driven_inertia, d.load_inertia, d.stiffness, d.damping, d.viscous_friction};
  m.parameters.middle_inertia = d.middle_inertia;
  m.parameters.stiffness_2 = d.stiffness_2;
  m.parameters.damping_2 = d.damping_2;
  m.parameters.load_viscous_friction = d.load_viscous_friction;
  m.parameters.load_ground_stiffness = d.load_ground_stiffness;
  m.torque_lag_s = c.actuator.lag_s;
  m.sample_time_s = 1.0 / kRate;
  m.known_delay_s = c.measurement.delay_s;
  return m;
}

/// Of the last whole period.
Complex phasor(const std::vector<double>& x, int line) {
  Complex sum = 0.0;
  for (std::size_t k = x.size() - kPeriod; k < x.size(); ++k)
    sum += x[k] * std::polar(1.0, -kTwoPi * line * static_cast<double>(k % kPeriod) / kPeriod);
  return sum;
}

TEST(SecondOutput, ResponseOfTheLoadIsThatOfTheSimulatedDrive) {
  for (const auto kind : {SecondOutput::load_encoder, SecondOutput::load_accelerometer})
    for (const int machine : {0, 1, 2, 3}) {
      auto c = belt(kind);
      if (machine == 1) {
        c.drive.structure = plant::Structure::three_mass;
        c.drive.middle_inertia = 0.01;
        c.drive.stiffness_2 = 900.0;
        c.drive.damping_2 = 0.4;
      }
      if (machine == 2) c.drive.load_ground_stiffness = 30.0;
      if (machine == 3) {
        c.drive.load_viscous_friction = 0.3;
        c.actuator.lag_s = 0.003;
      }
      const auto record = test::simulated(c).record;
      const auto model = model_of(c);
      const std::vector<double> hz(kLines.begin(), kLines.end());
      const auto values = load_values(model, kind, hz);
      for (std::size_t i = 0; i < hz.size(); ++i) {
        const Complex shown = phasor(record.second_output.samples, kLines[i]) /
                              phasor(record.input.samples, kLines[i]) *
                              data::load_velocity_factor(kind, hz[i], 1.0 / kRate) *
                              std::polar(1.0, kTwoPi * hz[i] * c.measurement.delay_s);
        EXPECT_LT(std::abs(values[i] / shown - 1.0), 1e-5)
            << resonid::name_of(kind) << " machine " << machine << " " << hz[i] << " Hz";
      }
    }
}

struct Draw {
  DriveModel first;
  data::FrequencyResponse second;
};

/// What an output may have said of the drive, and lines of a second one, as `gain` and `delay_s` make them.
Draw drawn(const DriveModel& truth, SecondOutput kind, std::mt19937_64& random, double gain = 1.0,
           double delay_s = 0.0) {
  std::normal_distribution<double> normal;
  Draw d{truth, {}};
  d.first.estimated = estimated_parameters(truth.structure, false, false);
  const double common = normal(random);  // stiffness and load inertia are told together
  for (const auto& [p, own, shared] :
       {std::tuple(kDrivenInertia, 0.004, 0.0), std::tuple(kLoadInertia, 0.004, 0.02),
        std::tuple(kStiffness, 0.003, 0.02), std::tuple(kDamping, 0.05, 0.0)}) {
    const double size = truth.value(p);
    d.first.set(p, size * (1.0 + own * normal(random) + shared * common));
    d.first.covariance(p, p) = size * size * (own * own + shared * shared);
  }
  d.first.covariance(kLoadInertia, kStiffness) = d.first.covariance(kStiffness, kLoadInertia) =
      0.0004 * truth.value(kLoadInertia) * truth.value(kStiffness);
  for (double f = 1.0; f < 60.0; f *= 1.08) d.second.frequency_hz.push_back(f);
  auto late = truth;
  late.delay_s += delay_s;
  d.second.value = load_values(late, kind, d.second.frequency_hz);
  for (auto& v : d.second.value) {
    const double sd = 0.01 * std::abs(v);
    v += sd / std::sqrt(2.0) * Complex(normal(random), normal(random));
    v *= gain;
    d.second.std.push_back(std::abs(gain) * sd);
  }
  return d;
}

TEST(SecondOutput, ErrorsAreAsLargeAsTheBarsOfBothOutputs) {
  const auto truth = model_of(belt(SecondOutput::load_encoder));
  std::mt19937_64 random(5);
  constexpr int kDraws = 60;
  Eigen::Vector4d squares = Eigen::Vector4d::Zero();
  double contradiction = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const auto d = drawn(truth, SecondOutput::load_encoder, random);
    const auto fit = fit_second_output(d.first, d.second, {SecondOutput::load_encoder, false, false});
    ASSERT_TRUE(fit && fit->converged);
    ASSERT_GT(fit->directions, 0U);
    contradiction += fit->contradiction / static_cast<double>(fit->directions) / kDraws;
    int k = 0;
    for (const auto p : {kDrivenInertia, kLoadInertia, kStiffness, kDamping}) {
      const auto e = fit->model.estimate(p);
      squares(k++) += std::pow((e.value - truth.value(p)) / e.std, 2) / kDraws;
      EXPECT_LT(e.std, 1.01 * d.first.estimate(p).std) << p;
    }
  }
  // Mean squares of 60 normal deviates: within 0.45 ... 1.75 but for one in a thousand.
  for (int k = 0; k < 4; ++k) {
    EXPECT_GT(squares(k), 0.45) << k;
    EXPECT_LT(squares(k), 1.75) << k;
  }
  EXPECT_GT(contradiction, 0.5);
  EXPECT_LT(contradiction, 1.6);
}

TEST(SecondOutput, CovarianceIsTheInverseOfTheInformationOfBoth) {
  const auto truth = model_of(belt(SecondOutput::load_accelerometer));
  std::mt19937_64 random(6);
  const auto d = drawn(truth, SecondOutput::load_accelerometer, random);
  const auto fit = fit_second_output(d.first, d.second, {SecondOutput::load_accelerometer, false, false});
  ASSERT_TRUE(fit);
  ASSERT_EQ(fit->model_error, 0.0);
  constexpr std::array kParameters = {kDrivenInertia, kLoadInertia, kStiffness, kDamping};
  Eigen::Matrix4d first, information = Eigen::Matrix4d::Zero();
  std::array<std::vector<Complex>, 4> slopes;
  for (std::size_t i = 0; i < 4; ++i) {
    const double step = 1e-5 * truth.value(kParameters[i]);
    const auto plus = load_values(fit->model.moved(kParameters[i], step), SecondOutput::load_accelerometer,
                                  d.second.frequency_hz);
    const auto minus = load_values(fit->model.moved(kParameters[i], -step), SecondOutput::load_accelerometer,
                                   d.second.frequency_hz);
    for (std::size_t k = 0; k < plus.size(); ++k)
      slopes[i].push_back((plus[k] - minus[k]) / (2.0 * step) / d.second.std[k]);
    for (std::size_t j = 0; j < 4; ++j)
      first(static_cast<int>(i), static_cast<int>(j)) = d.first.covariance(kParameters[i], kParameters[j]);
  }
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t k = 0; k < d.second.lines(); ++k)
        information(static_cast<int>(i), static_cast<int>(j)) +=
            2.0 * (std::conj(slopes[i][k]) * slopes[j][k]).real();
  const Eigen::Matrix4d expected = (first.inverse() + information).inverse();
  // Positive parameters count as logarithms; neighbours that by chance are alike count for less.
  for (int i = 0; i < 4; ++i) {
    const double ratio = fit->model.covariance(kParameters[static_cast<std::size_t>(i)],
                                               kParameters[static_cast<std::size_t>(i)]) /
                         expected(i, i);
    EXPECT_GT(ratio, 0.9) << i;
    EXPECT_LT(ratio, 1.5) << i;
  }
}

TEST(SecondOutput, TellsFactorAndDelay) {
  const auto truth = model_of(belt(SecondOutput::load_encoder));
  std::mt19937_64 random(7);
  for (const auto& [gain, delay_s] :
       {std::pair(1.0, 0.0), std::pair(-1.0, 0.0), std::pair(57.3, 0.003), std::pair(0.96, -0.001)}) {
    const auto d = drawn(truth, SecondOutput::load_encoder, random, gain, delay_s);
    const auto fit = fit_second_output(d.first, d.second, {SecondOutput::load_encoder, true, true});
    ASSERT_TRUE(fit && fit->converged);
    EXPECT_NEAR(fit->gain.value, gain, 4.0 * fit->gain.std);
    EXPECT_NEAR(fit->delay_s.value, delay_s, 4.0 * fit->delay_s.std);
    EXPECT_LT(fit->gain.std, 0.02 * std::abs(gain));
    EXPECT_LT(fit->delay_s.std, 2e-4);
  }
}

TEST(SecondOutput, Refuses) {
  const auto truth = model_of(belt(SecondOutput::load_encoder));
  std::mt19937_64 random(8);
  auto d = drawn(truth, SecondOutput::load_encoder, random);
  EXPECT_EQ(std::string(fit_second_output(d.first, d.second, {SecondOutput::none}).error().field), "kind");
  EXPECT_EQ(std::string(fit_second_output(truth, d.second, {}).error().field), "first");
  d.second = d.second.band(0.0, 1.1);
  EXPECT_EQ(std::string(fit_second_output(d.first, d.second, {}).error().field), "second");
}

}  // namespace
}  // namespace resonid::fit
