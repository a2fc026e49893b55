// SPDX-License-Identifier: MIT
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <limits>
#include <resonid/recursive/bounded_algebra.hpp>

namespace resonid::recursive {

BoundedMatrix solve_positive(const BoundedMatrix& a, const BoundedMatrix& b) noexcept {
  return a.ldlt().solve(b);
}

BoundedMatrix solve_square(const BoundedMatrix& a, const BoundedMatrix& b) noexcept {
  return a.partialPivLu().solve(b);
}

double least_real_eigenvalue(const BoundedMatrix& a) noexcept {
  return Eigen::EigenSolver<BoundedMatrix>(a, false).eigenvalues().real().minCoeff();
}

BoundedMatrix recursion_covariance(const BoundedMatrix& m, const BoundedMatrix& p, double variance,
                                   double share) noexcept {
  using ComplexMatrix = Eigen::Matrix<std::complex<double>, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                      kMaxBounded, kMaxBounded>;
  const auto n = m.rows();
  const BoundedMatrix infinite = BoundedMatrix::Identity(n, n) * std::numeric_limits<double>::infinity();
  if (!m.allFinite() || !p.allFinite() || !std::isfinite(variance)) return infinite;
  const Eigen::EigenSolver<BoundedMatrix> eigen(m);
  const double shift = 1.0 - 0.5 / share;
  if (!(eigen.eigenvalues().real().minCoeff() > shift)) return infinite;
  const ComplexMatrix v = eigen.eigenvectors();
  const auto lu = v.partialPivLu();
  const ComplexMatrix complex_p = p.cast<std::complex<double>>();
  const ComplexMatrix half = lu.solve(complex_p);
  const ComplexMatrix half_adjoint = half.adjoint();
  ComplexMatrix x = ComplexMatrix(lu.solve(half_adjoint)).adjoint();
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      x(i, j) *= variance / (eigen.eigenvalues()(i) + std::conj(eigen.eigenvalues()(j)) - 2.0 * shift);
  const BoundedMatrix result = (v * x * v.adjoint()).real();
  const BoundedMatrix mirrored = result.transpose();
  return 0.5 * (result + mirrored);
}

}  // namespace resonid::recursive
