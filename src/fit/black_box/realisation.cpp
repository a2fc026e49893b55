// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/realisation.hpp>
#include <resonid/base/constants.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

using Complex = std::complex<double>;

/// sum_k rho^2k A^k b b^T A^kT by doubling; rho keeps the sum finite for poles on the unit circle.
Eigen::MatrixXd gramian(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, double rho) {
  Eigen::MatrixXd sum = b * b.transpose();
  Eigen::MatrixXd power = rho * a;
  for (int i = 0; i < 40; ++i) {
    const Eigen::MatrixXd add = power * sum * power.transpose();
    sum += add;
    if (add.norm() <= 1e-17 * sum.norm()) break;
    power = (power * power).eval();
  }
  return 0.5 * (sum + sum.transpose());
}

double largest(const Eigen::VectorXcd& poles) {
  return poles.size() == 0 ? 0.0 : poles.cwiseAbs().maxCoeff();
}

double discount(double radius, double horizon) {
  return std::min(1.0, (1.0 - 1.0 / horizon) / std::max(radius, 1e-300));
}

/// Scales (a, b) to orthonormal states: s = T s_new with T the Gramian's triangular factor.
std::optional<Eigen::MatrixXd> normalise(Realisation& r, double horizon) {
  const double rho = discount(largest(r.poles()), horizon);
  const linalg::Llt llt(gramian(r.transition, r.input, rho));
  if (!llt.succeeded()) return std::nullopt;
  const Eigen::MatrixXd t = llt.lower();
  if (!t.allFinite() || !(t.diagonal().minCoeff() > 0.0)) return std::nullopt;
  r.transition = linalg::solve_lower(t, r.transition * t);
  r.input = linalg::solve_lower(t, r.input);
  return t;
}

/// One or two states with the all-pass output that feeds the next section (Takenaka-Malmquist chain).
struct Section {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  Eigen::RowVectorXd c;
  double d = 0.0;
};

Section section(Complex p, bool pair, double horizon) {
  const double radius = std::abs(p);
  const double most = 1.0 - 1.0 / horizon;
  const Complex inside = radius > most ? p * (most / radius) : p;
  Section s;
  if (!pair) {
    const double x = inside.real(), g = std::sqrt(1.0 - x * x);
    s.a = Eigen::MatrixXd::Constant(1, 1, p.real());
    s.b = Eigen::VectorXd::Constant(1, g);
    s.c = Eigen::RowVectorXd::Constant(1, g);
    s.d = -x;
    return s;
  }
  // z^2 + a1 z + a2 in lattice form: orthonormal by construction.
  const double a1 = -2.0 * inside.real(), a2 = std::norm(inside);
  const double k1 = a1 / (1.0 + a2);
  const double c1 = std::sqrt(std::max(0.0, 1.0 - k1 * k1)), c2 = std::sqrt(1.0 - a2 * a2);
  s.a.resize(2, 2);
  s.a << -k1, c1, -a2 * c1, -a2 * k1;
  s.b = Eigen::Vector2d(0.0, c2);
  s.c = Eigen::RowVector2d(c2 * c1, c2 * k1);
  s.d = a2;
  if (radius > most) s.a *= radius / most;
  return s;
}

}  // namespace

Eigen::VectorXcd Realisation::poles() const {
  if (order() == 0) return {};
  return linalg::eigenvalues(transition);
}

Realisation realisation_of(std::vector<Complex> poles, double horizon) {
  std::sort(poles.begin(), poles.end(),
            [](const Complex& p, const Complex& q) { return std::abs(p) < std::abs(q); });
  Realisation r;
  Eigen::Index n = 0;
  Eigen::RowVectorXd chain;
  double through = 1.0;
  for (const Complex& p : poles) {
    const bool pair = std::abs(p.imag()) > 1e-9 * std::abs(p);
    if (pair && p.imag() < 0.0) continue;
    const Section s = section(p, pair, horizon);
    const auto m = s.b.size();
    r.transition.conservativeResize(n + m, n + m);
    r.input.conservativeResize(n + m);
    r.transition.topRightCorner(n, m).setZero();
    r.transition.bottomLeftCorner(m, n) = s.b * chain;
    r.transition.bottomRightCorner(m, m) = s.a;
    r.input.tail(m) = s.b * through;
    Eigen::RowVectorXd next(n + m);
    next << s.d * chain, s.c;
    chain = next;
    through *= s.d;
    n += m;
  }
  if (n > 0) normalise(r, horizon);
  return r;
}

std::optional<Renewed> renewed(const Realisation& r, const Eigen::VectorXd& alpha, double horizon,
                               double limit) {
  Renewed result{{r.transition - r.input * alpha.transpose(), r.input}, {}};
  if (r.order() == 0) return result;
  auto& next = result.realisation;
  if (!next.transition.allFinite() || largest(next.poles()) > limit) return std::nullopt;
  auto t = normalise(next, horizon);
  if (!t) return std::nullopt;
  result.states = std::move(*t);
  return result;
}

Eigen::VectorXcd basis(const Realisation& r, Complex z) {
  const auto n = r.order();
  if (n == 0) return {};
  Eigen::MatrixXcd m = -r.transition.cast<Complex>();
  m.diagonal().array() += z;
  return linalg::ComplexLu(m).solve(r.input.cast<Complex>());
}

Polynomials polynomials(const Realisation& r) {
  const auto n = r.order();
  const auto points = 2 * (n + 1);
  const double radius = 1.05 * std::max(1.0, largest(r.poles()));
  const Eigen::VectorXcd poles = r.poles();
  Polynomials p{Eigen::VectorXd::Zero(n + 1), Eigen::MatrixXd::Zero(n, n)};
  for (Eigen::Index k = 0; k < points; ++k) {
    const double angle = kTwoPi * static_cast<double>(k) / static_cast<double>(points);
    const Complex z = std::polar(radius, angle);
    Complex value = 1.0;
    for (const Complex& pole : poles) value *= 1.0 - pole / z;
    const Eigen::VectorXcd f = basis(r, z);
    for (Eigen::Index i = 0; i <= n; ++i) {
      const Complex turn = std::polar(std::pow(radius, static_cast<double>(i)) / static_cast<double>(points),
                                      angle * static_cast<double>(i));
      p.denominator(i) += (value * turn).real();
      for (Eigen::Index j = 0; j < n && i > 0; ++j) p.numerators(i - 1, j) += (value * f(j) * turn).real();
    }
  }
  p.denominator(0) = 1.0;
  return p;
}

}  // namespace resonid::fit::detail
