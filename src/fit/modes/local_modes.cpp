// SPDX-License-Identifier: MIT
#include "fit/modes/local_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

using Complex = std::complex<double>;
constexpr Complex kJ{0.0, 1.0};
constexpr double kLeastDamping = -0.2, kMostDamping = 1.2;

Complex factor(const LocalRoot& root, double f) {
  const double u = f / root.frequency_hz;
  const Complex q = 1.0 - u * u + 2.0 * kJ * root.damping_ratio * u;
  return root.zero ? q : 1.0 / q;
}

/// d ln(factor) by (ln f0, D).
std::array<Complex, 2> slopes(const LocalRoot& root, double f) {
  const double u = f / root.frequency_hz;
  Complex q = 1.0 - u * u + 2.0 * kJ * root.damping_ratio * u;
  if (std::abs(q) < 1e-12) q = 1e-12;
  const double sign = root.zero ? 1.0 : -1.0;
  return {sign * (2.0 * u * u - 2.0 * kJ * root.damping_ratio * u) / q, sign * 2.0 * kJ * u / q};
}

double position(const LocalLines& lines, double f) {
  return std::log(f / lines.centre_hz) / lines.half_width;
}

Complex polynomial(const Eigen::VectorXcd& coefficients, double x) {
  Complex value = 0.0;
  for (Eigen::Index t = coefficients.size(); t-- > 0;) value = value * x + coefficients(t);
  return value;
}

/// Model, all that it changes with, and what it leaves, divided by the standard deviations.
struct Linearised {
  Eigen::VectorXcd residual;
  Eigen::MatrixXcd jacobian;  ///< Columns: (ln f0, D) of every root, real and imaginary part of every c.
  double power = 0.0;

  [[nodiscard]] bool usable() const { return std::isfinite(power) && jacobian.allFinite(); }
};

/// exp(c0 + c1 x + ...): unlike a polynomial it has no zeros of its own that could stand for one of G.
struct State {
  std::vector<LocalRoot> roots;
  Eigen::VectorXcd background;
};

class Problem {
 public:
  Problem(const data::FrequencyResponse& g, const LocalLines& lines) : g_(g), lines_(lines) {
    const std::size_t points = g.smoothing.width_hz > 0.0 ? 2 : 1;
    for (const std::size_t i : lines.line) {
      std::vector<Point> at;
      Complex whole = 0.0;
      for (std::size_t p = 0; p < points; ++p) {
        const double shift = points == 1 ? 0.0 : (p == 0 ? -1.0 : 1.0) * g.smoothing.width_hz;
        Point point;
        point.f = std::max(g.frequency_hz[i] + shift, 0.1 * g.frequency_hz[i]);
        point.x = position(lines, point.f);
        point.known = g.smoothing.slope.empty() ? Complex(1.0) : std::exp(shift * g.smoothing.slope[i]);
        whole += point.known;
        point.known /= kJ * point.f;
        for (const auto& root : lines.known) point.known *= factor(root, point.f);
        at.push_back(point);
      }
      for (auto& point : at) point.known /= whole * g.std[i];
      points_.push_back(std::move(at));
    }
  }

  [[nodiscard]] Linearised at(const State& state) const {
    const auto count = static_cast<Eigen::Index>(points_.size());
    const auto of_roots = static_cast<Eigen::Index>(2 * state.roots.size());
    const Eigen::Index terms = state.background.size();
    Linearised l{Eigen::VectorXcd(count), Eigen::MatrixXcd::Zero(count, of_roots + 2 * terms), 0.0};
    for (Eigen::Index k = 0; k < count; ++k) {
      Complex model = 0.0;
      for (const auto& point : points_[static_cast<std::size_t>(k)]) {
        Complex value = point.known * std::exp(polynomial(state.background, point.x));
        for (const auto& root : state.roots) value *= factor(root, point.f);
        model += value;
        for (std::size_t r = 0; r < state.roots.size(); ++r) {
          const auto slope = slopes(state.roots[r], point.f);
          for (std::size_t p = 0; p < 2; ++p)
            l.jacobian(k, static_cast<Eigen::Index>(2 * r + p)) += value * slope[p];
        }
        for (Eigen::Index t = 0; t < terms; ++t, value *= point.x) {
          l.jacobian(k, of_roots + 2 * t) += value;
          l.jacobian(k, of_roots + 2 * t + 1) += kJ * value;
        }
      }
      l.residual(k) = measured(k) - model;
    }
    l.power = l.residual.squaredNorm();
    return l;
  }

