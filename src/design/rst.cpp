// SPDX-License-Identifier: MIT
#include "design/rst.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <resonid/base/constants.hpp>
#include <utility>

#include "design/machine.hpp"
#include "design/polynomial.hpp"
#include "design/structure_search.hpp"
#include "linalg/decompositions.hpp"

namespace resonid::design {
namespace {

double largest_of(const std::vector<double>& p) {
  double most = 0.0;
  for (const double x : p) most = std::max(most, std::abs(x));
  return most;
}

double norm_2(const Eigen::MatrixXd& m) {
  return std::sqrt(linalg::symmetric_eigenpairs(m.transpose() * m).values.tail(1).value());
}

/// Columns: `p` times every power of z^-1 below `count`.
void put_shifted(const std::vector<double>& p, Eigen::Index count, Eigen::Index first, Eigen::MatrixXd& m) {
  for (Eigen::Index j = 0; j < count; ++j)
    for (std::size_t i = 0; i < p.size(); ++i) m(j + static_cast<Eigen::Index>(i), first + j) = p[i];
}

/// (1 - z1/z)(1 - z2/z) of a pair by frequency and damping; real poles where it is overdamped.
std::vector<double> pole_pair(double frequency_hz, double damping, double sample_time_s) {
  const double omega = kTwoPi * frequency_hz * sample_time_s;
  const auto root = std::sqrt(std::complex<double>(damping * damping - 1.0));
  const auto z1 = std::exp(-omega * (damping - root)), z2 = std::exp(-omega * (damping + root));
  return {1.0, -(z1 + z2).real(), (z1 * z2).real()};
}

}  // namespace

data::TransferFunction sampled_plant(const fit::DriveModel& model) {
  const auto states = fit::sampled_states(model);
  auto a = model.transfer_function().denominator;
  for (double& x : a) x /= a.front() == 0.0 ? 1.0 : a.front();
  if (model.output_filter_s > 0.0)
    a = polynomial_product(a, std::array{1.0, -std::exp(-model.sample_time_s / model.output_filter_s)});
  // B = A times the impulse response, which ends where the delay is over.
  const auto terms = static_cast<std::size_t>(states.a.rows()) + a.size();
  std::vector<double> impulse(terms, 0.0), b(terms, 0.0);
  Eigen::VectorXd x = states.command;
  for (std::size_t k = 1; k < terms; ++k) {
    impulse[k] = states.measured * x;
    x = (states.a * x).eval();
  }
  for (std::size_t k = 0; k < terms; ++k)
    for (std::size_t i = 0; i < std::min(a.size(), k + 1); ++i) b[k] += a[i] * impulse[k - i];
  constexpr double kRounding = 1e-11;
  const double least = kRounding * std::max(largest_of(b), largest_of(impulse));
  while (b.size() > 1 && std::abs(b.back()) < least) b.pop_back();
  for (double& term : b)
    if (std::abs(term) < least) term = 0.0;
  return {b, a, model.sample_time_s};
}

double Rst::t() const { return std::accumulate(r.begin(), r.end(), 0.0); }

namespace {

struct Placed {
  std::optional<Rst> rst;  ///< Without the condition, which is as much work as the rest.
  Eigen::MatrixXd system;
};

Placed placed(const data::TransferFunction& plant, const std::vector<double>& poles,
              const FixedParts& fixed) {
  const auto as = polynomial_product(plant.denominator, fixed.s),
             br = polynomial_product(plant.numerator, fixed.r);
  const auto s_terms = static_cast<Eigen::Index>(br.size()) - 1,
             r_terms = static_cast<Eigen::Index>(as.size()) - 1;
  const Eigen::Index size = s_terms + r_terms;
  if (static_cast<Eigen::Index>(poles.size()) > size) return {};
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(size, size);
  put_shifted(as, s_terms, 0, system);
  put_shifted(br, r_terms, s_terms, system);
  Eigen::VectorXd p = Eigen::VectorXd::Zero(size);
  std::copy(poles.begin(), poles.end(), p.begin());

  // B is as small as a torque's effect within a sample: both blocks are brought to one size.
  const double scale = largest_of(as) / largest_of(br);
  Eigen::MatrixXd scaled = system;
  scaled.rightCols(r_terms) *= scale;
  const linalg::RealLu lu(scaled);
  Eigen::VectorXd solution = lu.solve(p);
  for (int i = 0; i < 2; ++i) solution += lu.solve((p - scaled * solution).eval());

  Rst rst;
  constexpr double kHolds = 1e-6;
  rst.residual = (p - scaled * solution).cwiseAbs().maxCoeff() / p.cwiseAbs().maxCoeff();
  if (!(rst.residual < kHolds)) return {};
  const std::vector<double> s(solution.begin(), solution.begin() + s_terms);
  std::vector<double> r(solution.begin() + s_terms, solution.end());
  for (double& x : r) x *= scale;
  rst.s = polynomial_product(s, fixed.s);
  rst.r = polynomial_product(r, fixed.r);
  return {std::move(rst), std::move(system)};
}

}  // namespace

std::optional<Rst> place_poles(const data::TransferFunction& plant, const std::vector<double>& poles,
                               const FixedParts& fixed) {
  auto found = placed(plant, poles, fixed);
  if (found.rst) found.rst->condition = norm_2(found.system) * norm_2(linalg::inverse(found.system));
  return std::move(found.rst);
}

std::vector<double> PolePlan::polynomial(const fit::DriveModel& model, std::size_t degree) const {
  const double step = model.sample_time_s;
  auto p = pole_pair(frequency_hz, damping, step);
  const auto modes = model.modes();  // each resonance follows its anti-resonance
  for (std::size_t i = 1; i < modes.size() && p.size() + 2 <= degree + 1; i += 2)
    p = polynomial_product(
        p, pole_pair(resonance_factor * modes[i].frequency_hz.value, resonance_damping, step));
  const double pole = std::exp(-kTwoPi * real_hz * step);
  for (int i = 0; i < 4 && p.size() < degree + 1; ++i) p = polynomial_product(p, std::array{1.0, -pole});
  return p;
}

std::optional<RstDesign> search_rst(Machines& machines, const Bounds& bounds, const FixedParts& fixed,
                                    const GlobalSearch::Effort& effort, const GlobalSearch::Point& from) {
  const fit::DriveModel& model = machines.all.front().model();
  const auto plant = sampled_plant(model);
  const std::size_t degree =
      plant.denominator.size() + fixed.s.size() + plant.numerator.size() + fixed.r.size() - 5;
  const double nyquist_hz = 0.5 / model.sample_time_s;
  const auto modes = model.modes();
  const double typical_hz = modes.empty() ? 0.1 * nyquist_hz : modes.front().frequency_hz.value;
  const auto plan_of = [](const GlobalSearch::Point& x) {
    return PolePlan{std::exp(x[0]), std::exp(x[1]), std::exp(x[2]), std::exp(x[3]), std::exp(x[4])};
  };
  const auto place = [&](const GlobalSearch::Point& x) {
    return placed(plant, plan_of(x).polynomial(model, degree), fixed).rst;
  };
  const MakeController make = [&](const GlobalSearch::Point& x) -> std::optional<LinearController> {
    const auto rst = place(x);
    if (!rst) return std::nullopt;
    return LinearController(rst->controller(model.sample_time_s));
  };
  const auto range = [](double low, double high) {
    return GlobalSearch::Range{std::log(low), std::log(high)};
  };
  const auto found =
      search_structure(machines, bounds, make,
                       {range(0.05 * typical_hz, std::min(2.0 * typical_hz, nyquist_hz)), range(0.3, 2.0),
                        range(0.5, 1.6), range(0.1, 1.2), range(0.2 * typical_hz, 4.0 * nyquist_hz)},
                       effort, {}, from);
  if (!found) return std::nullopt;
  const auto plan = plan_of(found->point);
  const auto rst = place_poles(plant, plan.polynomial(model, degree), fixed);
  return RstDesign{plan, *rst, found->iae, found->exceeded, found->point};
}

}  // namespace resonid::design
