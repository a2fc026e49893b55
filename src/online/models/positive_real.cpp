// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <complex>
#include <limits>
#include <resonid/online/models/positive_real.hpp>

namespace resonid::online {

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

// With M = U T U^H, T triangular, the equation (T - s) Y + Y (T - s)^H = variance U^H P U of Y = U^H X U is
// solved from its last entry on. Eigenvectors would not do: those of output error are often nearly parallel.
BoundedMatrix recursion_covariance(const BoundedMatrix& m, const BoundedMatrix& p, double variance,
                                   double share) noexcept {
  const auto n = m.rows();
  const BoundedMatrix infinite = BoundedMatrix::Identity(n, n) * std::numeric_limits<double>::infinity();
  if (!m.allFinite() || !p.allFinite() || !std::isfinite(variance)) return infinite;
  const BoundedComplex wide = m.cast<Complex>();
  const Eigen::ComplexSchur<BoundedComplex> schur(wide);
  const BoundedComplex& t = schur.matrixT();
  const double shift = 1.0 - 0.5 / share;
  if (schur.info() != Eigen::Success || !(t.diagonal().real().minCoeff() > shift)) return infinite;
  const BoundedComplex& u = schur.matrixU();
  const BoundedComplex turned = u.adjoint() * p.cast<Complex>();
  BoundedComplex y = turned * u;
  for (Eigen::Index i = n; i-- > 0;) {
    for (Eigen::Index j = n; j-- > 0;) {
      Complex rest = variance * y(i, j);
      for (Eigen::Index k = i + 1; k < n; ++k) rest -= t(i, k) * y(k, j);
      for (Eigen::Index k = j + 1; k < n; ++k) rest -= y(i, k) * std::conj(t(j, k));
      y(i, j) = rest / (t(i, i) + std::conj(t(j, j)) - 2.0 * shift);
    }
  }
  const BoundedComplex inner = y * u.adjoint();
  const BoundedMatrix result = BoundedComplex(u * inner).real();
  const BoundedMatrix mirrored = result.transpose();
  return 0.5 * (result + mirrored);
}

}  // namespace resonid::online
