// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/linear_system.hpp>
#include <resonid/fit/output_error.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

struct Candidate {
  int anti = 0, main = 0;
  data::TwoMassParameters parameters;
  double left = 0.0;
};

/// Two masses of inertia 1 in all.
data::TwoMassParameters of_modes(double antiresonance_hz, double resonance_hz, double damping_ratio) {
  const double ratio = std::pow(resonance_hz / antiresonance_hz, 2) - 1.0;  // J2/J1
  data::TwoMassParameters p;
  p.driven_inertia = 1.0 / (1.0 + ratio);
  p.load_inertia = 1.0 - p.driven_inertia;
  p.stiffness = std::pow(kTwoPi * antiresonance_hz, 2) * p.load_inertia;
  p.damping = 2.0 * damping_ratio / (kTwoPi * resonance_hz) * p.stiffness;
  return p;
}

/// Least squares of the output by what the input, a constant torque and a state at the start would give.
/// Scales the inertia by the input's weight; `left` is what remains.
class Judge {
 public:
  Judge(const data::Record& record, double known_delay_s)
      : record_(record),
        delay_(1 + static_cast<std::size_t>(std::lround(known_delay_s * record.sample_rate_hz))) {
    constexpr std::size_t kMost = 3000;
    end_ = std::min(record.samples(), kMost + delay_);
  }

  void judge(Candidate& c) const {
    constexpr int kColumns = 5;
    const auto drive = zero_order_hold(data::continuous_system(c.parameters), record_.sample_time_s());
    Eigen::Matrix<double, 3, kColumns> states = Eigen::Matrix<double, 3, kColumns>::Zero();
    states.rightCols<3>().setIdentity();
    Eigen::Matrix<double, kColumns + 1, kColumns + 1> normal;
    normal.setZero();
    Eigen::Matrix<double, kColumns + 1, 1> row;
    for (std::size_t k = delay_; k < end_; ++k) {
      states = (drive.a * states).eval();
      states.col(0) += drive.b * record_.input.samples[k - delay_];
      states.col(1) += drive.b;
      row.head<kColumns>() = states.row(0).transpose();
      row(kColumns) = record_.output.samples[k];
      normal.noalias() += row * row.transpose();
    }
    const Eigen::MatrixXd core = normal.topLeftCorner<kColumns, kColumns>();
    const Eigen::VectorXd right = normal.topRightCorner<kColumns, 1>();
    const Eigen::VectorXd size = core.diagonal().cwiseSqrt().cwiseMax(1e-300);
    const Eigen::MatrixXd scaled = size.cwiseInverse().asDiagonal() * core * size.cwiseInverse().asDiagonal();
    const Eigen::VectorXd goal = size.cwiseInverse().asDiagonal() * right;
    const Eigen::VectorXd weights = linalg::RealLdlt(scaled).solve(goal);
    const double total = normal(kColumns, kColumns);
    c.left = total - weights.dot(goal);
    const double inverse_inertia = weights(0) / size(0);
    if (!(inverse_inertia > 0.0) || !std::isfinite(c.left)) {
      c.left = std::numeric_limits<double>::infinity();
      return;
    }
    for (double* value : {&c.parameters.driven_inertia, &c.parameters.load_inertia, &c.parameters.stiffness,
                          &c.parameters.damping})
      *value /= inverse_inertia;
  }

 private:
  const data::Record& record_;
  std::size_t delay_, end_ = 0;
};

}  // namespace

std::vector<DriveModel> initial_models(const data::Record& record, double known_delay_s) {
  std::vector<DriveModel> starts;
  if (record.output_quantity != data::OutputQuantity::velocity || record.samples() < 50 ||
      record.input.samples.size() != record.samples() || !(known_delay_s >= 0.0) ||
      known_delay_s > 0.25 * record.duration_s())
    return starts;
  const Judge judge(record, known_delay_s);
  const double low_hz = std::max(1.0 / record.duration_s(), 1e-4 * record.sample_rate_hz);
  const double high_hz = 0.3 * record.sample_rate_hz;
  constexpr int kSteps = 32;
  const auto frequency = [&](int i) {
    return low_hz * std::pow(high_hz / low_hz, static_cast<double>(i) / kSteps);
  };
  std::vector<Candidate> best;  // per pair of frequencies
  for (int i = 0; i < kSteps; ++i)
    for (int j = i + 1; j <= kSteps; ++j) {
      Candidate pair{i, j, {}, std::numeric_limits<double>::infinity()};
      for (const double damping : {0.01, 0.04, 0.15}) {
        Candidate c{i, j, of_modes(frequency(i), frequency(j), damping), 0.0};
        judge.judge(c);
        if (c.left < pair.left) pair = c;
      }
      if (std::isfinite(pair.left)) best.push_back(pair);
    }
  std::sort(best.begin(), best.end(), [](const Candidate& a, const Candidate& b) { return a.left < b.left; });
  constexpr std::size_t kStarts = 3;
  std::vector<Candidate> chosen;
  for (const auto& c : best) {
    if (chosen.size() == kStarts) break;
    // Neighbours on the grid lead to the same fit.
    if (std::any_of(chosen.begin(), chosen.end(), [&](const Candidate& o) {
          return std::abs(o.anti - c.anti) <= 2 && std::abs(o.main - c.main) <= 2;
        }))
      continue;
    chosen.push_back(c);
    DriveModel model;
    model.sample_time_s = record.sample_time_s();
    model.parameters = c.parameters;
    starts.push_back(model);
  }
  return starts;
}

}  // namespace resonid::fit
