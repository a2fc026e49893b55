// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/black_box_problem.hpp>
#include <fit/controller_law.hpp>
#include <memory>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

constexpr Eigen::Index kBlock = 512;

/// From rest.
class Controller {
 public:
  explicit Controller(const data::TransferFunction& c) : law_(c), state_(law_.order() + 1, 0.0) {}
  double step(double e) { return law_.step(e, state_); }
  [[nodiscard]] Eigen::Index order() const { return static_cast<Eigen::Index>(law_.order()); }

 private:
  ControllerLaw law_;
  std::vector<double> state_;
};

/// x = G w, yh(k) = x(k - delay), w = e + C (r - yh), from rest.
class Loop {
 public:
  Loop(const BlackBoxState& model, const BlackBoxLayout& layout)
      : model_(model),
        integrator_(layout.integrator),
        direct_(layout.taps > (layout.integrator ? 1 : 0)),
        controller_(*layout.controller),
        state_(Eigen::VectorXd::Zero(layout.order)),
        late_(layout.delay_samples, 0.0) {}

  void step(double e, double r) {
    before_ = state_;
    v_ = sum_;
    double x = model_.weights.dot(state_);
    if (integrator_) x += model_.taps(model_.taps.size() - 1) * sum_;
    output_ = late_.empty() ? x : late_[at_];
    w_ = e + controller_.step(r - output_);
    if (direct_) x += model_.taps(0) * (sum_ + w_);
    if (!late_.empty()) {
      late_[at_] = x;
      at_ = (at_ + 1) % late_.size();
    }
    if (integrator_)
      sum_ += w_;
    else
      v_ = w_;
    state_ = model_.basis.transition * before_ + model_.basis.input * v_;
  }

  // At the sample just stepped.
  [[nodiscard]] const Eigen::VectorXd& states() const { return before_; }
  [[nodiscard]] double input() const { return w_; }  ///< w
  [[nodiscard]] double output() const { return output_; }
  /// What tap i weighs: w or its running sum; that of the sample before, behind an integrator.
  [[nodiscard]] double tapped(Eigen::Index i) const {
    if (!integrator_) return w_;
    return direct_ && i == 0 ? sum_ : v_;
  }

 private:
  const BlackBoxState& model_;
  bool integrator_, direct_;
  Controller controller_;
  Eigen::VectorXd state_, before_;
  std::vector<double> late_;
  std::size_t at_ = 0;
  double sum_ = 0.0, v_ = 0.0, w_ = 0.0, output_ = 0.0;
};

/// The loop simulated with the known controller from excitation and reference. With S = 1/(1 + C q^-d G):
///
///   d yh/d alpha_i = -S F_i yh,   d yh/d c_i = S q^-d F_i w
///
/// the states of the same loop driven by w, and F_i of its input when it is driven by yh. What plant, delay
/// and controller remember from before the record is a free response of the loop, spanned by its shifted
/// impulse responses.
class ClosedLoop : public BlackBoxProblem {
 public:
  ClosedLoop(const BlackBoxSignals& signals, const BlackBoxLayout& layout)
      : signals_(signals), layout_(layout) {}

  BlackBoxEvaluation evaluate(BlackBoxState& state, Regressor) const override {
    BlackBoxEvaluation result;
    const Eigen::MatrixXd free = free_responses(state);
    if (!free.allFinite()) return result;
    const auto n = nonlinear(), extras = free.cols() + (layout_.constant ? 1 : 0);
    if (state.extra.size() != extras) state.extra = Eigen::VectorXd::Zero(extras);
    if (!solve_extras(state, free)) return result;
    Gram gram(n + extras + 1, kBlock);
    linearise(state, free, gram);
    const Eigen::MatrixXd m = gram.matrix();
    result.valid = m.allFinite();
    result.cost = result.squares = m(n + extras, n + extras);
    result.normal = m.topLeftCorner(n + extras, n + extras);
    result.gradient = m.col(n + extras).head(n + extras);
    return result;
  }

  std::vector<double> residual(BlackBoxState& state) const override {
    const Eigen::MatrixXd free = free_responses(state);
    state.extra = Eigen::VectorXd::Zero(free.cols() + (layout_.constant ? 1 : 0));
    solve_extras(state, free);
    solve_extras(state, free);
    std::vector<double> left(samples());
    Loop loop(state, layout_);
    for (std::size_t k = 0; k < left.size(); ++k) {
      loop.step(signals_.excitation[k], signals_.reference[k]);
      left[k] = signals_.output[k] - loop.output() - transient(state, free, k) - constant(state);
    }
    return left;
  }

  [[nodiscard]] const std::vector<double>& output() const override { return signals_.output; }
  [[nodiscard]] std::size_t compared() const override { return compared_in(signals_); }
  [[nodiscard]] Eigen::Index nonlinear() const override { return 2 * layout_.order + layout_.taps; }
  [[nodiscard]] const BlackBoxLayout& layout() const override { return layout_; }

 private:
  [[nodiscard]] bool used(std::size_t k) const { return signals_.unused.empty() || !signals_.unused[k]; }
  [[nodiscard]] double constant(const BlackBoxState& s) const {
    return layout_.constant ? s.extra(s.extra.size() - 1) : 0.0;
  }
  static double transient(const BlackBoxState& s, const Eigen::MatrixXd& free, std::size_t k) {
    const auto row = static_cast<Eigen::Index>(k);
    return row < free.rows() ? free.row(row).dot(s.extra.head(free.cols())) : 0.0;
  }

