// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/models/detail/auxiliary_loop.hpp>
#include <resonid/online/models/detail/instrumental_sums.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>

namespace resonid::online {

/// In which combinations of b_i and a_i the estimate is made; without noise and prior all give the same.
enum class Basis {
  powers,  ///< The coefficients themselves.
  /// Those of repeated differences of the signals (the delta operator's), each of about the size that it has
  /// for a resonance at this share of the sample rate: well-conditioned for slow resonances too.
  differences,
};

/// What is part of the equation besides the model of a drive.
struct EquationTerms {
  bool fixed_integrator = true;  ///< A = (1 - z^-1) C: the equation is one between differences of y.
  /// There are offsets and slow loads: all signals pass one high-pass, and what it leaves of a load that
  /// changes is a constant in the equation.
  bool offsets = true;
  bool coulomb = false;  ///< Friction of constant size against the measured velocity.
  Basis basis = Basis::differences;
};

/// The equations t = f' theta + error of a discrete model, and their instruments z, sample by sample.
///
///   free integrator    t = y(k)             f = [-y(k-1) ... -y(k-n), u(k-d-1) ... u(k-d-n), 1, -sign
///   y(k-1)] fixed integrator   t = y(k) - y(k-1)    f = [differences of y likewise, one less, u ...]
///
/// z holds the same of the auxiliary loop. Filtered are whole equations, never the signals: t, f and z pass
/// 1/((1 - rho z^-1) C) with the auxiliary model's C, and an equation that held before the filter holds after
/// it even while C changes. rho makes the integrator leak, so that constants do not grow without bound. The
/// high-pass (1 - z^-1)/(1 - rho z^-1) stands before everything, ru included. Source: Young 2011, ch. 9;
/// Gilson and Van den Hof 2005.
template <class Real, std::size_t Order>
class InstrumentalRegressors {
 public:
  using Model = DiscreteModel<Real, Order>;
  using Loop = AuxiliaryLoop<Real, Order>;
  /// Entries: n of A (the last one unused with a fixed integrator), n of B, offset, Coulomb friction.
  static constexpr std::size_t kParameters = 2 * Order + 2;
  using Vector = std::array<Real, kParameters>;

  struct Equation {
    Real target;
    Vector regressor, instrument;
  };

  struct Sample {
    Real excitation, input, output;
  };

  /// `start` places rho: at 0.98, or nearer to 1 if that is not far below the resonance.
  InstrumentalRegressors(const EquationTerms& terms, std::size_t delay_samples, const Model& start) noexcept
      : terms_(terms), delay_(delay_samples), angle_(resonance_angle(start)) {
    leak_ = Real(1) - std::min(Real(0.02), Real(0.1) * angle_);
  }

  /// The high-pass: what everything else gets.
  [[nodiscard]] Sample without_offsets(const Sample& s) noexcept {
    sign_ = static_cast<Real>((s.output > Real(0)) - (s.output < Real(0)));
    if (!terms_.offsets) return s;
    if (!started_) {  // the excitation begins here, the rest has been as it is
      excitation_pass_.past = Real(0);
      input_pass_.past = s.input - s.excitation;
      output_pass_.past = s.output;
      sign_pass_.past = sign_;
      started_ = true;
    }
    sign_ = sign_pass_.step(sign_, leak_);
    return {excitation_pass_.step(s.excitation, leak_), input_pass_.step(s.input, leak_),
            output_pass_.step(s.output, leak_)};
  }

  /// What takes the place of a missing sample, in high-passed signals: no excitation, the last input, the
  /// output that `theta` expects.
  [[nodiscard]] Sample missing(const Vector& theta) noexcept {
    Vector f;
    fill(output_, input_, f.data());
    Real y = terms_.fixed_integrator ? output_.at(0) : Real(0);
    for (std::size_t i = 0; i < kParameters; ++i) y += f[i] * theta[i];
    return {Real(0), input_.at(0), y};
  }

