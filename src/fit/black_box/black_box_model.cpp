// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/realisation.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/fit/black_box.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

using Complex = std::complex<double>;

double total_variance(const Eigen::MatrixXd& covariance, const Eigen::VectorXcd& gradient) {
  const Eigen::VectorXd re = gradient.real(), im = gradient.imag();
  return re.dot(covariance * re) + im.dot(covariance * im);
}

UncertainRoot root(Complex value, const Eigen::MatrixXd& covariance, const Eigen::VectorXcd& gradient) {
  Eigen::MatrixXd parts(2, gradient.size());
  parts.row(0) = gradient.real().transpose();
  parts.row(1) = gradient.imag().transpose();
  return {value, parts * covariance * parts.transpose()};
}

struct Value {
  Complex g;
  Eigen::VectorXcd gradient;  // with respect to [alpha, c, h]
};

Value value_at(const BlackBoxRealisation& r, Complex z) {
  const auto n = r.output.size(), m = r.taps.size();
  const Complex inverse_z = 1.0 / z;
  Complex outer = 1.0;
  if (r.integrator) outer = (m == 1 ? inverse_z : Complex(1.0)) / (1.0 - inverse_z);
  const Eigen::VectorXcd f = detail::basis({r.transition, r.input}, z);
  const Complex inner = m == 2 ? inverse_z : Complex(1.0);
  Value v;
  v.gradient.resize(2 * n + m);
  for (Eigen::Index i = 0; i < n; ++i) v.g += inner * r.output(i) * f(i);
  for (Eigen::Index t = 0; t < m; ++t) v.g += r.taps(t) * (t == 0 ? Complex(1.0) : inverse_z);
  v.g *= outer;
  for (Eigen::Index i = 0; i < n; ++i) {
    v.gradient(i) = -v.g * f(i);
    v.gradient(n + i) = outer * inner * f(i);
  }
  for (Eigen::Index t = 0; t < m; ++t) v.gradient(2 * n + t) = outer * (t == 0 ? Complex(1.0) : inverse_z);
  return v;
}

/// From the polynomials, for a model that came without a realisation.
Value value_at(const data::TransferFunction& g, Complex z) {
  const auto nb = static_cast<Eigen::Index>(g.numerator.size());
  const auto na = static_cast<Eigen::Index>(g.denominator.size()) - 1;
  const Complex inverse_z = 1.0 / z;
  Complex b = 0.0, a = 0.0, power = 1.0;
  Value v;
  v.gradient.resize(nb + na);
  for (Eigen::Index i = 0; i < std::max(nb, na + 1); ++i, power *= inverse_z) {
    if (i < nb) b += g.numerator[static_cast<std::size_t>(i)] * power;
    if (i <= na) a += g.denominator[static_cast<std::size_t>(i)] * power;
  }
  v.g = b / a;
  power = 1.0;
  for (Eigen::Index i = 0; i < std::max(nb, na + 1); ++i, power *= inverse_z) {
    if (i < nb) v.gradient(i) = power / a;
    if (i > 0 && i <= na) v.gradient(nb + i - 1) = -v.g * power / a;
  }
  return v;
}

/// p(z) = sum k_i z^-i: dz = -sum z^-i dk_i / p'(z), in the columns from `first` on.
Eigen::VectorXcd root_gradient(const std::vector<double>& k, Complex z, Eigen::Index first,
                               Eigen::Index size) {
  Complex slope = 0.0;
  for (std::size_t i = 1; i < k.size(); ++i)
    slope -= static_cast<double>(i) * k[i] * std::pow(z, -static_cast<double>(i) - 1.0);
  Eigen::VectorXcd gradient = Eigen::VectorXcd::Zero(size);
  for (std::size_t i = 0; i < k.size(); ++i) {
    const Eigen::Index column = first + static_cast<Eigen::Index>(i);
    if (column >= 0 && column < size) gradient(column) = -std::pow(z, -static_cast<double>(i)) / slope;
  }
  return gradient;
}

std::vector<UncertainRoot> polynomial_roots(const std::vector<double>& coefficients,
                                            const Eigen::MatrixXd& covariance, Eigen::Index first,
                                            bool monic) {
  std::size_t leading = 0;
  while (leading < coefficients.size() && coefficients[leading] == 0.0) ++leading;
  if (coefficients.size() < leading + 2) return {};
  const std::vector<double> k(coefficients.begin() + static_cast<std::ptrdiff_t>(leading),
                              coefficients.end());
  std::vector<UncertainRoot> roots;
  for (const Complex& z : data::TransferFunction{{1.0}, k, 1.0}.poles()) {
    Eigen::VectorXcd gradient =
        root_gradient(k, z, first + static_cast<Eigen::Index>(leading), covariance.rows());
    if (monic) gradient.head(std::min<Eigen::Index>(first + 1, gradient.size())).setZero();
    roots.push_back(root(z, covariance, gradient));
  }
  return roots;
}

}  // namespace

