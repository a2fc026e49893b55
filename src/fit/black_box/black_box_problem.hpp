// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <fit/black_box/realisation.hpp>
#include <memory>
#include <optional>
#include <resonid/data/transfer_function.hpp>
#include <vector>

namespace resonid::fit::detail {

/// Model of one problem: taps on the base input, basis and its weights.
struct BlackBoxState {
  Realisation basis;
  Eigen::VectorXd weights;  ///< of F_i
  Eigen::VectorXd taps;     ///< of w(k), w(k-1): none, one or two
  Eigen::VectorXd extra;    ///< weights of constant, ramp and free responses
};

/// What a model is compared with. Signals are aligned: the known delay is out, so output[k] belongs to
/// input[k].
struct BlackBoxSignals {
  std::vector<double> input;   ///< open loop: base input w, summed when the integrator is fixed
  std::vector<double> output;  ///< closed loop: not shifted, the delay is in the loop
  /// Open loop: the input without what noise makes of it; when present, the equations are those of
  /// instrumental variables.
  std::vector<double> instrument;
  std::vector<double> excitation, reference;  ///< closed loop only
  std::vector<bool> unused;                   ///< [sample of output] simulated, but not compared; or empty
};

[[nodiscard]] inline std::size_t compared_in(const BlackBoxSignals& signals) {
  const auto left_out = std::count(signals.unused.begin(), signals.unused.end(), true);
  return signals.output.size() - static_cast<std::size_t>(left_out);
}

struct BlackBoxLayout {
  Eigen::Index order = 0;  ///< of the basis: without the fixed integrator
  Eigen::Index taps = 0;
  bool initial_state = true;
  bool constant = true;
  bool ramp = false;
  bool integrator = false;
  std::size_t delay_samples = 0;                     ///< inside the loop; open loop: 0
  std::optional<data::TransferFunction> controller;  ///< closed loop when present
};

/// What J_alpha is filtered from: the model's output (output error), the recorded one (Steiglitz-McBride), or
/// that it is left out.
enum class Regressor { model, record, none };

/// Normal equations at a state. Columns: [alpha | weights, taps | extra].
struct BlackBoxEvaluation {
  double cost = 0.0;         ///< what is minimised: the sum of squares, or its part that the instruments see
  double squares = 0.0;      ///< sum of squares
  Eigen::MatrixXd normal;    ///< J^T J, or J^T P J with the projection P on the instruments
  Eigen::VectorXd gradient;  ///< J^T r, or J^T P r
  bool valid = false;
};

class BlackBoxProblem {
 public:
  virtual ~BlackBoxProblem() = default;

  /// Solves what enters linearly (open loop: everything but the denominator; closed loop: the extras) for
  /// the given basis, starting from the state's values, and linearises there.
  virtual BlackBoxEvaluation evaluate(BlackBoxState& state, Regressor regressor) const = 0;

  /// Solves the extras only and returns output minus simulated output.
  virtual std::vector<double> residual(BlackBoxState& state) const = 0;

  /// What the model is compared with, one value per sample.
  [[nodiscard]] virtual const std::vector<double>& output() const = 0;
  [[nodiscard]] std::size_t samples() const { return output().size(); }
  /// Those that take part in the sum of squares.
  [[nodiscard]] virtual std::size_t compared() const = 0;
  /// How many of the leading columns [alpha | weights, taps] are non-linear.
  [[nodiscard]] virtual Eigen::Index nonlinear() const = 0;
  [[nodiscard]] virtual const BlackBoxLayout& layout() const = 0;
};

[[nodiscard]] std::unique_ptr<BlackBoxProblem> open_loop_problem(const BlackBoxSignals& signals,
                                                                 const BlackBoxLayout& layout);
[[nodiscard]] std::unique_ptr<BlackBoxProblem> closed_loop_problem(const BlackBoxSignals& signals,
                                                                   const BlackBoxLayout& layout);

/// Minimum-norm solution of N x = g for a positive semidefinite N, columns scaled first.
[[nodiscard]] Eigen::VectorXd solve_normal(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient);
/// Its pseudo-inverse; `full_rank` tells whether nothing was dropped.
[[nodiscard]] Eigen::MatrixXd invert_normal(const Eigen::MatrixXd& normal, bool* full_rank = nullptr);

/// Accumulates M^T M of row blocks.
class Gram {
 public:
  Gram(Eigen::Index columns, Eigen::Index block_rows)
      : block_(block_rows, columns), sum_(Eigen::MatrixXd::Zero(columns, columns)) {}

  [[nodiscard]] double* column(Eigen::Index j) { return block_.col(j).data(); }
  /// Adds the block's first rows; columns from `used` on are taken as zero.
  void add(Eigen::Index rows, Eigen::Index used);
  /// The same without the rows that are marked from `first` on.
  void add(Eigen::Index rows, Eigen::Index used, const std::vector<bool>& unused, Eigen::Index first);
  void add(Eigen::Index rows) { add(rows, block_.cols()); }
  /// The full symmetric matrix.
  [[nodiscard]] Eigen::MatrixXd matrix() const;
  /// The same with column `from` moved to the end.
  [[nodiscard]] Eigen::MatrixXd matrix_with_last(Eigen::Index from) const;

 private:
  Eigen::MatrixXd block_;
  Eigen::MatrixXd sum_;
};

/// Runs the states of a realisation; specialised for orders up to 12.
class Chain {
 public:
  explicit Chain(const Realisation& r, const Eigen::VectorXd& start);

  /// column[i * stride + k] = s_i(k), then s(k+1) = A s(k) + b v(k), k = 0 ... count - 1. v may be null (zero
  /// input).
  void run(const double* v, Eigen::Index count, double* columns, Eigen::Index stride);

  /// False once the states are too small to be seen beside those of unit size.
  [[nodiscard]] bool alive() const { return state_.cwiseAbs().sum() > 1e-18; }

 private:
  Eigen::MatrixXd a_;
  Eigen::VectorXd b_, state_, next_;
};

}  // namespace resonid::fit::detail
