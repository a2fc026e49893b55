// SPDX-License-Identifier: MIT
#include <array>
#include <fit/black_box/black_box_problem.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

/// Orders known at compile time keep the state in registers.
template <int kOrder>
void run_fixed(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, Eigen::VectorXd& state, const double* v,
               Eigen::Index count, double* columns, Eigen::Index stride) {
  using State = Eigen::Matrix<double, kOrder, 1>;
  const Eigen::Matrix<double, kOrder, kOrder> m = a;
  const State g = b;
  State s = state;
  for (Eigen::Index k = 0; k < count; ++k) {
    for (int i = 0; i < kOrder; ++i) columns[i * stride + k] = s(i);
    State next = m.col(0) * s(0);
    for (int j = 1; j < kOrder; ++j) next += m.col(j) * s(j);
    if (v != nullptr) next += g * v[k];
    s = next;
  }
  state = s;
}

template <int kOrder>
bool run_up_to(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, Eigen::VectorXd& state, const double* v,
               Eigen::Index count, double* columns, Eigen::Index stride) {
  if constexpr (kOrder > 0) {
    if (state.size() != kOrder) return run_up_to<kOrder - 1>(a, b, state, v, count, columns, stride);
    run_fixed<kOrder>(a, b, state, v, count, columns, stride);
    return true;
  }
  return false;
}

}  // namespace

Chain::Chain(const Realisation& r, const Eigen::VectorXd& start)
    : a_(r.transition), b_(r.input), state_(start), next_(start) {}

void Chain::run(const double* v, Eigen::Index count, double* columns, Eigen::Index stride) {
  constexpr int kMostFixed = 12;
  if (state_.size() == 0 || run_up_to<kMostFixed>(a_, b_, state_, v, count, columns, stride)) return;
  const auto n = state_.size();
  for (Eigen::Index k = 0; k < count; ++k) {
    for (Eigen::Index i = 0; i < n; ++i) columns[i * stride + k] = state_(i);
    next_.noalias() = a_ * state_;
    if (v != nullptr) next_ += b_ * v[k];
    state_.swap(next_);
  }
}

void Gram::add(Eigen::Index rows, Eigen::Index used) {
  const auto block = block_.topLeftCorner(rows, used);
  constexpr Eigen::Index kFew = 16;
  if (used > kFew) {
    sum_.topLeftCorner(used, used).selfadjointView<Eigen::Lower>().rankUpdate(block.transpose());
    return;
  }
  for (Eigen::Index j = 0; j < used; ++j)
    for (Eigen::Index i = j; i < used; ++i) sum_(i, j) += block.col(i).dot(block.col(j));
}

void Gram::add(Eigen::Index rows, Eigen::Index used, const std::vector<bool>& unused, Eigen::Index first) {
  if (unused.empty()) return add(rows, used);
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < rows; ++i) {
    if (unused[static_cast<std::size_t>(first + i)]) continue;
    if (kept != i) block_.row(kept).head(used) = block_.row(i).head(used);
    ++kept;
  }
  if (kept > 0) add(kept, used);
}

Eigen::MatrixXd Gram::matrix() const { return sum_.selfadjointView<Eigen::Lower>(); }

Eigen::MatrixXd Gram::matrix_with_last(Eigen::Index from) const {
  Eigen::VectorXi order(sum_.cols());
  for (Eigen::Index i = 0; i < order.size(); ++i) order(i) = static_cast<int>(i < from ? i : i + 1);
  order(order.size() - 1) = static_cast<int>(from);
  return matrix()(order, order);
}

Eigen::MatrixXd invert_normal(const Eigen::MatrixXd& normal, bool* full_rank) {
  const auto n = normal.rows();
  if (full_rank != nullptr) *full_rank = true;
  if (n == 0) return normal;
  Eigen::VectorXd scale = normal.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (double& s : scale) s = s > 0.0 ? 1.0 / s : 0.0;
  const auto eigen = linalg::symmetric_eigenpairs(scale.asDiagonal() * normal * scale.asDiagonal());
  Eigen::VectorXd inverse = eigen.values;
  constexpr double kSmallest = 1e-13;  // of the squared singular values
  for (double& v : inverse) {
    const bool kept = v > kSmallest * static_cast<double>(n);
    if (!kept && full_rank != nullptr) *full_rank = false;
    v = kept ? 1.0 / v : 0.0;
  }
  const Eigen::MatrixXd vectors = scale.asDiagonal() * eigen.vectors;
  return vectors * inverse.asDiagonal() * vectors.transpose();
}

Eigen::VectorXd solve_normal(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient) {
  if (normal.rows() == 0) return gradient;
  return invert_normal(normal) * gradient;
}

}  // namespace resonid::fit::detail
