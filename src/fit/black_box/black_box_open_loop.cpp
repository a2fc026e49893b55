// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/black_box_problem.hpp>
#include <memory>

namespace resonid::fit::detail {
namespace {

constexpr Eigen::Index kBlock = 250;

/// Everything but the denominator enters linearly. One pass solves that part, a second one makes the
/// derivatives
///
///   d yh/d alpha_i = -F_i x,   d yh/d c_i = F_i w,   x = G w + free response
///
/// (for the coefficients themselves: d yh/d b_i = q^-i u/A, d yh/d a_i = -q^-i yh/A). Memory does not grow
/// with the record.
class OpenLoop : public BlackBoxProblem {
 public:
  OpenLoop(const BlackBoxSignals& signals, const BlackBoxLayout& layout)
      : signals_(signals), layout_(layout) {}

  BlackBoxEvaluation evaluate(BlackBoxState& state, Regressor regressor) const override {
    BlackBoxEvaluation result;
    Eigen::VectorXd linear = pack(state);
    const auto p = linear.size();
    const auto n = layout_.order;
    if (!signals_.instrument.empty()) return evaluate_with_instruments(state, linear, regressor);
    {
      Gram gram(p + 1, kBlock);
      pass(state, linear, gram, 0, Regressor::none);
      const Eigen::MatrixXd m = gram.matrix_with_last(forced());
      if (!m.allFinite()) return result;
      linear += solve_normal(m.topLeftCorner(p, p), m.col(p).head(p));
    }
    unpack(linear, state);
    Gram gram(n + p + 1, kBlock);
    pass(state, linear, gram, n, regressor);
    const Eigen::MatrixXd m = gram.matrix_with_last(n + forced());
    result.valid = m.allFinite();
    result.cost = result.squares = m(n + p, n + p);
    result.normal = m.topLeftCorner(n + p, n + p);
    result.gradient = m.col(n + p).head(n + p);
    return result;
  }

  std::vector<double> residual(BlackBoxState& state) const override {
    Eigen::VectorXd linear = pack(state);
    const auto p = linear.size(), fixed = layout_.order + layout_.taps;
    const auto extras = p - fixed;
    for (int refinement = 0; refinement < 2; ++refinement) {
      Gram gram(p + 1, kBlock);
      pass(state, linear, gram, 0, Regressor::none);
      const Eigen::MatrixXd m = gram.matrix_with_last(forced());
      linear.tail(extras) +=
          solve_normal(m.block(fixed, fixed, extras, extras), m.col(p).segment(fixed, extras));
    }
    unpack(linear, state);
    std::vector<double> values;
    values.reserve(samples());
    Gram gram(p + 1, kBlock);
    pass(state, linear, gram, 0, Regressor::none, &values);
    return values;
  }

  [[nodiscard]] const std::vector<double>& output() const override { return signals_.output; }
  [[nodiscard]] std::size_t compared() const override { return compared_in(signals_); }
  [[nodiscard]] Eigen::Index nonlinear() const override { return layout_.order; }
  [[nodiscard]] const BlackBoxLayout& layout() const override { return layout_; }

 private:
  /// Columns J from the recorded input, Z from the instrument, residual r from the recorded input: solves
  /// Z^T r = 0, which holds at the truth however poor the instrument is.
  BlackBoxEvaluation evaluate_with_instruments(BlackBoxState& state, Eigen::VectorXd linear,
                                               Regressor regressor) const {
    BlackBoxEvaluation result;
    const auto p = linear.size(), n = layout_.order;
    for (const bool last : {false, true}) {
      const auto q = p + (last ? n : 0);
      Gram gram(2 * q + 1, kBlock);
      const Regressor asked = last ? regressor : Regressor::none;
      pass_with_instruments(state, linear, gram, asked);
      const Eigen::MatrixXd m = gram.matrix();
      if (!m.allFinite()) return result;
      const Eigen::MatrixXd across = m.block(q, 0, q, q);  // Z^T J
      const Eigen::VectorXd seen = m.col(2 * q).segment(q, q);
      const Eigen::MatrixXd inverse = invert_normal(m.block(q, q, q, q));
      result.normal = across.transpose() * inverse * across;
      result.gradient = across.transpose() * inverse * seen;
      result.cost = seen.dot(inverse * seen);
      result.squares = m(2 * q, 2 * q);
      if (!last) {
        linear += solve_normal(result.normal, result.gradient);
        unpack(linear, state);
      }
    }
    result.valid = std::isfinite(result.cost) && result.normal.allFinite();
    return result;
  }

