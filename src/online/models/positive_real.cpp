// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
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

RecursionMeans recursion_means(const RecursionBand& band) noexcept {
  const auto order = band.b.size();
  const auto n = static_cast<Eigen::Index>(2 * order);
  RecursionMeans means;
  for (BoundedMatrix* m : {&means.own, &means.cross, &means.noise, &means.moving})
    *m = BoundedMatrix::Zero(n, n);
  std::array<Complex, kMostParameters> f;
  std::array<double, kMostParameters> in_phase, quadrature;
  const double share = 1.0 / band.points;
  for (int k = 0; k < band.points; ++k) {
    const double omega = kTwoPi * (band.from + (k + 0.5) * share * (band.to - band.from));
    const Complex back = std::polar(1.0, -omega),
                  delay = std::pow(back, static_cast<int>(band.delay_samples));
    const auto sum = [](std::span<const double> c, Complex x) {  // c_1 x + c_2 x^2 + ...
      Complex value = 0.0;
      for (std::size_t i = c.size(); i-- > 0;) value = (value + c[i]) * x;
      return value;
    };
    const Complex controller =
        (band.controller.numerator[0] + sum(std::span(band.controller.numerator).subspan(1), back)) /
        (band.controller.denominator[0] + sum(std::span(band.controller.denominator).subspan(1), back));
    const Complex plant = delay * sum(band.b, back) / (1.0 + sum(band.a, back));
    const Complex input = 1.0 / (1.0 + plant * controller), output = plant * input;
    const auto filter = [&](RegressorFilter kind, std::span<const double> b, std::span<const double> a,
                            double contraction) {
      if (kind == RegressorFilter::none) return Complex(1.0);
      const Complex inverse = 1.0 / (1.0 + sum(a, contraction * back));
      if (kind == RegressorFilter::inverse_a) return inverse;
      return inverse / (1.0 + delay * sum(b, back) / (1.0 + sum(a, back)) * controller);
    };
    const Complex error = filter(band.error, band.b, band.a, 1.0);
    const Complex gradient =
        filter(band.gradient, band.gradient_b, band.gradient_a, band.gradient_contraction);
    Complex power = delay;
    for (std::size_t i = 0; i < order; ++i) f[i] = (power *= back) * input;
    power = band.fixed_integrator ? 1.0 - back : Complex(1.0);
    for (std::size_t i = 0; i < order; ++i) f[order + i] = -(power *= back) * output;
    if (band.fixed_integrator) f[2 * order - 1] = 0.0;
    const Complex moving =
        delay * sum(band.moving_b, back) * input - sum(band.moving_a, back) * output;  // g'f
    const Complex cross = gradient * std::conj(error);
    const double own = std::norm(gradient), noise = own * std::norm(input);
    for (std::size_t i = 0; i < 2 * order; ++i) {
      const Complex v = cross * f[i] * std::conj(moving);
      in_phase[i] = v.real();
      quadrature[i] = v.imag();
    }
    for (std::size_t i = 0; i < 2 * order; ++i)
      for (std::size_t j = 0; j < 2 * order; ++j) {
        const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
        const Complex product = f[i] * std::conj(f[j]);
        means.own(row, column) += share * own * product.real();
        means.noise(row, column) += share * noise * product.real();
        means.cross(row, column) += share * (cross * product).real();
        means.moving(row, column) +=
            share * (in_phase[i] * in_phase[j] + RecursionMeans::kSmeared * quadrature[i] * quadrature[j]);
      }
    means.noise_level += share * std::norm(input);
    means.along_own += share * own * std::norm(moving);
    means.along_cross += share * cross.real() * std::norm(moving);
    means.along_error += share * std::norm(error) * std::norm(moving);
    means.least_real_part = std::min(means.least_real_part, (error / gradient).real() - 0.5);
  }
  if (band.fixed_integrator) means.own(n - 1, n - 1) = means.cross(n - 1, n - 1) = 1.0;
  return means;
}

BoundedMatrix weighted(const BoundedMatrix& p, const BoundedMatrix& own, const BoundedMatrix& w) noexcept {
  const auto n = p.rows();
  BoundedMatrix r = BoundedMatrix::Zero(n, n), u = r, half = w;
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = j; i < n; ++i) {
      double rest = own(i, j);
      for (Eigen::Index k = 0; k < j; ++k) rest -= r(i, k) * r(j, k);
      r(i, j) = i == j ? std::sqrt(rest) : rest / r(j, j);
    }
  for (Eigen::Index j = n; j-- > 0;)  // columns from the last one on; 0 of a parameter that is not estimated
    for (Eigen::Index i = j + 1; i-- > 0;) {
      double rest = p(i, j);
      for (Eigen::Index k = j + 1; k < n; ++k) rest -= u(i, k) * u(j, k);
      u(i, j) = i == j ? std::sqrt(std::max(rest, 0.0)) : (u(j, j) > 0.0 ? rest / u(j, j) : 0.0);
    }
  for (int side = 0; side < 2; ++side) {  // R^-1 W, then R^-1 (R^-1 W)'
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index k = 0; k < i; ++k) half(i, j) -= r(i, k) * half(k, j);
        half(i, j) /= r(i, i);
      }
    half.transposeInPlace();
  }
  for (int side = 0; side < 2; ++side) {  // U half, then U (U half)'
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index i = 0; i < n; ++i) {  // row i needs those from i on
        double sum = 0.0;
        for (Eigen::Index k = i; k < n; ++k) sum += u(i, k) * half(k, j);
        half(i, j) = sum;
      }
    half.transposeInPlace();
  }
  return half;
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
