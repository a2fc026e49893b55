// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/QR>
#include <complex>

// Decompositions of dense matrices, compiled once: each of Eigen's costs seconds in every source that names
// it. What stands here is what Eigen's own class gives, to the last bit.

namespace resonid::linalg {

/// A decomposition that solves. `solve` takes one right side or a matrix of them, as any expression.
template <class Decomposition>
class Solver {
 public:
  using Matrix = typename Decomposition::MatrixType;
  using Scalar = typename Matrix::Scalar;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

  explicit Solver(const Eigen::Ref<const Matrix>& m);

  template <class Right>
  [[nodiscard]] auto solve(const Eigen::MatrixBase<Right>& right) const {
    if constexpr (Right::ColsAtCompileTime == 1)
      return solve_vector(right);
    else
      return solve_matrix(right);
  }

 protected:
  [[nodiscard]] Vector solve_vector(const Eigen::Ref<const Vector>& right) const;
  [[nodiscard]] Matrix solve_matrix(const Eigen::Ref<const Matrix>& right) const;
  Decomposition of_;
};

/// L D L^H of a Hermitian matrix, of which the lower triangle is read.
template <class Matrix>
class Ldlt : public Solver<Eigen::LDLT<Matrix>> {
 public:
  using Solver<Eigen::LDLT<Matrix>>::Solver;
  [[nodiscard]] bool succeeded() const { return this->of_.info() == Eigen::Success; }
  [[nodiscard]] Eigen::VectorXd d() const { return this->of_.vectorD().real(); }
  [[nodiscard]] double rcond() const;
};

/// L L^T of a positive definite matrix, of which the lower triangle is read.
class Llt : public Solver<Eigen::LLT<Eigen::MatrixXd>> {
 public:
  using Solver::Solver;
  [[nodiscard]] bool succeeded() const { return of_.info() == Eigen::Success; }  ///< Positive definite.
  [[nodiscard]] Eigen::MatrixXd lower() const;
};

/// P L U of a square matrix.
template <class Matrix>
class Lu : public Solver<Eigen::PartialPivLU<Matrix>> {
 public:
  using Solver<Eigen::PartialPivLU<Matrix>>::Solver;
  [[nodiscard]] double rcond() const;
  [[nodiscard]] Matrix inverse() const;
};

/// Q R by Householder's reflections, without pivots: for columns that are known to be independent.
class Qr : public Solver<Eigen::HouseholderQR<Eigen::MatrixXd>> {
 public:
  using Solver::Solver;
  [[nodiscard]] Eigen::MatrixXd thin_q() const;  ///< As many columns as the matrix has.
  [[nodiscard]] Eigen::MatrixXd upper() const;   ///< R without its rows of zeros.
};

/// Q R with pivots: least squares with as many columns as there are independent ones.
class PivotedQr : public Solver<Eigen::ColPivHouseholderQR<Eigen::MatrixXd>> {
 public:
  using Solver::Solver;
  [[nodiscard]] Eigen::MatrixXd thin_q() const;
  /// Of the pivots above `threshold` times the largest; 0: above rounding.
  [[nodiscard]] Eigen::Index rank(double threshold = 0.0) const;
};

extern template class Solver<Eigen::LDLT<Eigen::MatrixXd>>;
extern template class Solver<Eigen::LDLT<Eigen::MatrixXcd>>;
extern template class Solver<Eigen::LLT<Eigen::MatrixXd>>;
extern template class Solver<Eigen::PartialPivLU<Eigen::MatrixXd>>;
extern template class Solver<Eigen::PartialPivLU<Eigen::MatrixXcd>>;
extern template class Solver<Eigen::HouseholderQR<Eigen::MatrixXd>>;
extern template class Solver<Eigen::ColPivHouseholderQR<Eigen::MatrixXd>>;
extern template class Ldlt<Eigen::MatrixXd>;
extern template class Ldlt<Eigen::MatrixXcd>;
extern template class Lu<Eigen::MatrixXd>;
extern template class Lu<Eigen::MatrixXcd>;

using RealLdlt = Ldlt<Eigen::MatrixXd>;
using ComplexLdlt = Ldlt<Eigen::MatrixXcd>;
using RealLu = Lu<Eigen::MatrixXd>;
using ComplexLu = Lu<Eigen::MatrixXcd>;

/// Replaces the matrix by its factors; R stands in the upper triangle.
void qr_in_place(Eigen::MatrixXd& m);
/// R of the columns, as square as they are many; rows of zeros where there are fewer.
[[nodiscard]] Eigen::MatrixXd upper_factor(const Eigen::Ref<const Eigen::MatrixXd>& rows);

/// The shortest of the solutions that miss `right` least.
[[nodiscard]] Eigen::VectorXd shortest_solution(const Eigen::Ref<const Eigen::MatrixXd>& m,
                                                const Eigen::Ref<const Eigen::VectorXd>& right);
struct PseudoInverse {
  Eigen::MatrixXd matrix;
  Eigen::Index rank = 0;
};
[[nodiscard]] PseudoInverse pseudo_inverse(const Eigen::Ref<const Eigen::MatrixXd>& m);

/// Inverse of a square matrix that has one.
[[nodiscard]] Eigen::MatrixXd inverse(const Eigen::Ref<const Eigen::MatrixXd>& m);

/// Solutions of triangular systems; the other triangle is not read.
[[nodiscard]] Eigen::MatrixXd solve_upper(const Eigen::Ref<const Eigen::MatrixXd>& upper,
                                          const Eigen::Ref<const Eigen::MatrixXd>& right);
[[nodiscard]] Eigen::MatrixXd solve_lower(const Eigen::Ref<const Eigen::MatrixXd>& lower,
                                          const Eigen::Ref<const Eigen::MatrixXd>& right);

/// Eigenvalues of a real square matrix, pairs next to one another.
[[nodiscard]] Eigen::VectorXcd eigenvalues(const Eigen::Ref<const Eigen::MatrixXd>& m);
struct Eigenpairs {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;  ///< columns of length 1
};
[[nodiscard]] Eigenpairs eigenpairs(const Eigen::Ref<const Eigen::MatrixXd>& m);

struct SymmetricEigenpairs {
  Eigen::VectorXd values;   ///< ascending
  Eigen::MatrixXd vectors;  ///< orthonormal columns
};
/// Of a symmetric matrix, of which the lower triangle is read.
[[nodiscard]] SymmetricEigenpairs symmetric_eigenpairs(const Eigen::Ref<const Eigen::MatrixXd>& m);

}  // namespace resonid::linalg