  /// Columns [J | Z | r], each of J and Z as [alpha (when asked for) | weights, taps, constant, ramp | free].
  void pass_with_instruments(const BlackBoxState& state, const Eigen::VectorXd& linear, Gram& gram,
                             Regressor regressor) const {
    const auto n = layout_.order;
    const Eigen::Index first = regressor != Regressor::none ? n : 0, q = first + linear.size();
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(n);
    Chain real(state.basis, rest), clean(state.basis, rest), free(state.basis, state.basis.input);
    Chain of_real(state.basis, rest), of_clean(state.basis, rest);
    const auto count = static_cast<Eigen::Index>(samples());
    const Eigen::Index through = n + layout_.taps;
    const Eigen::Index frees = layout_.initial_state ? n : 0;
    Eigen::VectorXd simulated(kBlock), instrument(kBlock);
    for (Eigen::Index k = 0; k < count; k += kBlock) {
      const Eigen::Index rows = std::min(kBlock, count - k);
      const double* y = &signals_.output[static_cast<std::size_t>(k)];
      fill(real, signals_.input, gram, first, k, rows);
      fill(clean, signals_.instrument, gram, q + first, k, rows);
      if (frees > 0) free.run(nullptr, rows, gram.column(first + forced()), kBlock);
      for (Eigen::Index j = 0; j < frees; ++j)
        std::copy_n(gram.column(first + forced() + j), rows, gram.column(q + first + forced() + j));
      simulated.setZero();
      instrument.setZero();
      for (Eigen::Index j = 0; j < linear.size(); ++j) {
        if (j >= through && j < forced()) continue;
        add_scaled(gram.column(first + j), linear(j), rows, simulated);
        add_scaled(gram.column(q + first + j), linear(j), rows, instrument);
      }
      if (regressor != Regressor::none) {
        of_real.run(regressor == Regressor::model ? simulated.data() : y, rows, gram.column(0), kBlock);
        of_clean.run(instrument.data(), rows, gram.column(q), kBlock);
        for (Eigen::Index i = 0; i < n; ++i) {
          negate(gram.column(i), rows);
          negate(gram.column(q + i), rows);
        }
      }
      for (Eigen::Index j = through; j < forced(); ++j)
        add_scaled(gram.column(first + j), linear(j), rows, simulated);
      Eigen::Map<Eigen::VectorXd>(gram.column(2 * q), rows) =
          Eigen::Map<const Eigen::VectorXd>(y, rows) - simulated.head(rows);
      gram.add(rows, 2 * q + 1, signals_.unused, k);
    }
  }

  /// Columns that do not die out: weights, taps, constant, ramp. The residual's column follows them, and the
  /// free responses come last, so that they can be left out once they are over.
  [[nodiscard]] Eigen::Index forced() const {
    return layout_.order + layout_.taps + (layout_.constant ? 1 : 0) + (layout_.ramp ? 1 : 0);
  }

  [[nodiscard]] Eigen::VectorXd pack(const BlackBoxState& s) const {
    const auto fixed = layout_.order + layout_.taps;
    const auto extras = forced() - fixed + (layout_.initial_state ? layout_.order : 0);
    Eigen::VectorXd linear = Eigen::VectorXd::Zero(fixed + extras);
    if (s.weights.size() == layout_.order) linear.head(layout_.order) = s.weights;
    if (s.taps.size() == layout_.taps) linear.segment(layout_.order, layout_.taps) = s.taps;
    if (s.extra.size() == extras) linear.tail(extras) = s.extra;
    return linear;
  }
  void unpack(const Eigen::VectorXd& linear, BlackBoxState& s) const {
    s.weights = linear.head(layout_.order);
    s.taps = linear.segment(layout_.order, layout_.taps);
    s.extra = linear.tail(linear.size() - layout_.order - layout_.taps);
  }

