// SPDX-License-Identifier: MIT
#include "design/controller.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "design/polynomial.hpp"
#include "design/rational_response.hpp"
#include "linalg/decompositions.hpp"

namespace resonid::design {
namespace {

LinearController::Response response_of(const ControllerStates& s, double sample_time_s) {
  return [s, sample_time_s](std::span<const double> frequencies_hz) {
    std::vector<std::complex<double>> values;
    values.reserve(frequencies_hz.size());
    for (const double f : frequencies_hz) {
      Eigen::MatrixXcd m = -s.a;
      m.diagonal().array() += std::polar(1.0, kTwoPi * f * sample_time_s);
      const Eigen::VectorXcd state = linalg::ComplexLu(m).solve(s.b.cast<std::complex<double>>());
      values.push_back((s.c * state).value() + s.d);
    }
    return values;
  };
}

}  // namespace

Biquad::Coefficients Biquad::coefficients(double sample_time_s) const {
  const double omega = kTwoPi * frequency_hz;
  const double warped = omega / std::tan(0.5 * omega * sample_time_s);
  const double square = warped * warped + omega * omega;
  const double upper = 2.0 * numerator_damping * omega * warped;
  const double lower = 2.0 * denominator_damping * omega * warped;
  const double middle = 2.0 * (omega * omega - warped * warped), first = square + lower;
  return {{(square + upper) / first, middle / first, (square - upper) / first},
          {1.0, middle / first, (square - lower) / first}};
}

data::TransferFunction FilteredPi::transfer_function(double sample_time_s) const {
  data::TransferFunction c{{kp + ki * sample_time_s, -kp}, {1.0, -1.0}, sample_time_s};
  // A P has no integrator: its pole at 1, which nothing moves, would make every loop look unstable.
  if (ki == 0.0) c = {{kp}, {1.0}, sample_time_s};
  for (const Biquad& biquad : biquads) {
    const auto filter = biquad.coefficients(sample_time_s);
    c.numerator = polynomial_product(c.numerator, filter.b);
    c.denominator = polynomial_product(c.denominator, filter.a);
  }
  return c;
}

ControllerStates in_series(const ControllerStates& first, const ControllerStates& second) {
  const Eigen::Index n = first.a.rows(), m = second.a.rows();
  ControllerStates s{Eigen::MatrixXd::Zero(n + m, n + m), Eigen::VectorXd(n + m), Eigen::RowVectorXd(n + m),
                     first.d * second.d};
  s.a.topLeftCorner(n, n) = first.a;
  s.a.bottomLeftCorner(m, n) = second.b * first.c;
  s.a.bottomRightCorner(m, m) = second.a;
  s.b << first.b, second.b * first.d;
  s.c << second.d * first.c, second.c;
  return s;
}

std::vector<std::complex<double>> filter_values(std::span<const Biquad> biquads,
                                                std::span<const double> frequencies_hz,
                                                double sample_time_s) {
  std::vector<std::complex<double>> values(frequencies_hz.size(), 1.0);
  for (const Biquad& biquad : biquads) {
    const auto filter = biquad.coefficients(sample_time_s);
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] =
          plain_product(values[i], filter.at(std::polar(1.0, -kTwoPi * frequencies_hz[i] * sample_time_s)));
  }
  return values;
}

ControllerStates states_of(const data::TransferFunction& controller) {
  const std::size_t terms = std::max(controller.numerator.size(), controller.denominator.size());
  const auto order = static_cast<Eigen::Index>(terms) - 1;
  const auto term = [](const std::vector<double>& p, Eigen::Index i) {
    return static_cast<std::size_t>(i) < p.size() ? p[static_cast<std::size_t>(i)] : 0.0;
  };
  ControllerStates s{Eigen::MatrixXd::Zero(order, order), Eigen::VectorXd(order),
                     Eigen::RowVectorXd::Zero(order), term(controller.numerator, 0)};
  for (Eigen::Index i = 0; i < order; ++i) {  // transposed direct form II
    s.a(i, 0) = -term(controller.denominator, i + 1);
    if (i + 1 < order) s.a(i, i + 1) = 1.0;
    s.b(i) = term(controller.numerator, i + 1) - term(controller.denominator, i + 1) * s.d;
  }
  if (order > 0) s.c(0) = 1.0;
  return s;
}

ControllerStates states_of(const FilteredPi& controller, double sample_time_s) {
  auto s = states_of(FilteredPi{controller.kp, controller.ki, {}}.transfer_function(sample_time_s));
  for (const Biquad& biquad : controller.biquads) {
    const auto filter = biquad.coefficients(sample_time_s);
    s = in_series(
        s, states_of(data::TransferFunction{
               {filter.b.begin(), filter.b.end()}, {filter.a.begin(), filter.a.end()}, sample_time_s}));
  }
  return s;
}

namespace {

/// Ts z/(z - 1)
std::complex<double> integrator_of(const std::complex<double>& inverse_z, double sample_time_s) {
  const std::complex<double> difference = 1.0 - inverse_z;
  return sample_time_s / square_of(difference) * std::conj(difference);
}

}  // namespace

std::complex<double> integrator_at(double frequency_hz, double sample_time_s) {
  return integrator_of(std::polar(1.0, -kTwoPi * frequency_hz * sample_time_s), sample_time_s);
}

LinearController::LinearController(const FilteredPi& controller, double sample_time_s)
    : states_(design::states_of(controller, sample_time_s)) {
  std::vector<Biquad::Coefficients> filters;
  for (const Biquad& biquad : controller.biquads) filters.push_back(biquad.coefficients(sample_time_s));
  response_ = [kp = controller.kp, ki = controller.ki, filters = std::move(filters),
               sample_time_s](std::span<const double> frequencies_hz) {
    std::vector<std::complex<double>> values;
    values.reserve(frequencies_hz.size());
    for (const double f : frequencies_hz) {
      const auto inverse_z = std::polar(1.0, -kTwoPi * f * sample_time_s);
      std::complex<double> c = kp + ki * integrator_of(inverse_z, sample_time_s);
      for (const auto& filter : filters) c = plain_product(c, filter.at(inverse_z));
      values.push_back(c);
    }
    return values;
  };
}

LinearController::LinearController(const data::TransferFunction& controller)
    : LinearController(design::states_of(controller), [controller](std::span<const double> frequencies_hz) {
        std::vector<std::complex<double>> values;
        values.reserve(frequencies_hz.size());
        for (const double f : frequencies_hz) {
          const auto inverse_z = std::polar(1.0, -kTwoPi * f * controller.sample_time_s);
          values.push_back(polynomial_at(controller.numerator, inverse_z) /
                           polynomial_at(controller.denominator, inverse_z));
        }
        return values;
      }) {}

LinearController::LinearController(ControllerStates states, double sample_time_s)
    : states_(std::move(states)), response_(response_of(states_, sample_time_s)) {}

}  // namespace resonid::design
