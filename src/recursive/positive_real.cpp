// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <complex>
#include <limits>
#include <resonid/recursive/positive_real.hpp>

namespace resonid::recursive {

namespace {

using Complex = std::complex<double>;
using BoundedComplex =
    Eigen::Matrix<Complex, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostParameters, kMostParameters>;

}  // namespace

double least_real_eigenvalue(const BoundedMatrix& m) noexcept {
  if (!m.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  return Eigen::EigenSolver<BoundedMatrix>(m, false).eigenvalues().real().minCoeff();
}

BoundedMatrix solved(const BoundedMatrix& a, const BoundedMatrix& b) noexcept {
  return Eigen::PartialPivLU<BoundedMatrix>(a).solve(b);
}

// With M = V diag(m) V^-1 the equation falls apart: (V^-1 X V^-H)_ij = variance (V^-1 P V^-H)_ij / (m_i +
// m_j*).
BoundedMatrix recursion_covariance(const BoundedMatrix& m, const BoundedMatrix& p, double variance,
                                   double share) noexcept {
  const auto n = m.rows();
  const BoundedMatrix infinite = BoundedMatrix::Identity(n, n) * std::numeric_limits<double>::infinity();
  if (!m.allFinite() || !p.allFinite() || !std::isfinite(variance)) return infinite;
  const Eigen::EigenSolver<BoundedMatrix> eigen(m);
  const auto& value = eigen.eigenvalues();
  const double shift = 1.0 - 0.5 / share;
  if (!(value.real().minCoeff() > shift)) return infinite;
  const BoundedComplex v = eigen.eigenvectors();
  const Eigen::PartialPivLU<BoundedComplex> lu(v);
  const BoundedComplex wide = p.cast<Complex>();
  const BoundedComplex half = lu.solve(wide);
  const BoundedComplex turned = half.adjoint();
  BoundedComplex x = BoundedComplex(lu.solve(turned)).adjoint();
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) x(i, j) *= variance / (value(i) + std::conj(value(j)) - 2.0 * shift);
  const BoundedComplex inner = x * v.adjoint();
  const BoundedMatrix result = BoundedComplex(v * inner).real();
  const BoundedMatrix mirrored = result.transpose();
  return 0.5 * (result + mirrored);
}

}  // namespace resonid::recursive
