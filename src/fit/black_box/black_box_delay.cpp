// SPDX-License-Identifier: MIT
#include <cmath>
#include <fit/black_box/realisation.hpp>
#include <resonid/fit/black_box.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

using Complex = std::complex<double>;

/// h + sum residue/(z - pole) without the whole delay.
struct PartialFractions {
  Eigen::VectorXcd poles, residues;
  double direct = 0.0;
};

PartialFractions partial_fractions(const BlackBoxRealisation& r) {
  const auto n = r.output.size(), m = r.taps.size();
  const auto all = n + (r.integrator ? 1 : 0);
  PartialFractions f{Eigen::VectorXcd::Ones(all), Eigen::VectorXcd::Zero(all), 0.0};
  if (m > (r.integrator ? 1 : 0)) f.direct = r.taps(0);
  Complex at_one = r.taps.sum();
  if (n > 0) {
    const auto [values, right] = linalg::eigenpairs(r.transition);
    const Eigen::VectorXcd through = linalg::ComplexLu(right).solve(r.input.cast<Complex>());
    f.poles.head(n) = values;
    f.residues.head(n) = (right.transpose() * r.output.cast<Complex>()).cwiseProduct(through);
    if (r.integrator) {
      at_one += r.output.cast<Complex>().dot(detail::basis({r.transition, r.input}, 1.0));
      for (Eigen::Index i = 0; i < n; ++i) f.residues(i) *= (m == 1 ? f.poles(i) : 1.0) / (f.poles(i) - 1.0);
    }
  }
  if (r.integrator) f.residues(n) = at_one;
  return f;
}

/// Time after a sample at which the output is taken, in samples: where the direct term is that of a hold.
std::optional<double> sampled_at(const PartialFractions& f) {
  for (const Complex& p : f.poles)
    if (std::abs(p) == 0.0 || (p.imag() == 0.0 && p.real() < 0.0)) return std::nullopt;
  const auto left = [&](double m) {
    Complex sum = -f.direct;
    for (Eigen::Index i = 0; i < f.poles.size(); ++i) {
      const Complex p = f.poles(i), away = p - 1.0;
      constexpr double kIntegrator = 1e-9;
      sum += f.residues(i) * (std::abs(away) < kIntegrator ? Complex(m) : (1.0 - std::pow(p, -m)) / away);
    }
    return sum.real();
  };
  // The solution nearest to the middle of the sample, where several modes make more than one.
  constexpr double kFrom = -1.0, kTo = 2.0;
  constexpr int kCells = 150;
  std::optional<double> found;
  const auto cell = [&](int i) { return kFrom + (kTo - kFrom) * i / kCells; };
  for (int i = 0; i < kCells; ++i) {
    double low = cell(i), high = cell(i + 1);
    const double at_low = left(low);
    if (!(at_low * left(high) <= 0.0)) continue;
    for (int halving = 0; halving < 50; ++halving) {
      const double middle = 0.5 * (low + high);
      (left(middle) * at_low > 0.0 ? low : high) = middle;
    }
    if (!found || std::abs(low - 0.5) < std::abs(*found - 0.5)) found = low;
  }
  return found;
}

}  // namespace

std::optional<data::Estimate> BlackBoxModel::delay() const {
  const double ts = transfer_function.sample_time_s, whole = static_cast<double>(delay_samples);
  const bool direct = realisation.taps.size() > (realisation.integrator ? 1 : 0);
  if (!direct || delay_samples == 0) return data::Estimate{whole * ts, 0.0};
  const auto at = sampled_at(partial_fractions(realisation));
  if (!at) return std::nullopt;
  const double deviation = standard_deviation_of(
      [&](const BlackBoxModel& m) { return sampled_at(partial_fractions(m.realisation)).value_or(*at); });
  return data::Estimate{(whole - *at) * ts, deviation * ts};
}

BlackBoxModel BlackBoxModel::moved(const Eigen::VectorXd& step) const {
  BlackBoxModel result = *this;
  auto& r = result.realisation;
  const auto n = r.output.size(), m = r.taps.size();
  const Eigen::VectorXd alpha = step.head(n);
  r.output += step.segment(n, n);
  r.taps += step.tail(m);
  r.transition -= r.input * alpha.transpose();
  // h/(1 + alpha F) = h - h alpha F_new; z F_new = transition F_new + input for the tap ahead of the others
  if (m == 1) r.output -= r.taps(0) * alpha;
  if (m == 2) {
    r.output -= r.taps(1) * alpha + r.taps(0) * (r.transition.transpose() * alpha);
    r.taps(1) -= r.taps(0) * alpha.dot(r.input);
  }
  return result;
}

double BlackBoxModel::standard_deviation_of(
    const std::function<double(const BlackBoxModel&)>& function) const {
  const auto& c = realisation.covariance;
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(c.rows());
  for (Eigen::Index i = 0; i < c.rows(); ++i) {
    constexpr double kSmall = 0.01;  // of the standard deviation
    const double by = kSmall * std::sqrt(std::max(0.0, c(i, i)));
    if (!(by > 0.0)) continue;
    const Eigen::VectorXd step = by * Eigen::VectorXd::Unit(c.rows(), i);
    gradient(i) = (function(moved(step)) - function(moved(-step))) / (2.0 * by);
  }
  return std::sqrt(std::max(0.0, gradient.dot(c * gradient)));
}

}  // namespace resonid::fit
