// SPDX-License-Identifier: MIT
#include <cmath>
#include <data/pole_at_one.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/data/transfer_function.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::data {
std::complex<double> TransferFunction::response(double frequency_hz) const {
  const auto inverse_z = std::polar(1.0, -kTwoPi * frequency_hz * sample_time_s);
  return polynomial(numerator, inverse_z) / polynomial(denominator, inverse_z);
}

std::vector<double> TransferFunction::simulate(std::span<const double> input) const {
  std::vector<double> output(input.size());
  for (std::size_t k = 0; k < input.size(); ++k) {
    double sum = 0.0;
    for (std::size_t i = 0; i < numerator.size() && i <= k; ++i) sum += numerator[i] * input[k - i];
    for (std::size_t i = 1; i < denominator.size() && i <= k; ++i) sum -= denominator[i] * output[k - i];
    output[k] = sum / denominator[0];
  }
  return output;
}

std::vector<std::complex<double>> TransferFunction::poles() const {
  // Integrators first: a double one would else be known to the root of the rounding only.
  std::vector<std::complex<double>> found;
  auto rest = denominator;
  for (; rest.size() > 1 && vanishes_at_one(rest); divide_by_integrator(rest)) found.emplace_back(1.0);
  const auto order = static_cast<Eigen::Index>(rest.size()) - 1;
  if (order < 1) return found;
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(order, order);
  for (Eigen::Index i = 0; i < order; ++i) companion(0, i) = -rest[static_cast<std::size_t>(i) + 1] / rest[0];
  for (Eigen::Index i = 1; i < order; ++i) companion(i, i - 1) = 1.0;
  const Eigen::VectorXcd values = linalg::eigenvalues(companion);
  found.insert(found.end(), values.begin(), values.end());
  return found;
}

TransferFunction pi_controller(double gain, double integral_time_s, double sample_time_s) {
  return {{gain * (1.0 + sample_time_s / integral_time_s), -gain}, {1.0, -1.0}, sample_time_s};
}

}  // namespace resonid::data
