// SPDX-License-Identifier: MIT
#include <cmath>
#include <resonid/fit/detail/identified_controller.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

constexpr int kHighestOrder = 4;
constexpr Eigen::Index kMostRows = 20000;

/// u(k) - ru(k) from its own past and the error's; the residual's rms relative to that of what is explained.
struct Explained {
  data::TransferFunction controller;
  double left = 1.0;
};

Explained explained(const Eigen::VectorXd& answer, const Eigen::VectorXd& error, int order,
                    double sample_time_s) {
  const Eigen::Index rows = answer.size() - order;
  Eigen::MatrixXd columns(rows, 2 * order + 2);
  for (int i = 1; i <= order; ++i) columns.col(i - 1) = -answer.segment(order - i, rows);
  for (int i = 0; i <= order; ++i) columns.col(order + i) = error.segment(order - i, rows);
  columns.col(2 * order + 1).setOnes();
  const Eigen::VectorXd scale = columns.colwise().norm().transpose().cwiseMax(1e-300);
  columns *= scale.cwiseInverse().asDiagonal();
  const Eigen::VectorXd target = answer.tail(rows);
  const Eigen::VectorXd scaled = linalg::PivotedQr(columns).solve(target);
  const Eigen::VectorXd x = scale.cwiseInverse().asDiagonal() * scaled;
  Explained e;
  e.left = (target - columns * scaled).norm() / std::max(target.norm(), 1e-300);
  e.controller.sample_time_s = sample_time_s;
  e.controller.denominator = {1.0};
  for (int i = 0; i < order; ++i) e.controller.denominator.push_back(x(i));
  for (int i = 0; i <= order; ++i) e.controller.numerator.push_back(x(order + i));
  return e;
}

}  // namespace

std::optional<data::TransferFunction> identified_controller(const data::Record& record) {
  const std::size_t samples = record.samples();
  if (samples < 100 || record.excitation.samples.size() != samples || record.input.samples.size() != samples)
    return std::nullopt;
  const bool led = record.reference.samples.size() == samples;
  const auto n = std::min<Eigen::Index>(static_cast<Eigen::Index>(samples), kMostRows);
  Eigen::VectorXd answer(n), error(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    answer(k) = record.input.samples[i] - record.excitation.samples[i];
    error(k) = (led ? record.reference.samples[i] : 0.0) - record.output.samples[i];
  }
  if (!answer.allFinite() || !error.allFinite()) return std::nullopt;
  const double input = Eigen::Map<const Eigen::VectorXd>(record.input.samples.data(), n).norm();
  constexpr double kSilent = 1e-6;  // no feedback at all
  if (answer.norm() < kSilent * input) return std::nullopt;
  // Smooth signals foretell themselves to a thousandth: only what rounding leaves counts.
  constexpr double kExact = 1e-5;
  for (int order = 1; order <= kHighestOrder; ++order) {
    auto found = explained(answer, error, order, record.sample_time_s());
    if (found.left < kExact) return std::move(found.controller);
  }
  return std::nullopt;
}

}  // namespace resonid::fit
