// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>
#include <complex>
#include <limits>
#include <resonid/online/models/positive_real.hpp>
#include <utility>

// Eigen's decomposition alone: its products and solvers of bounded matrices take longer to compile than all
// else here.
namespace resonid::online {

namespace {

using Complex = std::complex<double>;
using BoundedComplex =
    Eigen::Matrix<Complex, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostParameters, kMostParameters>;
using Schur = Eigen::ComplexSchur<BoundedComplex>;  // M = U T U^H, T triangular

BoundedComplex widened(const BoundedMatrix& m) noexcept {
  BoundedComplex wide(m.rows(), m.cols());
  for (Eigen::Index i = 0; i < m.size(); ++i) wide.data()[i] = m.data()[i];
  return wide;
}

bool finite(const BoundedMatrix& m) noexcept {
  return std::all_of(m.data(), m.data() + m.size(), [](double x) { return std::isfinite(x); });
}

double least_real_part(const Schur& schur) noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < schur.matrixT().rows(); ++i)
    least = std::min(least, schur.matrixT()(i, i).real());
  return least;
}

}  // namespace

double least_real_eigenvalue(const BoundedMatrix& m) noexcept {
  if (!finite(m)) return std::numeric_limits<double>::quiet_NaN();
  return least_real_part(Schur(widened(m), false));
}

BoundedMatrix solved(const BoundedMatrix& a, const BoundedMatrix& b) noexcept {
  BoundedMatrix m = a, x = b;
  const auto n = m.rows();
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::Index pivot = k;
    for (Eigen::Index i = k + 1; i < n; ++i)
      if (std::abs(m(i, k)) > std::abs(m(pivot, k))) pivot = i;
    for (Eigen::Index j = 0; j < n; ++j) std::swap(m(k, j), m(pivot, j));
    for (Eigen::Index j = 0; j < x.cols(); ++j) std::swap(x(k, j), x(pivot, j));
    for (Eigen::Index i = k + 1; i < n; ++i) {
      const double share = m(i, k) / m(k, k);
      for (Eigen::Index j = k + 1; j < n; ++j) m(i, j) -= share * m(k, j);
      for (Eigen::Index j = 0; j < x.cols(); ++j) x(i, j) -= share * x(k, j);
    }
  }
  for (Eigen::Index j = 0; j < x.cols(); ++j)
    for (Eigen::Index i = n; i-- > 0;) {
      for (Eigen::Index k = i + 1; k < n; ++k) x(i, j) -= m(i, k) * x(k, j);
      x(i, j) /= m(i, i);
    }
  return x;
}

// The equation (T - s) Y + Y (T - s)^H = variance U^H P U of Y = U^H X U is solved from its last entry on.
// Eigenvectors would not do: those of output error are often nearly parallel.
BoundedMatrix recursion_covariance(const BoundedMatrix& m, const BoundedMatrix& p, double share) noexcept {
  const auto n = m.rows();
  BoundedMatrix result(n, n);
  for (Eigen::Index i = 0; i < result.size(); ++i)
    result.data()[i] = i % (n + 1) == 0 ? std::numeric_limits<double>::infinity() : 0.0;
  if (!finite(m) || !finite(p)) return result;
  const Schur schur(widened(m));
  const BoundedComplex& t = schur.matrixT();
  const double shift = 1.0 - 0.5 / share;
  if (schur.info() != Eigen::Success || !(least_real_part(schur) > shift)) return result;
  const BoundedComplex& u = schur.matrixU();
  BoundedComplex half(n, n), y(n, n);
  for (Eigen::Index i = 0; i < n; ++i)  // P U, then U^H P U
    for (Eigen::Index j = 0; j < n; ++j) {
      half(i, j) = 0.0;
      for (Eigen::Index k = 0; k < n; ++k) half(i, j) += p(i, k) * u(k, j);
    }
  for (Eigen::Index i = n; i-- > 0;) {
    for (Eigen::Index j = n; j-- > 0;) {
      Complex rest = 0.0;
      for (Eigen::Index k = 0; k < n; ++k) rest += std::conj(u(k, i)) * half(k, j);
      for (Eigen::Index k = i + 1; k < n; ++k) rest -= t(i, k) * y(k, j);
      for (Eigen::Index k = j + 1; k < n; ++k) rest -= y(i, k) * std::conj(t(j, k));
      y(i, j) = rest / (t(i, i) + std::conj(t(j, j)) - 2.0 * shift);
    }
  }
  for (Eigen::Index i = 0; i < n; ++i)  // U Y, then the real, symmetric part of U Y U^H
    for (Eigen::Index j = 0; j < n; ++j) {
      half(i, j) = 0.0;
      for (Eigen::Index k = 0; k < n; ++k) half(i, j) += u(i, k) * y(k, j);
    }
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (Eigen::Index k = 0; k < n; ++k)
        sum += (half(i, k) * std::conj(u(j, k)) + half(j, k) * std::conj(u(i, k))).real();
      result(i, j) = result(j, i) = 0.5 * sum;
    }
  return result;
}

}  // namespace resonid::online