  /// The equation of a sample, filtered. `loop` has not been stepped to it yet.
  Equation step(const Loop& loop, Real u, Real y) noexcept {
    Row row;
    row[0] = terms_.fixed_integrator ? y - output_.at(0) : y;
    fill(output_, input_, row.data() + 1);
    fill(loop.output(), loop.input(), row.data() + 1 + kParameters);
    for (std::size_t i = 2 * Order; i < kParameters; ++i) row[1 + kParameters + i] = row[1 + i];
    for (std::size_t i = 0; i < Order; ++i) {
      const Row& past = past_[(newest_ + Order - i) % Order];
      for (std::size_t j = 0; j < row.size(); ++j) row[j] -= filter_[i] * past[j];
    }
    newest_ = (newest_ + 1) % Order;
    past_[newest_] = row;
    input_.push(u);
    output_.push(y);
    signs_.push(sign_);
    Equation equation;
    equation.target = row[0];
    std::copy_n(row.begin() + 1, kParameters, equation.regressor.begin());
    std::copy_n(row.begin() + 1 + kParameters, kParameters, equation.instrument.begin());
    return equation;
  }

  /// Correlation of the equations' errors when the output's noise is white: it passes the leaky integrator's
  /// inverse where the equations are filtered, and the high-pass where there is one. Unfiltered it also
  /// passes A, which is not regarded.
  [[nodiscard]] ErrorCorrelation<Real> error_correlation(bool filtered) const noexcept {
    return ErrorCorrelation<Real>::high_passed(leak_, (filtered ? 1 : 0) + (terms_.offsets ? 1 : 0));
  }

  /// From now on friction has its effect through B of this model,
  void set_gain(const Model& model) noexcept { gain_ = model.b; }
  /// and 1/A of this model filters.
  void set_filter(const Model& model) noexcept {
    const auto c = quotient(model);
    for (std::size_t i = 0; i < Order; ++i) filter_[i] = (i + 1 < Order ? c[i + 1] : Real(0)) - leak_ * c[i];
  }
  /// Keeps what fades without excitation from fading into slow denormal numbers.
  void flush() noexcept {
    for (Row& row : past_)
      for (Real& x : row) x = std::abs(x) < Real(1e-30) ? Real(0) : x;
  }
  [[nodiscard]] static bool filter_stable(const Model& model) noexcept {
    return roots_inside(quotient(model), Order - 1);
  }
  void reset() noexcept {
    input_ = output_ = {};
    excitation_pass_ = input_pass_ = output_pass_ = sign_pass_ = {};
    sign_ = Real(0);
    signs_ = {};
    started_ = false;
    for (Row& row : past_) row.fill(Real(0));
    newest_ = 0;
  }

  /// For how many samples after it a sample is part of the equations.
  [[nodiscard]] std::size_t span() const noexcept { return Order + delay_; }

  [[nodiscard]] Model model(const Vector& theta) const noexcept {
    Model m;
    std::copy_n(theta.begin() + Order, Order, m.b.begin());
    std::copy_n(theta.begin(), Order, m.a.begin());
    if (terms_.basis == Basis::differences) {
      combine(m.b, Order);
      combine(m.a, coefficients());
    }
    if (terms_.fixed_integrator) {  // (1 - z^-1)(1 + c_1 z^-1 + ...)
      m.a[Order - 1] = Real(0);
      for (std::size_t i = Order; i-- > 0;) m.a[i] -= i > 0 ? m.a[i - 1] : Real(1);
    }
    return m;
  }
  [[nodiscard]] Vector parameters(const Model& model) const noexcept {
    Model m = model;
    if (terms_.fixed_integrator) {
      const auto c = quotient(model);
      for (std::size_t i = 0; i < Order; ++i) m.a[i] = i + 1 < Order ? c[i + 1] : Real(0);
    }
    if (terms_.basis == Basis::differences) {
      combine(m.b, Order);
      combine(m.a, coefficients());
    }
    Vector theta{};
    std::copy_n(m.a.begin(), Order, theta.begin());
    std::copy_n(m.b.begin(), Order, theta.begin() + Order);
    return theta;
  }
  /// Typical size of each parameter of a machine like `model`; 0 for those that are not estimated. Of
  /// repeated differences, each one is by the resonance's angle per sample smaller than the next.
  [[nodiscard]] Vector sizes(const Model& model) const noexcept {
    Vector size{};
    const bool powers = terms_.basis == Basis::powers;
    const Real angle = powers ? Real(1) : angle_;
    Real gain(0);
    for (const Real b : model.b) gain = std::max(gain, std::abs(b));
    Real power(1);
    for (std::size_t i = Order; i-- > 0; power *= angle) size[Order + i] = (powers ? Real(1) : gain) * power;
    power = Real(1);
    for (std::size_t i = coefficients(); i-- > 0; power *= angle) size[i] = power;
    if (terms_.offsets) size[2 * Order] = size[Order];
    if (terms_.coulomb) size[2 * Order + 1] = Real(10);  // in units of torque
    return size;
  }
  /// d[b_1 ... b_n, a_1 ... a_n]/d theta, row by row, found through model(), which is affine.
  [[nodiscard]] std::array<Vector, 2 * Order> gradient() const noexcept {
    std::array<Vector, 2 * Order> g;
    const Model origin = model(Vector{});
    for (std::size_t j = 0; j < kParameters; ++j) {
      Vector unit{};
      unit[j] = Real(1);
      const Model m = model(unit);
      for (std::size_t i = 0; i < Order; ++i) {
        g[i][j] = m.b[i] - origin.b[i];
        g[Order + i][j] = m.a[i] - origin.a[i];
      }
    }
    return g;
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return intact_flags(terms_.fixed_integrator, terms_.offsets, terms_.coulomb, started_) &&
           resonid::intact(terms_.basis, Basis::differences) && newest_ < Order && delay_ <= Loop::kMaxDelay;
  }

