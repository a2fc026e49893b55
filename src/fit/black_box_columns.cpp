// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>
#include <array>
#include <fit/black_box_problem.hpp>

namespace resonid::fit::detail {
namespace {

/// Orders known at compile time keep the state in registers.
template <int kOrder>
void run_small(const double* a, const double* b, double* state, const double* v, Eigen::Index count,
               double* columns, Eigen::Index stride) {
  std::array<double, kOrder * kOrder> m{};
  std::array<double, kOrder> g{}, s{};
  std::copy_n(a, kOrder * kOrder, m.begin());
  std::copy_n(b, kOrder, g.begin());
  std::copy_n(state, kOrder, s.begin());
  for (Eigen::Index k = 0; k < count; ++k) {
    const double in = v == nullptr ? 0.0 : v[k];
    std::array<double, kOrder> next;
    for (std::size_t i = 0; i < kOrder; ++i) {
      columns[static_cast<Eigen::Index>(i) * stride + k] = s[i];
      double sum = g[i] * in;
      for (std::size_t j = 0; j < kOrder; ++j) sum += m[i * kOrder + j] * s[j];
      next[i] = sum;
    }
    s = next;
  }
  std::copy_n(s.begin(), kOrder, state);
}

}  // namespace

Chain::Chain(const Realisation& r, const Eigen::VectorXd& start)
    : a_(r.transition), b_(r.input), state_(start), next_(start) {}

void Chain::run(const double* v, Eigen::Index count, double* columns, Eigen::Index stride) {
  switch (state_.size()) {
    case 0:
      return;
    case 1:
      return run_small<1>(a_.data(), b_.data(), state_.data(), v, count, columns, stride);
    case 2:
      return run_small<2>(a_.data(), b_.data(), state_.data(), v, count, columns, stride);
    case 3:
      return run_small<3>(a_.data(), b_.data(), state_.data(), v, count, columns, stride);
    case 4:
      return run_small<4>(a_.data(), b_.data(), state_.data(), v, count, columns, stride);
    case 5:
      return run_small<5>(a_.data(), b_.data(), state_.data(), v, count, columns, stride);
    case 6:
      return run_small<6>(a_.data(), b_.data(), state_.data(), v, count, columns, stride);
    default:
      break;
  }
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
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * normal *
                                                             scale.asDiagonal());
  Eigen::VectorXd inverse = eigen.eigenvalues();
  constexpr double kSmallest = 1e-13;  // of the squared singular values
  for (double& v : inverse) {
    const bool kept = v > kSmallest * static_cast<double>(n);
    if (!kept && full_rank != nullptr) *full_rank = false;
    v = kept ? 1.0 / v : 0.0;
  }
  const Eigen::MatrixXd vectors = scale.asDiagonal() * eigen.eigenvectors();
  return vectors * inverse.asDiagonal() * vectors.transpose();
}

Eigen::VectorXd solve_normal(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient) {
  if (normal.rows() == 0) return gradient;
  return invert_normal(normal) * gradient;
}

}  // namespace resonid::fit::detail
