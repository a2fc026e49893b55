// SPDX-License-Identifier: MIT
#include "plant/loop_poles.hpp"

#include <Eigen/Eigenvalues>

namespace resonid::plant {

// State: [machine; readings r_0 ... r_m, newest first; for differences the position increment's second half;
// controller]. Machine without its angle: increments of position are linear in the rest.
std::complex<double> dominant_loop_pole(const SampledDrive& drive, const SampleDelay& delay,
                                        VelocitySource velocity, const data::TransferFunction& controller) {
  using Index = Eigen::Index;
  const Index n = drive.a.rows() - 1;
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
    a.row(n).head(n) = rate * drive.early_angle.head(n);
    b(n) = rate * drive.early_angle_command;
    a(n, rest) = 1.0;
    a.row(rest).head(n) = rate * (drive.a.row(n).head(n) - drive.early_angle.head(n));
    b(rest) = rate * (drive.b(n) - drive.early_angle_command);
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

  const Eigen::EigenSolver<Eigen::MatrixXd> solver(a, false);
  std::complex<double> greatest = 0.0;
  for (Index i = 0; i < solver.eigenvalues().size(); ++i)
    if (std::abs(solver.eigenvalues()(i)) > std::abs(greatest)) greatest = solver.eigenvalues()(i);
  return greatest;
}

}  // namespace resonid::plant