  /// The best constant with a slope of the phase, for roots that are near enough.
  [[nodiscard]] Eigen::VectorXcd start(const std::vector<LocalRoot>& roots, Eigen::Index terms) const {
    constexpr double kSteepest = 12.0, kStep = 0.4;  // rad over half a window
    Eigen::VectorXcd best = Eigen::VectorXcd::Zero(terms);
    double least = std::numeric_limits<double>::infinity();
    State state{roots, Eigen::VectorXcd::Zero(terms)};
    const Linearised flat = at(state);
    const Eigen::VectorXcd plain = flat.jacobian.col(static_cast<Eigen::Index>(2 * roots.size()));
    for (double slope = -kSteepest; slope <= kSteepest; slope += kStep) {
      Complex product = 0.0;
      double power = 0.0, total = 0.0;
      for (Eigen::Index k = 0; k < plain.size(); ++k) {
        const Complex turned =
            plain(k) * std::polar(1.0, slope * points_[static_cast<std::size_t>(k)].front().x);
        product += std::conj(turned) * measured(k);
        power += std::norm(turned);
        total += std::norm(measured(k));
      }
      if (!(power > 0.0) || !(std::norm(product) > 0.0)) continue;
      const double left = total - std::norm(product) / power;
      if (!(left < least)) continue;
      least = left;
      best(0) = std::log(product / power);
      if (terms > 1) best(1) = kJ * slope;
    }
    return best;
  }

 private:
  struct Point {
    double f = 0.0, x = 0.0;
    Complex known;
  };
  [[nodiscard]] Complex measured(Eigen::Index k) const {
    const std::size_t i = lines_.line[static_cast<std::size_t>(k)];
    return g_.value[i] / g_.std[i];
  }
  const data::FrequencyResponse& g_;
  const LocalLines& lines_;
  std::vector<std::vector<Point>> points_;  ///< [line] one, or two of a smoothed response
};

State moved(State state, const Eigen::VectorXd& by, const LocalLines& lines) {
  constexpr double kFarthest = 0.15;  // of ln f and of D, in one step
  for (std::size_t r = 0; r < state.roots.size(); ++r) {
    const auto at = static_cast<Eigen::Index>(2 * r);
    auto& root = state.roots[r];
    const double x =
        std::log(root.frequency_hz / lines.centre_hz) + std::clamp(by(at), -kFarthest, kFarthest);
    root.frequency_hz = lines.centre_hz * std::exp(std::clamp(x, -lines.half_width, lines.half_width));
    root.damping_ratio = std::clamp(root.damping_ratio + std::clamp(by(at + 1), -kFarthest, kFarthest),
                                    kLeastDamping, kMostDamping);
  }
  for (Eigen::Index t = 0; t < state.background.size(); ++t) {
    const auto at = static_cast<Eigen::Index>(2 * state.roots.size()) + 2 * t;
    state.background(t) += Complex(by(at), by(at + 1));
  }
  return state;
}

