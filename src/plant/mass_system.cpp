// SPDX-License-Identifier: MIT
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/plant/detail/mass_system.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::plant {
namespace {

using Index = Eigen::Index;

/// Stiffness or damping between the masses, [mass, mass]: torque on the masses = -matrix * angles.
Eigen::MatrixXd coupling_matrix(const MassSystem& system, double Coupling::*property) {
  const auto n = static_cast<Index>(system.masses());
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
  for (const Coupling& c : system.couplings) {
    const auto i = static_cast<Index>(c.from);
    const auto j = static_cast<Index>(c.to);
    m(i, i) += c.*property;
    m(j, j) += c.*property;
    m(i, j) -= c.*property;
    m(j, i) -= c.*property;
  }
  return m;
}

/// That of the couplings and of the springs to the ground.
Eigen::MatrixXd stiffness_matrix(const MassSystem& system) {
  Eigen::MatrixXd k = coupling_matrix(system, &Coupling::stiffness);
  for (std::size_t i = 0; i < system.ground.size(); ++i)
    k(static_cast<Index>(i), static_cast<Index>(i)) += system.ground[i];
  return k;
}

/// Modes of M x'' + D x' + K x = 0 by the undamped eigenvectors v, scaled to v' M v = 1: w^2 = v' K v and
/// zeta = v' D v/(2 w). The damping is exact where it shares the stiffness' eigenvectors, as in every
/// two-mass drive.
std::vector<data::UndampedMode> modes(const Eigen::MatrixXd& stiffness, const Eigen::MatrixXd& damping,
                                      const Eigen::VectorXd& inertia, Index rigid) {
  std::vector<data::UndampedMode> result;
  if (inertia.size() <= rigid) return result;
  const Eigen::VectorXd scale = inertia.cwiseSqrt().cwiseInverse();
  const auto axes = linalg::symmetric_eigenpairs(scale.asDiagonal() * stiffness * scale.asDiagonal());
  for (Index i = rigid; i < inertia.size(); ++i) {
    const double omega = std::sqrt(std::max(0.0, axes.values(i)));
    const Eigen::VectorXd shape = scale.asDiagonal() * axes.vectors.col(i);
    result.push_back({omega / kTwoPi, shape.dot(damping * shape) / (2.0 * omega)});
  }
  return result;
}

Eigen::VectorXd inertias(const MassSystem& system) {
  return Eigen::Map<const Eigen::VectorXd>(system.inertia.data(), static_cast<Index>(system.masses()));
}

Eigen::MatrixXd damping_matrix(const MassSystem& system) {
  Eigen::MatrixXd d = coupling_matrix(system, &Coupling::damping);
  for (std::size_t i = 0; i < system.masses(); ++i)
    d(static_cast<Index>(i), static_cast<Index>(i)) += system.viscous[i];
  return d;
}

}  // namespace

ContinuousDrive continuous_drive(const MassSystem& system, double lag_s, double angle_scale) {
  const auto n = static_cast<Index>(system.masses());
  const bool lags = lag_s > 0.0;
  const Index motor = 2 * n - 1;  // the motor's torque, if it lags
  const Index angle = motor + (lags ? 1 : 0);
  const Eigen::MatrixXd k = stiffness_matrix(system);
  const Eigen::MatrixXd d = damping_matrix(system);
  const Eigen::VectorXd j = inertias(system);

  ContinuousDrive drive;
  const double fastest =
      n > 1 || system.grounded() ? std::sqrt((k.diagonal().array() / j.array()).maxCoeff()) : 1.0;
  drive.angle_scale = angle_scale > 0.0 ? angle_scale : fastest;
  drive.a = Eigen::MatrixXd::Zero(angle + 1, angle + 1);
  drive.b = Eigen::MatrixXd::Zero(angle + 1, 1 + n);
  for (Index i = 0; i < n; ++i) {
    drive.a.row(i).head(n) = -d.row(i) / j(i);
    drive.a.row(i).segment(n, n - 1) = -k.row(i).tail(n - 1) / (j(i) * drive.angle_scale);
    drive.b(i, 1 + i) = 1.0 / j(i);
    if (i > 0) {
      drive.a(n - 1 + i, i) = drive.angle_scale;
      drive.a(n - 1 + i, 0) = -drive.angle_scale;
    }
  }
  if (!lags) drive.b(0, 0) = 1.0 / j(0);
  if (lags) {
    drive.a(0, motor) = 1.0 / j(0);
    drive.a(motor, motor) = -1.0 / lag_s;
    drive.b(motor, 0) = 1.0 / lag_s;
  }
  drive.a(angle, 0) = 1.0;
  for (Index i = 0; i < static_cast<Index>(system.ground.size()); ++i)
    drive.a(i, angle) -= system.ground[static_cast<std::size_t>(i)] / j(i);
  return drive;
}

std::vector<data::UndampedMode> resonances(const MassSystem& system) {
  return modes(stiffness_matrix(system), damping_matrix(system), inertias(system), system.grounded() ? 0 : 1);
}

std::vector<data::UndampedMode> antiresonances(const MassSystem& system) {
  const Index others = static_cast<Index>(system.masses()) - 1;
  if (others == 0) return {};
  return modes(stiffness_matrix(system).bottomRightCorner(others, others),
               damping_matrix(system).bottomRightCorner(others, others), inertias(system).tail(others), 0);
}

}  // namespace resonid::plant