  /// Columns [alpha (first of them) | weights, taps, constant, ramp | residual | free responses] into the
  /// sums.
  void pass(const BlackBoxState& state, const Eigen::VectorXd& linear, Gram& gram, Eigen::Index first,
            Regressor regressor, std::vector<double>* residuals = nullptr) const {
    const auto n = layout_.order;
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(n);
    Chain chain(state.basis, rest), free(state.basis, state.basis.input), output(state.basis, rest);
    const auto count = static_cast<Eigen::Index>(samples());
    const Eigen::Index last = first + forced() + 1;
    const Eigen::Index through = n + layout_.taps;
    Eigen::VectorXd simulated(kBlock);
    for (Eigen::Index k = 0; k < count; k += kBlock) {
      const Eigen::Index rows = std::min(kBlock, count - k);
      const bool transient = layout_.initial_state && free.alive();
      fill(chain, signals_.input, gram, first, k, rows);
      simulated.setZero();
      for (Eigen::Index j = 0; j < through; ++j)
        add_scaled(gram.column(first + j), linear(j), rows, simulated);
      if (transient) {
        free.run(nullptr, rows, gram.column(last), kBlock);
        for (Eigen::Index j = 0; j < n; ++j)
          add_scaled(gram.column(last + j), linear(forced() + j), rows, simulated);
      }
      if (regressor != Regressor::none) {
        const double* from =
            regressor == Regressor::model ? simulated.data() : &signals_.output[static_cast<std::size_t>(k)];
        output.run(from, rows, gram.column(0), kBlock);
        for (Eigen::Index i = 0; i < n; ++i) negate(gram.column(i), rows);
      }
      for (Eigen::Index j = through; j < forced(); ++j)
        add_scaled(gram.column(first + j), linear(j), rows, simulated);
      double* r = gram.column(last - 1);
      Eigen::Map<Eigen::VectorXd>(r, rows) =
          Eigen::Map<const Eigen::VectorXd>(&signals_.output[static_cast<std::size_t>(k)], rows) -
          simulated.head(rows);
      if (residuals != nullptr) residuals->insert(residuals->end(), r, r + rows);
      gram.add(rows, transient ? last + n : last, signals_.unused, k);
    }
  }

  /// Weights', taps', constant's and ramp's columns of one block.
  void fill(Chain& chain, const std::vector<double>& input, Gram& gram, Eigen::Index first, Eigen::Index k,
            Eigen::Index rows) const {
    const auto n = layout_.order;
    const double* w = &input[static_cast<std::size_t>(k)];
    std::vector<double> delayed;
    if (layout_.taps == 2) {
      delayed.assign(w, w + rows);
      std::rotate(delayed.begin(), delayed.end() - 1, delayed.end());
      delayed[0] = k > 0 ? w[-1] : 0.0;
    }
    chain.run(delayed.empty() ? w : delayed.data(), rows, gram.column(first), kBlock);
    Eigen::Index column = first + n;
    if (layout_.taps > 0) std::copy_n(w, rows, gram.column(column++));
    if (layout_.taps > 1) std::copy_n(delayed.data(), rows, gram.column(column++));
    if (layout_.constant) std::fill_n(gram.column(column++), rows, 1.0);
    if (layout_.ramp) {
      double* ramp = gram.column(column++);
      for (Eigen::Index i = 0; i < rows; ++i)
        ramp[i] = static_cast<double>(k + i) / static_cast<double>(samples());
    }
  }

  static void add_scaled(const double* column, double factor, Eigen::Index rows, Eigen::VectorXd& sum) {
    sum.head(rows) += factor * Eigen::Map<const Eigen::VectorXd>(column, rows);
  }
  static void negate(double* column, Eigen::Index rows) { Eigen::Map<Eigen::VectorXd>(column, rows) *= -1.0; }

  const BlackBoxSignals& signals_;
  BlackBoxLayout layout_;
};

}  // namespace

std::unique_ptr<BlackBoxProblem> open_loop_problem(const BlackBoxSignals& signals,
                                                   const BlackBoxLayout& layout) {
  return std::make_unique<OpenLoop>(signals, layout);
}

}  // namespace resonid::fit::detail