  /// Orthonormal columns [sample, response] as far as the responses last.
  [[nodiscard]] Eigen::MatrixXd free_responses(const BlackBoxState& state) const {
    if (!layout_.initial_state) return Eigen::MatrixXd(0, 0);
    const Eigen::Index count = layout_.order + (layout_.integrator ? 1 : 0) +
                               Controller(*layout_.controller).order() +
                               static_cast<Eigen::Index>(layout_.delay_samples);
    Loop loop(state, layout_);
    std::vector<double> impulse;
    double largest = 0.0;
    std::size_t last = 0;
    for (std::size_t k = 0; k < samples() + static_cast<std::size_t>(count); ++k) {
      loop.step(k == 0 ? 1.0 : 0.0, 0.0);
      impulse.push_back(loop.output());
      largest = std::max(largest, std::abs(impulse.back()));
      if (!std::isfinite(largest)) return Eigen::MatrixXd::Constant(1, 1, largest);
      if (std::abs(impulse.back()) > 1e-16 * largest) last = k;
      if (k > last + 200) break;
    }
    const auto rows = std::max<Eigen::Index>(count, static_cast<Eigen::Index>(last));
    impulse.resize(static_cast<std::size_t>(rows + count) + 1, 0.0);
    Eigen::MatrixXd columns(std::min(rows, static_cast<Eigen::Index>(samples())), count);
    for (Eigen::Index i = 0; i < columns.rows(); ++i)
      for (Eigen::Index j = 0; j < count; ++j) columns(i, j) = impulse[static_cast<std::size_t>(i + j) + 1];
    const linalg::PivotedQr qr(columns);
    Eigen::MatrixXd thin = qr.thin_q();
    thin.rightCols(count - qr.rank(1e-11)).setZero();
    return thin;
  }

  bool solve_extras(BlackBoxState& state, const Eigen::MatrixXd& free) const {
    const auto extras = state.extra.size();
    Gram gram(extras + 1, kBlock);
    Loop loop(state, layout_);
    Eigen::Index row = 0;
    for (std::size_t k = 0; k < samples(); ++k) {
      loop.step(signals_.excitation[k], signals_.reference[k]);
      write_extras(gram, 0, row, free, k);
      gram.column(extras)[row] =
          signals_.output[k] - loop.output() - transient(state, free, k) - constant(state);
      row += used(k) ? 1 : 0;
      if (row == kBlock || k + 1 == samples()) {
        gram.add(row);
        row = 0;
      }
    }
    const Eigen::MatrixXd m = gram.matrix();
    if (!m.allFinite()) return false;
    state.extra += solve_normal(m.topLeftCorner(extras, extras), m.col(extras).head(extras));
    return state.extra.allFinite();
  }

  void write_extras(Gram& gram, Eigen::Index first, Eigen::Index row, const Eigen::MatrixXd& free,
                    std::size_t k) const {
    const auto at = static_cast<Eigen::Index>(k);
    for (Eigen::Index j = 0; j < free.cols(); ++j)
      gram.column(first + j)[row] = at < free.rows() ? free(at, j) : 0.0;
    if (layout_.constant) gram.column(first + free.cols())[row] = 1.0;
  }

  /// Columns [alpha | weights, tap | extras | residual].
  void linearise(const BlackBoxState& state, const Eigen::MatrixXd& free, Gram& gram) const {
    const auto n = layout_.order, first = nonlinear(), extras = state.extra.size();
    Loop loop(state, layout_), by_input(state, layout_), by_output(state, layout_);
    Controller controller(*layout_.controller);
    Eigen::VectorXd of_output = Eigen::VectorXd::Zero(n);
    std::vector<double> late(layout_.delay_samples + 1, 0.0);
    Eigen::Index row = 0;
    for (std::size_t k = 0; k < samples(); ++k) {
      loop.step(signals_.excitation[k], signals_.reference[k]);
      const double y = loop.output() + transient(state, free, k);
      late[k % late.size()] = signals_.excitation[k] + controller.step(signals_.reference[k] - y);
      by_input.step(late[(k + 1) % late.size()], 0.0);
      by_output.step(y, 0.0);
      for (Eigen::Index i = 0; i < n; ++i) {
        gram.column(i)[row] = -of_output(i);
        gram.column(n + i)[row] = by_input.states()(i);
      }
      of_output = (state.basis.transition * of_output + state.basis.input * by_output.input()).eval();
      for (Eigen::Index t = 0; t < layout_.taps; ++t) gram.column(2 * n + t)[row] = by_input.tapped(t);
      write_extras(gram, first, row, free, k);
      gram.column(first + extras)[row] = signals_.output[k] - y - constant(state);
      row += used(k) ? 1 : 0;
      if (row == kBlock || k + 1 == samples()) {
        gram.add(row);
        row = 0;
      }
    }
  }

  const BlackBoxSignals& signals_;
  BlackBoxLayout layout_;
};

}  // namespace

std::unique_ptr<BlackBoxProblem> closed_loop_problem(const BlackBoxSignals& signals,
                                                     const BlackBoxLayout& layout) {
  return std::make_unique<ClosedLoop>(signals, layout);
}

}  // namespace resonid::fit::detail