 private:
  using Row = std::array<Real, 1 + 2 * kParameters>;  // t, f, z
  using History = SignalHistory<Real>;
  struct HighPass {
    Real past = Real(0), value = Real(0);
    Real step(Real x, Real pole) noexcept {
      value = pole * value + x - past;
      past = x;
      return value;
    }
  };

  /// Angle of the first resonance per sample (rad), at most 1, which it also is without one.
  static Real resonance_angle(const Model& model) noexcept {
    const auto modes = SampledModes<Order>(model, 1.0).resonances();
    return modes.empty() ? Real(1) : static_cast<Real>(std::min(1.0, kTwoPi * modes[0].frequency_hz));
  }
  [[nodiscard]] std::size_t coefficients() const noexcept {
    return terms_.fixed_integrator ? Order - 1 : Order;
  }

  /// 1, c_1 ... c_{n-1} of A/(1 - z^-1), the remainder left out.
  static std::array<Real, Order> quotient(const Model& model) noexcept {
    std::array<Real, Order> c;
    c[0] = Real(1);
    for (std::size_t i = 1; i < Order; ++i) c[i] = c[i - 1] + model.a[i - 1];
    return c;
  }

  /// x_1, x_2, x_3 ... become x_1, x_1 - x_2, x_1 - 2 x_2 + x_3 ...
  static void difference(Real* x, std::size_t n) noexcept {
    for (std::size_t level = 1; level < n; ++level)
      for (std::size_t i = n - 1; i >= level; --i) x[i] = x[i - 1] - x[i];
  }
  /// The coefficients of the x from those of the differences; and back, since it is its own inverse.
  static void combine(std::array<Real, Order>& c, std::size_t n) noexcept {
    for (std::size_t level = n; level-- > 1;)
      for (std::size_t i = level; i < n; ++i) {
        c[i - 1] += c[i];
        c[i] = -c[i];
      }
  }

  void fill(const History& output, const History& input, Real* f) const noexcept {
    const std::size_t n = coefficients();
    f[Order - 1] = Real(0);
    for (std::size_t i = 0; i < n; ++i)
      f[i] = terms_.fixed_integrator ? output.at(i + 1) - output.at(i) : -output.at(i);
    for (std::size_t i = 0; i < Order; ++i) f[Order + i] = input.at(i + delay_);
    if (terms_.basis == Basis::differences) {
      difference(f, n);
      difference(f + Order, Order);
    }
    f[2 * Order] = terms_.offsets ? Real(1) : Real(0);
    f[2 * Order + 1] = Real(0);
    if (terms_.coulomb)  // -B sign of the velocity: y(k-1) is that at the torque u(k-d-1)
      for (std::size_t i = 0; i < Order; ++i) f[2 * Order + 1] -= gain_[i] * signs_.at(i);
  }

  EquationTerms terms_;
  std::size_t delay_;
  Real angle_, leak_ = Real(0);
  HighPass excitation_pass_, input_pass_, output_pass_, sign_pass_;
  Real sign_ = Real(0);
  bool started_ = false;
  History input_, output_, signs_;
  std::array<Real, Order> gain_{};  // b_i for the friction
  std::array<Real, Order> filter_{};
  std::array<Row, Order> past_{};
  std::size_t newest_ = 0;
};

}  // namespace resonid::online