/// Covariance by 2 Re(J^H J), with errors of neighbouring lines that are alike; of the roots.
Eigen::MatrixXd covariance_of(const data::FrequencyResponse& g, const LocalLines& lines,
                              const Eigen::MatrixXcd& j, Eigen::Index parameters) {
  const Eigen::MatrixXd information = 2.0 * (j.adjoint() * j).real();
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd inverse =
      scale.asDiagonal() *
      linalg::pseudo_inverse(scale.asDiagonal() * information * scale.asDiagonal()).matrix *
      scale.asDiagonal();
  if (g.correlation.distance_hz.empty()) return inverse.topLeftCorner(parameters, parameters);
  Eigen::MatrixXd score = information;
  const double reach = g.correlation.distance_hz.back();
  for (std::size_t a = 0; a < lines.line.size(); ++a)
    for (std::size_t b = a + 1; b < lines.line.size(); ++b) {
      const double distance = g.frequency_hz[lines.line[b]] - g.frequency_hz[lines.line[a]];
      if (distance > reach) break;
      const double alike = g.correlation.at(distance);
      const auto row = [&](std::size_t k) { return j.row(static_cast<Eigen::Index>(k)); };
      const Eigen::MatrixXd both = (row(a).adjoint() * row(b)).real();
      score += 2.0 * alike * (both + both.transpose());
    }
  // Lines that repeat one another know no more than as many that do not.
  Eigen::MatrixXd covariance = (inverse * score * inverse).topLeftCorner(parameters, parameters);
  for (Eigen::Index i = 0; i < parameters; ++i) covariance(i, i) = std::max(covariance(i, i), inverse(i, i));
  return covariance;
}

}  // namespace

LocalFit fit_local(const data::FrequencyResponse& g, const LocalLines& lines, std::vector<LocalRoot> roots,
                   int degree, const Eigen::VectorXcd& background) {
  LocalFit fit;
  const auto unknown = static_cast<double>(static_cast<std::size_t>(degree) + 1 + roots.size());
  fit.degrees = static_cast<double>(lines.line.size()) - unknown;
  if (fit.degrees < 2.0) return fit;
  const Problem problem(g, lines);
  State state{std::move(roots), {}};
  state.background = Eigen::VectorXcd::Zero(degree + 1);
  if (background.size() > 0)
    state.background.head(std::min(background.size(), state.background.size())) =
        background.head(std::min(background.size(), state.background.size()));
  else
    state.background = problem.start(state.roots, degree + 1);
  auto best = problem.at(state);
  if (!best.usable()) return fit;
  double damping = 1e-3;
  constexpr int kSteps = 30;
  constexpr double kConverged = 1e-5;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::VectorXd gradient = (best.jacobian.adjoint() * best.residual).real();
    Eigen::MatrixXd normal = (best.jacobian.adjoint() * best.jacobian).real();
    normal.diagonal() *= 1.0 + damping;
    normal.diagonal().array() += 1e-14 * normal.diagonal().maxCoeff();
    auto next = moved(state, linalg::RealLdlt(normal).solve(gradient), lines);
    auto there = problem.at(next);
    if (there.usable() && there.power < best.power) {
      const bool done = best.power - there.power < kConverged * (1.0 + 1e-2 * best.power);
      state = std::move(next);
      best = std::move(there);
      damping = std::max(0.1 * damping, 1e-9);
      if (done) break;
    } else {
      damping *= 10.0;
      if (damping > 1e5) break;
    }
  }
  fit.covariance = covariance_of(g, lines, best.jacobian, static_cast<Eigen::Index>(2 * state.roots.size()));
  fit.roots = std::move(state.roots);
  fit.background = std::move(state.background);
  fit.chi_square = best.power;
  fit.usable = fit.background.allFinite() && fit.covariance.allFinite();
  return fit;
}

double magnitude(const LocalFit& fit, const LocalLines& lines, double frequency_hz) {
  Complex value = std::exp(polynomial(fit.background, position(lines, frequency_hz))) / frequency_hz;
  for (const auto& root : lines.known) value *= factor(root, frequency_hz);
  for (const auto& root : fit.roots) value *= factor(root, frequency_hz);
  return std::abs(value);
}

}  // namespace resonid::fit
