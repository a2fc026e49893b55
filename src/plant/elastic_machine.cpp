// SPDX-License-Identifier: MIT
#include "plant/elastic_machine.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "linalg/decompositions.hpp"

namespace resonid::plant {
namespace {

constexpr int kMostStates = 2 * static_cast<int>(kMaxMasses) + 1;
constexpr int kMostColumns = kMostStates + 1 + static_cast<int>(kMaxMasses);

/// Rows of the state out of [state; inputs], by columns.
using Rows = std::array<double, static_cast<std::size_t>(kMostStates* kMostColumns)>;

/// left right + [0 left's columns of the inputs]: the product of two steps, of which the inputs' own rows are
/// left out.
void multiply(const double* left, const double* right, int states, int columns, double* product) noexcept {
  for (int j = 0; j < columns; ++j) {
    double* to = product + j * states;
    const double* from = right + j * states;
    for (int i = 0; i < states; ++i) to[i] = j < states ? 0.0 : left[j * states + i];
    for (int k = 0; k < states; ++k)
      for (int i = 0; i < states; ++i) to[i] += left[k * states + i] * from[k];
  }
}

Eigen::MatrixXd step_of(const ContinuousDrive& drive, double duration_s) {
  Eigen::MatrixXd law(drive.a.rows(), drive.a.cols() + drive.b.cols());
  law << drive.a, drive.b;
  Eigen::MatrixXd step(law.rows(), law.cols());
  zoh_step(law.data(), static_cast<int>(law.rows()), static_cast<int>(drive.b.cols()), -1, -1, duration_s,
           step.data());
  return step;
}

}  // namespace

/// exp([law; 0]) by scaling and squaring of a Taylor series, as matrix_exponential().
void zoh_step(const double* law, int states, int inputs, int locked_first, int locked_second,
              double duration_s, double* step) noexcept {
  constexpr int kTerms = 14;  // 0.5^15/15! = 2e-17
  const int columns = states + inputs;
  const int size = states * columns;
  Rows scaled, other;
  std::array<double, kMostStates> row_sum{};
  for (int j = 0; j < columns; ++j)
    for (int i = 0; i < states; ++i) {
      const double entry = i == locked_first || i == locked_second ? 0.0 : duration_s * law[j * states + i];
      scaled[static_cast<std::size_t>(j * states + i)] = entry;
      row_sum[static_cast<std::size_t>(i)] += std::abs(entry);
    }
  const double norm = *std::max_element(row_sum.begin(), row_sum.end());
  int squarings = 0;
  double scale = 1.0;
  while (norm * scale > 0.5 && squarings < 60) {
    scale *= 0.5;
    ++squarings;
  }
  for (int i = 0; i < size; ++i) scaled[static_cast<std::size_t>(i)] *= scale;
  const auto identity = [&](double* m) {
    for (int i = 0; i < states; ++i) m[i * states + i] += 1.0;
  };
  std::fill(step, step + size, 0.0);
  identity(step);
  for (int k = kTerms; k >= 1; --k) {  // Horner: I + A/1 (I + A/2 (I + ...))
    multiply(scaled.data(), step, states, columns, other.data());
    for (int i = 0; i < size; ++i) step[i] = other[static_cast<std::size_t>(i)] * (1.0 / k);
    identity(step);
  }
  for (int k = 0; k < squarings; ++k) {
    multiply(step, step, states, columns, other.data());
    std::copy(other.begin(), other.begin() + size, step);
  }
}

ElasticMachine::ElasticMachine(Machine of, bool lags, double sample_time_s)
    : machine(std::move(of)), lags_(lags), sample_time_s_(sample_time_s) {
  scale_ = continuous(machine.highest_factor()).angle_scale;
  const MassSystem system = machine.system(1.0);
  if (!system.couplings.empty()) first_stiffness_ = system.couplings.front().stiffness;
}

ContinuousDrive ElasticMachine::continuous(double factor) const {
  return continuous_drive(machine.system(factor), lags_ ? machine.config().torque_lag_s : 0.0, scale_);
}

Eigen::MatrixXd ElasticMachine::Law::at(double factor) const {
  return fixed + factor * by_factor + std::sqrt(factor) * by_root;
}

/// From three factors, exactly: all of them and their roots are powers of 2.
ElasticMachine::Law ElasticMachine::law() const {
  const auto at = [&](double factor) {
    const ContinuousDrive drive = continuous(factor);
    Eigen::MatrixXd law(drive.a.rows(), drive.a.cols() + drive.b.cols());
    law << drive.a, drive.b;
    return law;
  };
  const Eigen::MatrixXd one = at(1.0), four = at(4.0), sixteen = at(16.0);
  Law law;  // four - one = 3 by_factor + by_root, sixteen - four = 12 by_factor + 2 by_root
  law.by_factor = (sixteen - four - 2.0 * (four - one)) / 6.0;
  law.by_root = four - one - 3.0 * law.by_factor;
  law.fixed = one - law.by_factor - law.by_root;
  return law;
}

Eigen::MatrixXd ElasticMachine::open_law() const {
  MassSystem open = machine.system(1.0);
  for (Coupling& c : open.couplings) c.stiffness = c.damping = 0.0;
  const ContinuousDrive drive = continuous_drive(open, lags_ ? machine.config().torque_lag_s : 0.0, scale_);
  Eigen::MatrixXd law(drive.a.rows(), drive.a.cols() + drive.b.cols());
  law << drive.a, drive.b;
  return law;
}

unsigned ElasticMachine::pieces(double duration_s, bool dry) const {
  unsigned pieces = 1;
  if (!dry) return pieces;
  const auto modes = resonances(machine.system(machine.highest_factor()));
  if (modes.empty()) return pieces;
  while (pieces < 64 && 16.0 * modes.back().frequency_hz * duration_s > pieces) pieces *= 2;
  return pieces;
}

Eigen::VectorXd ElasticMachine::balance(double factor, double velocity, double angle,
                                        const Eigen::VectorXd& torques) const {
  const ContinuousDrive drive = continuous(factor);
  const auto masses = static_cast<Eigen::Index>(machine.masses());
  const Eigen::Index states = drive.a.rows();
  Eigen::VectorXd state = Eigen::VectorXd::Zero(states + 1);
  state.head(masses).setConstant(velocity);
  // Torques balance on every mass: the twists and the holding torque are unknown.
  const Eigen::VectorXd known = drive.a.topLeftCorner(masses, masses) * state.head(masses) +
                                drive.b.topRightCorner(masses, masses) * torques +
                                drive.a.col(states - 1).head(masses) * angle;
  Eigen::MatrixXd unknown(masses, masses);
  unknown.leftCols(masses - 1) = drive.a.block(0, masses, masses, masses - 1);
  unknown.col(masses - 1) = lags_ ? drive.a.col(states - 2).head(masses) : drive.b.col(0).head(masses);
  const Eigen::VectorXd solution = linalg::RealLu(unknown).solve(-known);
  state.segment(masses, masses - 1) = solution.head(masses - 1);
  if (lags_) state(states - 2) = solution(masses - 1);
  state(states - 1) = angle;
  state(states) = solution(masses - 1);
  return state;
}

SampledDrive ElasticMachine::sampled(double factor, double early_s) const {
  const ContinuousDrive drive = continuous(factor);
  const Eigen::MatrixXd whole = step_of(drive, sample_time_s_);
  const Eigen::MatrixXd early = step_of(drive, early_s);
  const Eigen::Index states = drive.a.rows();
  SampledDrive sampled;
  sampled.a = whole.leftCols(states);
  sampled.b = whole.col(states);
  sampled.velocity = Eigen::RowVectorXd::Unit(states, 0);
  sampled.early_velocity = early.row(0).head(states);
  sampled.early_angle = early.row(states - 1).head(states);
  sampled.early_velocity_command = early(0, states);
  sampled.early_angle_command = early(states - 1, states);
  sampled.sample_time_s = sample_time_s_;
  sampled.grounded = machine.grounded();
  return sampled;
}

}  // namespace resonid::plant
