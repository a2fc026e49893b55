// SPDX-License-Identifier: MIT
#include "plant/loop_poles.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::plant {
namespace {

using Complex = std::complex<double>;

/// Sum of x_i z^-i.
Complex in_powers(const std::vector<double>& x, Complex z) {
  Complex sum = 0.0;
  for (std::size_t i = x.size(); i-- > 0;) sum = sum / z + x[i];
  return sum;
}

struct Ways {
  Eigen::RowVectorXd early, whole;  // by the states
};
/// Ways of the driven side up to the reading and over the whole sample.
Ways ways(const SampledDrive& drive) {
  const Eigen::Index angle = drive.a.rows() - 1;
  const Eigen::RowVectorXd now = Eigen::RowVectorXd::Unit(drive.a.rows(), angle);
  return {drive.early_angle - now, drive.a.row(angle) - now};
}

/// L(z) without the whole samples of the delay.
Complex loop_without_delay(const SampledDrive& drive, VelocitySource velocity,
                           const data::TransferFunction& controller, Complex z) {
  const Eigen::Index n = drive.moving_states();
  Eigen::MatrixXcd m = -drive.a.topLeftCorner(n, n).cast<Complex>();
  m.diagonal().array() += z;
  const Eigen::VectorXcd x = linalg::ComplexLu(m).solve(drive.b.head(n).cast<Complex>());
  const auto seen = [&](const Eigen::RowVectorXd& row, double command) {
    return (row.head(n).cast<Complex>() * x)(0) + command;
  };
  Complex reading = seen(drive.early_velocity, drive.early_velocity_command);
  if (velocity == VelocitySource::encoder) {  // way up to the reading, and what was left of the sample before
    const auto [first, all] = ways(drive);
    const Complex early = seen(first, drive.early_angle_command);
    reading = (early + (seen(all, drive.b(drive.b.size() - 1)) - early) / z) / drive.sample_time_s;
  }
  return in_powers(controller.numerator, z) / in_powers(controller.denominator, z) * reading / z;
}

/// Angles at which |L| may change fast: 1 % apart, and close to the machine's own poles as close as these lie
/// to the circle.
std::vector<double> angles_of(const SampledDrive& drive, double outside) {
  constexpr double kFirst = 1e-11;  // rad, well below `outside`: the turn around an integrator is seen
  constexpr double kRatio = 1.01;
  constexpr double kNearest = 0.05;  // of a pole's distance from the circle
  constexpr double kStep = 1.2;
  std::vector<double> angles;
  for (double angle = kFirst; angle < kPi; angle *= kRatio) angles.push_back(angle);
  angles.push_back(kPi);
  const Eigen::Index n = drive.moving_states();
  const Eigen::VectorXcd poles = linalg::eigenvalues(drive.a.topLeftCorner(n, n));
  for (Eigen::Index i = 0; i < n; ++i) {
    const Complex pole = poles(i);
    const double centre = std::arg(pole);
    if (!(centre > 0.0)) continue;
    const double distance = std::max(std::abs(1.0 - std::abs(pole)), outside);
    angles.push_back(centre);
    for (double off = kNearest * distance; off < 0.1 * centre; off *= kStep) {
      angles.push_back(centre - off);
      if (centre + off < kPi) angles.push_back(centre + off);
    }
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

}  // namespace

data::FrequencyResponse loop_response(const SampledDrive& drive, const SampleDelay& delay,
                                      VelocitySource velocity, const data::TransferFunction& controller,
                                      std::vector<double> frequency_hz) {
  data::FrequencyResponse loop;
  loop.frequency_hz = std::move(frequency_hz);
  for (const double f : loop.frequency_hz) {
    const double angle = kTwoPi * f * drive.sample_time_s;
    loop.value.push_back(loop_without_delay(drive, velocity, controller, std::polar(1.0, angle)) *
                         std::polar(1.0, -angle * static_cast<double>(delay.whole)));
  }
  return loop;
}

bool loop_is_unstable(const SampledDrive& drive, const SampleDelay& delay, VelocitySource velocity,
                      const data::TransferFunction& controller) {
  constexpr double kOutside = 1e-9;   // of the circle: integrators lie on it
  constexpr double kDelayTurn = 0.1;  // rad that the delay turns from one angle to the next
  const auto at = [&](double angle) {
    return loop_without_delay(drive, velocity, controller, std::polar(1.0 + kOutside, angle));
  };
  const std::vector<double> angles = angles_of(drive, kOutside);
  // Where |L| < 1 the curve cannot turn around -1.
  std::size_t last = 0;
  for (std::size_t i = 0; i < angles.size(); ++i)
    if (std::abs(at(angles[i])) >= 0.99) last = std::min(i + 1, angles.size() - 1);
  const auto samples = static_cast<double>(delay.whole);
  const double widest = kDelayTurn / (samples + 1.0);
  const auto delayed = [&](double angle) {
    return 1.0 + at(angle) * std::polar(std::pow(1.0 + kOutside, -samples), -angle * samples);
  };
  Complex before = delayed(angles.front());
  double turned = 0.0;
  double angle = angles.front();
  for (std::size_t i = 1; i <= last; ++i)
    while (angle < angles[i]) {
      angle = std::min(angle + widest, angles[i]);
      const Complex now = delayed(angle);
      turned += std::arg(now / before);
      before = now;
    }
  // Where |L| < 1 from there on, 1 + L stays right of 0 and ends on the positive real axis.
  if (last + 1 < angles.size()) turned -= std::arg(before);
  return std::abs(turned) > kPi / 2.0;
}

// State: [machine; readings r_0 ... r_m, newest first; for differences the position increment's second half;
// controller]. A free machine without its angle: increments of position are linear in the rest.
std::complex<double> dominant_loop_pole(const SampledDrive& drive, const SampleDelay& delay,
                                        VelocitySource velocity, const data::TransferFunction& controller) {
  using Index = Eigen::Index;
  const Index n = drive.moving_states();
  const bool differences = velocity == VelocitySource::encoder;
  const auto readings = static_cast<Index>(delay.whole) + 1;
  const Index rest = n + readings;  // way from the reading to the sample's end, of differences
  const Index first = rest + (differences ? 1 : 0);
  const auto order =
      static_cast<Index>(std::max(controller.numerator.size(), controller.denominator.size())) - 1;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(first + order, first + order);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(first + order);  // of u
  a.topLeftCorner(n, n) = drive.a.topLeftCorner(n, n);
  b.head(n) = drive.b.head(n);
  if (differences) {
    // Way in this sample up to the reading, and the rest of it, which the next reading adds.
    const double rate = 1.0 / drive.sample_time_s;
    const auto [early, whole] = ways(drive);
    a.row(n).head(n) = rate * early.head(n);
    b(n) = rate * drive.early_angle_command;
    a(n, rest) = 1.0;
    a.row(rest).head(n) = rate * (whole - early).head(n);
    b(rest) = rate * (drive.b(drive.b.size() - 1) - drive.early_angle_command);
  } else {
    a.row(n).head(n) = drive.early_velocity.head(n);
    b(n) = drive.early_velocity_command;
  }
  for (Index i = 1; i < readings; ++i) a(n + i, n + i - 1) = 1.0;

  // Controller in transposed direct form: c = b0 e + s1, s_i' = s_(i+1) + b_i e - a_i c, with e = -y.
  const auto coefficient = [](const std::vector<double>& x, Index i) {
    return static_cast<std::size_t>(i) < x.size() ? x[static_cast<std::size_t>(i)] : 0.0;
  };
  const double a0 = controller.denominator[0];
  const double b0 = controller.numerator[0] / a0;
  const Index output = n + readings - 1;
  Eigen::RowVectorXd u = Eigen::RowVectorXd::Zero(first + order);
  u(output) = -b0;
  if (order > 0) u(first) = 1.0;
  for (Index i = 0; i < order; ++i) {
    a(first + i, output) -= coefficient(controller.numerator, i + 1) / a0;
    if (i + 1 < order) a(first + i, first + i + 1) += 1.0;
    a.row(first + i) -= coefficient(controller.denominator, i + 1) / a0 * u;
  }
  a += b * u;

  std::complex<double> greatest = 0.0;
  for (const auto& pole : linalg::eigenvalues(a))
    if (std::abs(pole) > std::abs(greatest)) greatest = pole;
  return greatest;
}

}  // namespace resonid::plant