data::FrequencyResponse BlackBoxModel::response(std::span<const double> frequencies_hz) const {
  data::FrequencyResponse result;
  const double ts = transfer_function.sample_time_s;
  const double further = static_cast<double>(delay_samples) * ts - known_delay_s;
  for (const double f : frequencies_hz) {
    const Complex z = std::polar(1.0, kTwoPi * f * ts);
    const Value v = realisation.present() ? value_at(realisation, z) : value_at(transfer_function, z);
    const auto& c = realisation.present() ? realisation.covariance : covariance;
    result.frequency_hz.push_back(f);
    result.value.push_back(v.g * std::polar(1.0, -kTwoPi * f * further));
    result.std.push_back(
        c.rows() == v.gradient.size() ? std::sqrt(std::max(0.0, total_variance(c, v.gradient))) : 0.0);
  }
  return result;
}

std::vector<UncertainRoot> BlackBoxModel::poles() const {
  if (!realisation.present()) {
    const auto nb = static_cast<Eigen::Index>(transfer_function.numerator.size());
    return polynomial_roots(transfer_function.denominator, covariance, nb - 1, true);
  }
  std::vector<UncertainRoot> roots;
  const auto n = realisation.output.size();
  if (realisation.integrator) roots.push_back({1.0, Eigen::Matrix2d::Zero()});
  if (n == 0) return roots;
  const auto [values, right] = linalg::eigenpairs(realisation.transition);
  const Eigen::VectorXcd through = linalg::ComplexLu(right).solve(realisation.input.cast<Complex>());
  for (Eigen::Index j = 0; j < n; ++j) {
    // transition - input alpha^T: d p = -(l b)(r^T d alpha), l r = 1
    Eigen::VectorXcd gradient = Eigen::VectorXcd::Zero(realisation.covariance.rows());
    gradient.head(n) = -through(j) * right.col(j);
    roots.push_back(root(values(j), realisation.covariance, gradient));
  }
  return roots;
}

std::vector<UncertainRoot> BlackBoxModel::zeros() const {
  const auto n = realisation.output.size(), m = realisation.taps.size();
  if (!realisation.present() || m == 2 || n == 0)
    return polynomial_roots(transfer_function.numerator, covariance, 0, false);
  // Finite generalised eigenvalues of [A b; c h] - z [I 0; 0 0], by a shift: eigenvalues of the inverse.
  Eigen::MatrixXd pencil = Eigen::MatrixXd::Zero(n + 1, n + 1), unit = pencil;
  pencil.topLeftCorner(n, n) = realisation.transition;
  pencil.topRightCorner(n, 1) = realisation.input;
  pencil.bottomLeftCorner(1, n) = realisation.output.transpose();
  if (m == 1) pencil(n, n) = realisation.taps(0);
  unit.topLeftCorner(n, n).setIdentity();
  constexpr double kShift = 1.0371;  // nothing special: no zero is expected exactly there
  const Eigen::VectorXcd found = linalg::eigenvalues(linalg::RealLu(pencil - kShift * unit).solve(unit));
  // The rest lie at infinity: two of them without a tap, one with it.
  std::vector<Complex> values(found.begin(), found.end());
  std::sort(values.begin(), values.end(),
            [](const Complex& p, const Complex& q) { return std::abs(p) > std::abs(q); });
  values.resize(static_cast<std::size_t>(m == 1 ? n : n - 1));
  std::vector<UncertainRoot> roots;
  for (const Complex& value : values) {
    if (!(std::abs(value) > 1e-12)) continue;
    const Complex z = kShift + 1.0 / value;
    const Eigen::VectorXcd f = detail::basis({realisation.transition, realisation.input}, z);
    Eigen::MatrixXcd shifted = -realisation.transition.cast<Complex>();
    shifted.diagonal().array() += z;
    Complex slope = 0.0;
    const Eigen::VectorXcd ff = linalg::ComplexLu(shifted).solve(f);
    for (Eigen::Index i = 0; i < n; ++i) slope -= realisation.output(i) * ff(i);
    Eigen::VectorXcd gradient = Eigen::VectorXcd::Zero(realisation.covariance.rows());
    if (gradient.size() == 2 * n + m) {
      gradient.segment(n, n) = -f / slope;
      if (m == 1) gradient(2 * n) = -1.0 / slope;
    }
    roots.push_back(root(z, realisation.covariance, gradient));
  }
  return roots;
}

}  // namespace resonid::fit
