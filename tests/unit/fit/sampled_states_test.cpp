// SPDX-License-Identifier: MIT
// The states of a drive in a loop against its response, which is worked out on another way: by every feature
// that a model may have.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/fit/detail/sampled_states.hpp>

namespace resonid::fit {
namespace {

DriveModel drive(Structure structure) {
  DriveModel m;
  m.structure = structure;
  m.sample_time_s = 0.002;
  auto& p = m.parameters;
  p.driven_inertia = 0.032;
  p.viscous_friction = 0.01;
  if (structure == Structure::rigid) return m;
  p.load_inertia = 0.04;
  p.stiffness = 144.0;
  p.damping = 0.3;
  p.load_viscous_friction = 0.02;
  if (structure == Structure::two_mass) return m;
  p.middle_inertia = 0.02;
  p.stiffness_2 = 400.0;
  p.damping_2 = 0.2;
  return m;
}

std::complex<double> response(const SampledStates& s, const Eigen::VectorXd& input,
                              const Eigen::RowVectorXd& output, double f) {
  const Eigen::MatrixXcd z =
      std::polar(1.0, kTwoPi * f * s.sample_time_s) * Eigen::MatrixXcd::Identity(s.a.rows(), s.a.rows());
  const Eigen::VectorXcd x =
      (z - s.a.cast<std::complex<double>>()).partialPivLu().solve(input.cast<std::complex<double>>());
  return (output.cast<std::complex<double>>() * x).value();
}

void expect_agreement(const DriveModel& m) {
  const auto s = sampled_states(m);
  const std::vector<double> lines = {0.7, 5.0, 10.6, 15.1, 60.0, 180.0, 247.0};
  const auto told = SampledResponse(m).at(lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    SCOPED_TRACE(lines[i]);
    EXPECT_LT(std::abs(response(s, s.command, s.measured, lines[i]) / told[i].measured - 1.0), 1e-9);
    EXPECT_LT(std::abs(response(s, s.command, s.load, lines[i]) / told[i].load - 1.0), 1e-9);
  }
}

TEST(SampledStates, HaveTheResponseOfTheModel) {
  for (const auto structure : {Structure::rigid, Structure::two_mass, Structure::three_mass})
    for (const double delay_s : {0.0, 0.0013, 0.004, 0.0047})
      for (const bool lag : {false, true})
        for (const bool filter : {false, true})
          for (const auto velocity : {Velocity::sampled, Velocity::differences})
            for (const bool ground : {false, true}) {
              SCOPED_TRACE(testing::Message() << name_of(structure) << " " << delay_s << " " << lag << filter
                                              << static_cast<int>(velocity) << ground);
              auto m = drive(structure);
              m.known_delay_s = delay_s;
              m.delay_s = 0.0004;
              m.torque_lag_s = lag ? 0.001 : 0.0;
              m.output_filter_s = filter ? 0.003 : 0.0;
              m.velocity = velocity;
              if (ground && structure != Structure::rigid) m.parameters.load_ground_stiffness = 20.0;
              expect_agreement(m);
            }
}

/// A torque on the load accelerates the whole drive, whichever mass it acts on.
TEST(SampledStates, TorqueOnTheLoadMovesTheInertia) {
  auto m = drive(Structure::two_mass);
  m.parameters.viscous_friction = m.parameters.load_viscous_friction = 0.0;
  const auto s = sampled_states(m);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(s.a.rows());
  constexpr int kSamples = 5000;
  for (int k = 0; k < kSamples; ++k) x = (s.a * x + s.load_torque).eval();
  const double seconds = kSamples * m.sample_time_s, inertia = 0.032 + 0.04;
  EXPECT_NEAR(s.measured * x, seconds / inertia, 1e-3 * seconds / inertia);
  EXPECT_NEAR(s.load * x, seconds / inertia, 1e-3 * seconds / inertia);
}

}  // namespace
}  // namespace resonid::fit
